#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>

#include "bus/messages.h"

namespace legopt::client {

/// Converts the body of a request or reply to JSON: fields by name, in the order of the .lcm file; 64-bit numbers
/// exact, NaN as null, nested messages as objects. Returns nullopt if `body` is not exactly one legal message of that
/// call; `why` then contains the error. Source: bus/message_fields.h, PROTOCOL.md, section 7. Thread rule: none, no
/// state.
std::optional<nlohmann::ordered_json> BodyToJson(bus::MessageType type, bool of_reply, std::string_view body,
                                                 std::string* why);

}  // namespace legopt::client
