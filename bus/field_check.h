#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

namespace legopt::bus {

/// @file
/// Texts of messages: UTF-8 without NUL. Thread rule: none, no state.

/// Returns whether `text` is UTF-8 without NUL.
bool IsText(const std::string& text);

/// Returns `text` truncated to at most `limit` bytes (whole characters), with NULs and invalid UTF-8 bytes replaced by
/// '?'.
std::string CleanText(std::string text, std::size_t limit);

/// Maximum nesting depth of arrays and objects in a JSON text of a message.
inline constexpr int kMaxJsonNesting = 64;
/// Returns whether no array or object of the text is nested deeper than `most`. Also true for many texts that are not
/// JSON.
bool NestsWithin(std::string_view json, int most);

/// Checks the fields of a message one after another and stores the first fault as "FIELD: VALUE: RULE". Private to bus;
/// used by the rules of fields (field.h). Thread rule: one thread.
class FieldCheck {
 public:
  /// Requires a value in [low, high].
  FieldCheck& Range(std::string_view field, std::int64_t value, std::int64_t low, std::int64_t high);
  /// Requires value >= low.
  FieldCheck& AtLeast(std::string_view field, std::int64_t value, std::int64_t low);
  /// Requires value != 0.
  FieldCheck& NonZero(std::string_view field, std::int64_t value);
  /// Requires UTF-8 without NUL with a length in [least_bytes, most_bytes].
  FieldCheck& Text(std::string_view field, const std::string& value, std::size_t least_bytes, std::size_t most_bytes);
  /// Requires Text() with a JSON nesting depth of at most kMaxJsonNesting, because readers may be recursive.
  FieldCheck& Json(std::string_view field, const std::string& value, std::size_t least_bytes, std::size_t most_bytes);
  /// Requires 64 lower-case hexadecimal digits.
  FieldCheck& Hash(std::string_view field, const std::string& value);
  /// Requires a value that is not infinite.
  FieldCheck& NanOrFinite(std::string_view field, double value);
  /// Requires a value that is neither infinite nor NaN.
  FieldCheck& Finite(std::string_view field, double value);
  /// Requires that the count field of an array equals its size and is at most `most`.
  FieldCheck& Count(std::string_view field, std::int64_t count, std::size_t array_size, std::int64_t most);
  /// Requires any other condition; `what` is the fault if it does not hold.
  FieldCheck& Require(bool holds, std::string_view what);
  /// Reports a value that is none of the choices.
  void NoneOf(std::string_view field, const std::string& value, const std::string& choices);
  /// Reports the fault of a nested message.
  void Nested(std::string_view field, std::size_t index, const std::string& fault);

  bool ok() const { return fault_.empty(); }
  const std::string& fault() const { return fault_; }  ///< first fault; empty: none

 private:
  void Fail(std::string_view field, const std::string& value, const std::string& allowed);
  std::string fault_;
};

}  // namespace legopt::bus
