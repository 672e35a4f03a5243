#pragma once

#include <cstdint>
#include <string_view>
#include <tuple>
#include <type_traits>

#include "bus/field_check.h"

/// @file
/// Tables of the fields of all messages. Everything else about fields is derived from them at compile time: byte
/// layout, validation, corrections by the sender, JSON, samples for tests and fuzzers. Private to bus and to code that
/// displays messages. Code that only sends and receives includes codec.h, which compiles faster. Thread rule: none,
/// constants.

/// Fields of messages: rows, rules and limits.
namespace legopt::bus::fields {

/// Rule of an unrestricted field.
struct AnyValue {};

/// Checks a condition between a field and others, immediately after the field's own rule.
template <class Message>
using Condition = void (*)(const Message& message, FieldCheck& check);

/// Row of a table: name and member as in the .lcm file, the rule (field_rules.h), and an optional condition.
template <class Message, class Value, class Rule = AnyValue>
struct Field {
  std::string_view name;  ///< name in errors and JSON
  Value Message::*member;
  Rule rule{};                             ///< rule for the value alone
  Condition<Message> condition = nullptr;  ///< condition that also involves other fields; null: none
};
/// Deduces an unrestricted field.
template <class Message, class Value>
Field(std::string_view, Value Message::*) -> Field<Message, Value>;
/// Deduces a field with a rule.
template <class Message, class Value, class Rule>
Field(std::string_view, Value Message::*, Rule) -> Field<Message, Value, Rule>;
/// Deduces a field with a rule and a condition.
template <class Message, class Value, class Rule>
Field(std::string_view, Value Message::*, Rule, Condition<Message>) -> Field<Message, Value, Rule>;

/// Table of one message: `kRows` is a std::tuple of Field in the order of the .lcm file. Conditions and limits that
/// depend on other fields are static functions. An optional `static void Sanitize(Message&)` applies the sender's
/// corrections that no rule covers, before those of the rules. Using the fields of a message without a description is a
/// compile error. The tests compare each description with its .lcm file.
template <class Message>
struct Description;

}  // namespace legopt::bus::fields

namespace legopt::bus {

/// Rows of a message.
template <class Message>
inline constexpr const auto& kFields = fields::Description<Message>::kRows;

}  // namespace legopt::bus
