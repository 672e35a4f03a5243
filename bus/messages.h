#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>
#include <type_traits>

#include "legopt_msg/all.hpp"

/// @file
/// All generated messages of package legopt_msg and the call to which each belongs, from lcmtypes/messages.def. Thread
/// rule: none, types and constants.

namespace legopt::bus {

/// Protocol version of this build. PROTOCOL.md, section 2.
inline constexpr std::int16_t kProtocolVersion = 11;

/// Message type of a call: the value of frame.type.
enum class MessageType : std::int16_t {
#define LEGOPT_PART(name)
#define LEGOPT_CALL(number, Name, name, callers) k##Name = number,
#include "lcmtypes/messages.def"
};

/// Maps the request of a call to its message type (CallOf<Request>::kType) and its reply (CallOf<Request>::Reply).
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

/// List of message types for iteration: `[]<class... M>(MessageList<M...>) { ... }(AllMessages())`.
template <class... Message>
struct MessageList {
  /// Number of messages in the list.
  static constexpr std::size_t kSize = sizeof...(Message);
};
/// Concatenates two lists.
template <class... A, class... B>
constexpr MessageList<A..., B...> operator+(MessageList<A...> /*a*/, MessageList<B...> /*b*/) {
  return {};
}

/// Requests of all calls, by message type: kProbe first.
using Requests = decltype(MessageList<>()
#define LEGOPT_PART(name)
#define LEGOPT_CALL(number, Name, name, callers) +MessageList<legopt_msg::name##_request>()
#include "lcmtypes/messages.def"
);
/// Largest message type; the types of calls are 1 .. kLastMessageType.
inline constexpr auto kLastMessageType = static_cast<std::int16_t>(Requests::kSize);

/// All messages, in the order of messages.def; a request precedes its reply.
using AllMessages = decltype(MessageList<>()
#define LEGOPT_PART(name) +MessageList<legopt_msg::name>()
#define LEGOPT_CALL(number, Name, name, callers) +MessageList<legopt_msg::name##_request, legopt_msg::name##_reply>()
#include "lcmtypes/messages.def"
);

/// Returns "probe", "hello", ...; "unknown" for any other value.
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

/// Returns whether the calls have the numbers 1, 2, 3, ...
template <class... Request>
constexpr bool AreNumberedInOrder(MessageList<Request...> /*requests*/) {
  std::int16_t number = 0;
  return ((static_cast<std::int16_t>(CallOf<Request>::kType) == ++number) && ...);
}
static_assert(AreNumberedInOrder(Requests()), "lcmtypes/messages.def: the calls' numbers are 1, 2, 3, ...");

/// Returns the index of a message in a list, or the length of the list if it is missing.
template <class Message, class... All>
constexpr std::size_t IndexIn(MessageList<All...> /*all*/) {
  constexpr std::array<bool, sizeof...(All)> kIsIt = {std::is_same_v<Message, All>...};
  std::size_t index = 0;
  while (index < kIsIt.size() && !kIsIt[index]) ++index;
  return index;
}

}  // namespace messages_internal

/// Index of a message in AllMessages.
template <class Message>
inline constexpr std::size_t kMessageIndex = messages_internal::IndexIn<Message>(AllMessages());

}  // namespace legopt::bus
