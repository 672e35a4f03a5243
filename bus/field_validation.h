#pragma once

#include <string>
#include <tuple>
#include <type_traits>
#include <vector>

#include "bus/message_fields.h"

/// @file
/// Applies the rules of a message's fields to a message. Private to bus; instantiated for every message in codec.cpp.
/// Thread rule: none, no state.

namespace legopt::bus::fields {

/// True if a type is a std::vector.
template <class Value>
inline constexpr bool kIsVector = false;
template <class Element>
inline constexpr bool kIsVector<std::vector<Element>> = true;

/// True if values of the type are nested messages.
template <class Value>
inline constexpr bool kIsMessage = std::is_class_v<Value> && !std::is_same_v<Value, std::string> && !kIsVector<Value>;

/// Declared here for recursion.
template <class Message>
std::string FaultOf(const Message& message);

/// Checks a field's own rule and its condition, but not the elements of arrays.
template <class Message, class Value, class Rule>
void CheckField(const Field<Message, Value, Rule>& field, const Message& message, FieldCheck& check) {
  static_assert(!kIsMessage<Value>, "a message stands within another as an element of an array");
  if constexpr (!kIsVector<Value> && !std::is_same_v<Rule, AnyValue>) {
    field.rule.Check(check, field.name, message.*field.member, message);
  }
  if (field.condition != nullptr && check.ok()) field.condition(message, check);
}

/// Checks the elements of an array.
template <class Message, class Element, class Rule>
void CheckElements(const Field<Message, std::vector<Element>, Rule>& field, const Message& message, FieldCheck& check) {
  const std::vector<Element>& elements = message.*field.member;
  if constexpr (kIsMessage<Element>) {
    for (std::size_t i = 0; check.ok() && i < elements.size(); ++i) check.Nested(field.name, i, FaultOf(elements[i]));
  } else if constexpr (!std::is_same_v<Rule, AnyValue>) {
    for (std::size_t i = 0; check.ok() && i < elements.size(); ++i) {
      field.rule.element.Check(check, field.name, elements[i], message);
    }
  }
}
/// Does nothing for fields that are not arrays.
template <class Message, class Value, class Rule>
void CheckElements(const Field<Message, Value, Rule>& /*field*/, const Message& /*message*/, FieldCheck& /*check*/) {}

/// Returns the first fault, or an empty text if the message is valid. Checks all fields in their order before the
/// elements of arrays.
template <class Message>
std::string FaultOf(const Message& message) {
  FieldCheck check;
  std::apply(
      [&](const auto&... field) {
        ((CheckField(field, message, check), check.ok()) && ...);
        if (check.ok()) ((CheckElements(field, message, check), check.ok()) && ...);
      },
      kFields<Message>);
  return check.fault();
}

/// Corrects a message before sending (field_rules.h): counts, texts for humans, numbers that are not available.
template <class Message>
void Sanitize(Message& message) {
  if constexpr (requires { Description<Message>::Sanitize(message); }) Description<Message>::Sanitize(message);
  const auto put_right = [&message](const auto& field) {
    if constexpr (requires { field.rule.Sanitize(message, field.member); }) field.rule.Sanitize(message, field.member);
  };
  std::apply([&](const auto&... field) { (put_right(field), ...); }, kFields<Message>);
}

}  // namespace legopt::bus::fields
