#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>
#include <type_traits>

#include "legopt_msg/all.hpp"

/// @file
/// Every generated message of package legopt_msg, and which call each belongs to, as lcmtypes/messages.def lists them.
/// Thread rule: none, types and constants.

namespace legopt::bus {

/// Version of the protocol that this build speaks. PROTOCOL.md, section 2.
inline constexpr std::int16_t kProtocolVersion = 6;

/// Message type of a call: what stands in frame.type.
enum class MessageType : std::int16_t {
#define LEGOPT_PART(name)
#define LEGOPT_CALL(number, Name, name, callers) k##Name = number,
#include "lcmtypes/messages.def"
};

/// CallOf<Request>::kType and CallOf<Request>::Reply: which call a request message opens, and what answers it.
template <class Request>
struct CallOf;
#define LEGOPT_PART(name)
#define LEGOPT_CALL(number, Name, name, callers)               \
  template <>                                                  \
  struct CallOf<legopt_msg::name##_request> {                  \
    static constexpr MessageType kType = MessageType::k##Name; \
    using Reply = legopt_msg::name##_reply;                    \
  };
#include "lcmtypes/messages.def"

/// A list of message types, to walk over: `[]<class... M>(MessageList<M...>) { ... }(AllMessages())`.
template <class... Message>
struct MessageList {
  /// Messages in the list.
  static constexpr std::size_t kSize = sizeof...(Message);
};
/// The messages of both lists, those of `a` first.
template <class... A, class... B>
constexpr MessageList<A..., B...> operator+(MessageList<A...> /*a*/, MessageList<B...> /*b*/) {
  return {};
}

/// The request of every call, by message type: kProbe first.
using Requests = decltype(MessageList<>()
#define LEGOPT_PART(name)
#define LEGOPT_CALL(number, Name, name, callers) +MessageList<legopt_msg::name##_request>()
#include "lcmtypes/messages.def"
);
/// The types of calls are 1 .. kLastMessageType.
inline constexpr auto kLastMessageType = static_cast<std::int16_t>(Requests::kSize);

/// Every message, in the order of messages.def; a request before its reply.
using AllMessages = decltype(MessageList<>()
#define LEGOPT_PART(name) +MessageList<legopt_msg::name>()
#define LEGOPT_CALL(number, Name, name, callers) +MessageList<legopt_msg::name##_request, legopt_msg::name##_reply>()
#include "lcmtypes/messages.def"
);

/// "probe", "hello", ...; "unknown" for anything else.
constexpr std::string_view ToString(MessageType type) {
  switch (type) {
#define LEGOPT_PART(name)
#define LEGOPT_CALL(number, Name, name, callers) \
  case MessageType::k##Name:                     \
    return #name;
#include "lcmtypes/messages.def"
  }
  return "unknown";
}

namespace messages_internal {

/// Whether the calls have the numbers 1, 2, 3, ...
template <class... Request>
constexpr bool AreNumberedInOrder(MessageList<Request...> /*requests*/) {
  std::int16_t number = 0;
  return ((static_cast<std::int16_t>(CallOf<Request>::kType) == ++number) && ...);
}
static_assert(AreNumberedInOrder(Requests()), "lcmtypes/messages.def: the calls' numbers are 1, 2, 3, ...");

/// Place of a message in a list; the length of the list when it is not there.
template <class Message, class... All>
constexpr std::size_t IndexIn(MessageList<All...> /*all*/) {
  constexpr std::array<bool, sizeof...(All)> kIsIt = {std::is_same_v<Message, All>...};
  std::size_t index = 0;
  while (index < kIsIt.size() && !kIsIt[index]) ++index;
  return index;
}

}  // namespace messages_internal

/// Where a message stands in AllMessages.
template <class Message>
inline constexpr std::size_t kMessageIndex = messages_internal::IndexIn<Message>(AllMessages());

}  // namespace legopt::bus
