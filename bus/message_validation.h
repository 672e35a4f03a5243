#pragma once

#include <array>
#include <cstddef>
#include <string>
#include <string_view>
#include <tuple>
#include <type_traits>
#include <vector>

#include "bus/message_fields.h"

namespace legopt::bus {

/// @file
/// Byte layout of each message, used to limit the memory that a generated decoder allocates.
///
/// The generated decoders allocate vectors of the declared size before checking that enough bytes follow: a datagram of
/// 100 bytes could cost gigabytes. LayoutFits() therefore checks the encoded bytes first. Grammar of a layout, in the
/// order of the fields: '1' '2' '4' '8' for a number with that many bytes; 's' for an LCM string (int32 length
/// including the final NUL, bytes, NUL); "a(...)" for an int32 count and that many groups. The fingerprint is not
/// included. Computed from kFields (message_fields.h) at compile time; the tests compare each layout with the generated
/// encoder. Private to bus. Thread rule: none, no state.

/// Returns whether `bytes` (after the fingerprint) is exactly one message of this layout.
bool LayoutFits(std::string_view layout, std::string_view bytes);

namespace layout_internal {

/// Builder of a layout at compile time.
struct Text {
  std::array<char, 128> chars{};  ///< the layout's first `size` characters, then zeros
  std::size_t size = 0;           ///< characters written

  /// Appends a character. Overflow is a compile error.
  constexpr void Add(char c) { chars.at(size++) = c; }
  /// Removes the count that LCM writes as the field before a vector; in the layout it is part of the group.
  constexpr void TakeBackCount() {
    if (size == 0 || chars.at(size - 1) != '4') throw "the field before a vector must be its int32 count";
    --size;
  }
};

/// True if a type is a std::vector.
template <class Value>
struct IsVector : std::false_type {};
template <class Element>
struct IsVector<std::vector<Element>> : std::true_type {};

/// Appends the layouts of all fields of a message.
template <class Message>
constexpr void AddFields(Text& text);

/// Appends the layout of one value.
template <class Value>
constexpr void AddValue(Text& text) {
  if constexpr (std::is_arithmetic_v<Value>) {
    text.Add(static_cast<char>('0' + sizeof(Value)));
  } else if constexpr (std::is_array_v<Value>) {
    for (std::size_t i = 0; i < std::extent_v<Value>; ++i) AddValue<std::remove_extent_t<Value>>(text);
  } else if constexpr (std::is_same_v<Value, std::string>) {
    text.Add('s');
  } else if constexpr (IsVector<Value>::value) {
    text.TakeBackCount();
    text.Add('a');
    text.Add('(');
    AddValue<typename Value::value_type>(text);
    text.Add(')');
  } else {
    AddFields<Value>(text);
  }
}

/// Appends the layout of one field.
template <class Message, class Value, class Rule>
constexpr void AddField(Text& text, const fields::Field<Message, Value, Rule>& /*field*/) {
  AddValue<Value>(text);
}

template <class Message>
constexpr void AddFields(Text& text) {
  std::apply([&text](const auto&... field) { (AddField(text, field), ...); }, kFields<Message>);
}

/// Returns the layout of a message.
template <class Message>
constexpr Text Write() {
  Text text;
  AddFields<Message>(text);
  return text;
}

/// Layout of a message, computed once.
template <class Message>
inline constexpr Text kText = Write<Message>();

}  // namespace layout_internal

/// Layout of a message as text.
template <class Message>
inline constexpr std::string_view kLayout{layout_internal::kText<Message>.chars.data(),
                                          layout_internal::kText<Message>.size};

}  // namespace legopt::bus

namespace legopt::bus::fields {

// Applies the rules of a message's fields to a message. Private to bus; instantiated for every message in codec.cpp.
// Thread rule: none, no state.

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

/// Corrects a message before sending (field.h): counts, texts for humans, numbers that are not available.
template <class Message>
void Sanitize(Message& message) {
  if constexpr (requires { Description<Message>::Sanitize(message); }) Description<Message>::Sanitize(message);
  const auto put_right = [&message](const auto& field) {
    if constexpr (requires { field.rule.Sanitize(message, field.member); }) field.rule.Sanitize(message, field.member);
  };
  std::apply([&](const auto&... field) { (put_right(field), ...); }, kFields<Message>);
}

}  // namespace legopt::bus::fields
