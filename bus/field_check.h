#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

namespace legopt::bus {

/// Deepest nesting of arrays and objects in a JSON text of a message.
inline constexpr int kMaxJsonNesting = 64;
/// Whether no array or object of the text stands in more than `most` others. True of much that is no JSON at all.
bool NestsWithin(std::string_view json, int most);

/// Collects the first fault of a message while its fields are checked one after another, as "field: value: what is
/// allowed". Private to bus: rules of fields (field_rules.h) use it. Thread rule: one thread.
class FieldCheck {
 public:
  /// value in [low, high]
  FieldCheck& Range(std::string_view field, std::int64_t value, std::int64_t low, std::int64_t high);
  /// value >= low
  FieldCheck& AtLeast(std::string_view field, std::int64_t value, std::int64_t low);
  /// value != 0
  FieldCheck& NonZero(std::string_view field, std::int64_t value);
  /// UTF-8 without NUL, of so many bytes
  FieldCheck& Text(std::string_view field, const std::string& value, std::size_t least_bytes, std::size_t most_bytes);
  /// Text() of JSON that nests at most kMaxJsonNesting deep: who reads it, or shows it in an error, may recurse
  FieldCheck& Json(std::string_view field, const std::string& value, std::size_t least_bytes, std::size_t most_bytes);
  /// 64 lower-case hexadecimal digits
  FieldCheck& Hash(std::string_view field, const std::string& value);
  /// no infinity
  FieldCheck& NanOrFinite(std::string_view field, double value);
  /// neither infinity nor NaN
  FieldCheck& Finite(std::string_view field, double value);
  /// the count field of an array agrees with the array
  FieldCheck& Count(std::string_view field, std::int64_t count, std::size_t array_size, std::int64_t most);
  /// any other condition; `what` is the fault when it does not hold
  FieldCheck& Require(bool holds, std::string_view what);
  /// the value is none of the choices
  void NoneOf(std::string_view field, const std::string& value, const std::string& choices);
  /// the fault of a nested message
  void Nested(std::string_view field, std::size_t index, const std::string& fault);

  bool ok() const { return fault_.empty(); }           ///< no fault so far
  const std::string& fault() const { return fault_; }  ///< the first fault; empty: none

 private:
  void Fail(std::string_view field, const std::string& value, const std::string& allowed);
  std::string fault_;
};

}  // namespace legopt::bus
