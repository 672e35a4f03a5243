#include "client/tap/message_json.h"

#include <array>
#include <cstddef>
#include <tuple>
#include <utility>
#include <vector>

#include "bus/codec.h"
#include "bus/message_fields.h"

namespace legopt::client {
namespace {

using Json = nlohmann::ordered_json;

template <class Message>
Json ToJson(const Message& message);

Json ValueToJson(const std::string& text) { return text; }
template <class Number>
requires std::is_arithmetic_v<Number> Json ValueToJson(Number number) { return number; }
template <class Message>
requires std::is_class_v<Message> Json ValueToJson(const Message& nested) { return ToJson(nested); }
template <class Value>
Json ValueToJson(const std::vector<Value>& values) {
  Json array = Json::array();
  for (const Value& value : values) array.push_back(ValueToJson(value));
  return array;
}

template <class Message>
Json ToJson(const Message& message) {
  Json object = Json::object();
  std::apply(
      [&](const auto&... field) { ((object[std::string(field.name)] = ValueToJson(message.*field.member)), ...); },
      bus::kFields<Message>);
  return object;
}

using Decoder = std::optional<Json> (*)(std::string_view body, std::string* why);

template <class Message>
std::optional<Json> DecodeToJson(std::string_view body, std::string* why) {
  const auto message = bus::Decode<Message>(body, why);
  if (!message) return std::nullopt;
  return ToJson(*message);
}

struct CallDecoders {
  Decoder request;
  Decoder reply;
};

template <class... Request>
constexpr std::array<CallDecoders, sizeof...(Request)> DecodersOf(bus::MessageList<Request...> /*all*/) {
  return {CallDecoders{&DecodeToJson<Request>, &DecodeToJson<typename bus::CallOf<Request>::Reply>}...};
}

constexpr std::array kDecoders = DecodersOf(bus::Requests());

}  // namespace

std::optional<nlohmann::ordered_json> BodyToJson(bus::MessageType type, bool of_reply, std::string_view body,
                                                 std::string* why) {
  const auto index = static_cast<std::int16_t>(type) - 1;
  if (index < 0 || index >= bus::kLastMessageType) {
    if (why != nullptr) *why = "no such message type";
    return std::nullopt;
  }
  const CallDecoders& decoders = kDecoders[static_cast<std::size_t>(index)];
  return (of_reply ? decoders.reply : decoders.request)(body, why);
}

}  // namespace legopt::client
