#pragma once

#include <cstdint>
#include <string_view>
#include <tuple>
#include <type_traits>

#include "bus/field_check.h"

/// @file
/// The rows that say all that this program knows of the fields of a message, and which everything else follows from at
/// compile time: the byte layout, validation, what a sender puts right, JSON, samples for tests and fuzzers. Private to
/// bus and to who shows messages; whoever only sends and receives includes codec.h and does not pay for this.
/// Thread rule: none, constants.

/// Fields of messages: rows, rules and limits.
namespace legopt::bus::fields {

/// The rule of a field that may hold anything.
struct Anything {};

/// What must hold between a field and others, checked right after the field's own rule.
template <class Message>
using Condition = void (*)(const Message& message, FieldCheck& check);

/// One row: name and member as in the .lcm file; the rule (field_rules.h); a condition, if there is one.
template <class Message, class Value, class Rule = Anything>
struct Field {
  std::string_view name;                   ///< for errors and JSON
  Value Message::*member;                  ///< where the value is
  Rule rule{};                             ///< what it may be by itself
  Condition<Message> condition = nullptr;  ///< what must hold beside others; null: nothing
};
/// Of a field that may hold anything.
template <class Message, class Value>
Field(std::string_view, Value Message::*) -> Field<Message, Value>;
/// Of a field with a rule.
template <class Message, class Value, class Rule>
Field(std::string_view, Value Message::*, Rule) -> Field<Message, Value, Rule>;
/// Of a field with a rule and a condition.
template <class Message, class Value, class Rule>
Field(std::string_view, Value Message::*, Rule, Condition<Message>) -> Field<Message, Value, Rule>;

/// One specialisation per message: `kRows`, a std::tuple of Field in the order of the .lcm file, with the conditions
/// and the limits that depend on other fields as static functions. It may have `static void PutRight(Message&)`: what a
/// sender repairs beyond the rules, before they are applied. A message without a description does not compile where
/// its fields are needed, and the tests compare each with its .lcm file.
template <class Message>
struct Description;

}  // namespace legopt::bus::fields

namespace legopt::bus {

/// The rows of a message.
template <class Message>
inline constexpr const auto& kFields = fields::Description<Message>::kRows;

}  // namespace legopt::bus
