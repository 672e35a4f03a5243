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
/// Byte layout of each message, used to limit the memory that a generated decoder allocates.
///
/// The generated decoders allocate vectors of the declared size before checking that enough bytes follow: a datagram of
/// 100 bytes could cost gigabytes. LayoutFits() therefore checks the encoded bytes first. Grammar of a layout, in the
/// order of the fields: '1' '2' '4' '8' for a number with that many bytes; 's' for an LCM string (int32 length
/// including the final NUL, bytes, NUL); "a(...)" for an int32 count and that many groups. The fingerprint is not
/// included. Computed from kFields (message_fields.h) at compile time; the tests compare each layout with the generated
/// encoder. Private to bus. Thread rule: none, no state.

namespace legopt::bus {

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
