#pragma once

#include <array>
#include <cstddef>
#include <string>
#include <string_view>
#include <tuple>
#include <type_traits>
#include <vector>

#include "bus/message_fields.h"

/// @file
/// Byte layout of each message, to bound what a generated decoder allocates before it runs.
///
/// The generated decoders size vectors by the count they read, before they look whether so many bytes are there: a
/// datagram of 100 bytes could cost gigabytes. LayoutFits() walks the encoded bytes first. Grammar of a layout, in
/// order of the fields: '1' '2' '4' '8' a number of so many bytes; 's' an LCM string (int32 length with its final NUL,
/// bytes, NUL); "a(...)" an int32 count and then so many groups. The fingerprint is not part of it. Source: kFields
/// (message_fields.h), at compile time; the tests compare each layout with the generated encoder. Private to bus.
/// Thread rule: none, no state.

namespace legopt::bus {

/// Whether `bytes` (after the fingerprint) is exactly one message of this layout.
bool LayoutFits(std::string_view layout, std::string_view bytes);

namespace layout_internal {

/// A layout while it is written, at compile time.
struct Text {
  std::array<char, 128> chars{};  ///< the layout's first `size` characters, then zeros
  std::size_t size = 0;           ///< characters written

  /// Appends a character; more than fit do not compile.
  constexpr void Add(char c) { chars.at(size++) = c; }
  /// LCM writes the count of a vector as the field before it; here it belongs to the group.
  constexpr void TakeBackCount() {
    if (size == 0 || chars.at(size - 1) != '4') throw "the field before a vector must be its int32 count";
    --size;
  }
};

/// Whether a type is a std::vector.
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

/// The layout of a message.
template <class Message>
constexpr Text Write() {
  Text text;
  AddFields<Message>(text);
  return text;
}

/// The same, made once.
template <class Message>
inline constexpr Text kText = Write<Message>();

}  // namespace layout_internal

/// Of one message, as C++ knows it.
template <class Message>
inline constexpr std::string_view kLayout{layout_internal::kText<Message>.chars.data(),
                                          layout_internal::kText<Message>.size};

}  // namespace legopt::bus
