#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <tuple>
#include <type_traits>
#include <vector>

#include "bus/field_check.h"
#include "legopt/types/enum_names.h"

namespace legopt::bus::fields {

/// @file
/// Tables of the fields of all messages. Everything else about fields is derived from them at compile time: byte
/// layout, validation, corrections by the sender, JSON, samples for tests and fuzzers. Private to bus and to code that
/// displays messages. Code that only sends and receives includes codec.h, which compiles faster. Thread rule: none,
/// constants.

/// Fields of messages: rows, rules and limits.

/// Rule of an unrestricted field.
struct AnyValue {};

/// Checks a condition between a field and others, immediately after the field's own rule.
template <class Message>
using Condition = void (*)(const Message& message, FieldCheck& check);

/// Row of a table: name and member as in the .lcm file, the rule (field.h), and an optional condition.
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

namespace legopt::bus::fields {

// Rules for the values of fields. Each rule checks a value with Check(). Some also correct values before sending with
// Sanitize(): counts, texts for humans, numbers that are not available. Thread rule: none, constants.

/// Limit that depends on another field. Limits are numbers, other fields, functions of the message, or If.
template <class Message, class Word>
struct If {
  std::underlying_type_t<Word> Message::*field;  ///< field that decides
  Word word;                                     ///< value of that field
  std::int64_t then;                             ///< limit if the field has this value
  std::int64_t otherwise;                        ///< limit if the field has another value
};
/// Deduces the types.
template <class Message, class Value, class Word>
If(Value Message::*, Word, std::int64_t, std::int64_t) -> If<Message, Word>;

/// Evaluates a limit for a message: a number is the limit itself.
template <class Message>
constexpr std::int64_t LimitOf(std::int64_t number, const Message& /*message*/) {
  return number;
}
/// Evaluates a limit that is the value of another field.
template <class Message, class Value>
constexpr std::int64_t LimitOf(Value Message::*field, const Message& message) {
  return message.*field;
}
/// Evaluates a limit that is a function of the message.
template <class Message>
constexpr std::int64_t LimitOf(std::int64_t (*limit)(const Message&), const Message& message) {
  return limit(message);
}
/// Evaluates a limit of type If.
template <class Message, class Word>
constexpr std::int64_t LimitOf(const If<Message, Word>& limit, const Message& message) {
  return message.*limit.field == static_cast<std::underlying_type_t<Word>>(limit.word) ? limit.then : limit.otherwise;
}

/// Type of a stored limit: one type for all numbers, to reduce the number of instantiations.
template <class Limit>
using LimitType = std::conditional_t<std::is_integral_v<Limit>, std::int64_t, Limit>;

/// Rule: integer in an inclusive range.
template <class Low, class High>
struct Range {
  Low low;
  High high;

  /// Requires low <= value <= high.
  template <class Message>
  void Check(FieldCheck& check, std::string_view name, std::int64_t value, const Message& message) const {
    check.Range(name, value, LimitOf(low, message), LimitOf(high, message));
  }
};
/// Deduces the limits; numbers become std::int64_t.
template <class Low, class High>
Range(Low, High) -> Range<LimitType<Low>, LimitType<High>>;

/// Rule: integer without an upper limit.
template <class Low>
struct AtLeast {
  Low low;

  /// Requires value >= low.
  template <class Message>
  void Check(FieldCheck& check, std::string_view name, std::int64_t value, const Message& message) const {
    check.AtLeast(name, value, LimitOf(low, message));
  }
};
/// Deduces the limit; a number becomes std::int64_t.
template <class Low>
AtLeast(Low) -> AtLeast<LimitType<Low>>;

/// Rule: integer that is not 0.
struct NonZero {
  /// Requires value != 0.
  template <class Message>
  void Check(FieldCheck& check, std::string_view name, std::int64_t value, const Message& /*message*/) const {
    check.NonZero(name, value);
  }
};

/// Rule: number of an enumerator.
template <NamedEnum Enum>
struct ValueOf {
  /// Requires the number of an enumerator.
  template <class Value, class Message>
  void Check(FieldCheck& check, std::string_view name, Value value, const Message& /*message*/) const {
    static_assert(std::is_same_v<Value, std::underlying_type_t<Enum>>, "the enumeration is as wide as the field");
    if (!IsEnumNumber<Enum>(value)) check.Range(name, value, 0, static_cast<std::int64_t>(kNumEnumerators<Enum>) - 1);
  }
};

/// Rule: name of an enumerator.
template <NamedEnum Enum>
struct EnumNameOf {
  /// Requires the name of an enumerator; the fault lists all names.
  template <class Message>
  void Check(FieldCheck& check, std::string_view name, const std::string& value, const Message& /*message*/) const {
    if (ParseEnum<Enum>(value)) return;
    std::string choices = EnumChoices<Enum>();
    std::erase(choices, '\'');
    check.NoneOf(name, value, choices);
  }
};

/// Rule: UTF-8 without NUL, of limited length.
template <class Least, class Most>
struct Text {
  Least least;  ///< minimum, in bytes
  Most most;    ///< maximum, in bytes

  /// Requires a length within the limits, valid UTF-8 and no NUL.
  template <class Message>
  void Check(FieldCheck& check, std::string_view name, const std::string& value, const Message& message) const {
    check.Text(name, value, static_cast<std::size_t>(LimitOf(least, message)),
               static_cast<std::size_t>(LimitOf(most, message)));
  }
};
/// Deduces the limits; numbers become std::int64_t.
template <class Least, class Most>
Text(Least, Most) -> Text<LimitType<Least>, LimitType<Most>>;

/// End of a text that is kept when the text is truncated.
enum class Keep : std::uint8_t {
  kBeginning,  ///< suits messages
  kEnd         ///< suits logs
};

/// Rule: text for humans. Its content never prevents delivery: a sender truncates it to `bytes` and cleans it.
template <class Rule>
struct Cleaned {
  std::int64_t bytes = 0;        ///< maximum after Sanitize
  Rule rule;                     ///< rule checked by the receiver
  Keep keep = Keep::kBeginning;  ///< end of a longer text that is kept

  /// Checks `rule`.
  template <class Message>
  void Check(FieldCheck& check, std::string_view name, const std::string& value, const Message& message) const {
    rule.Check(check, name, value, message);
  }
  /// Truncates the text to `bytes` and replaces NUL and invalid UTF-8.
  template <class Message>
  void Sanitize(Message& message, std::string Message::*member) const {
    std::string& text = message.*member;
    const auto most = static_cast<std::size_t>(bytes);
    if (keep == Keep::kEnd && text.size() > most) text.erase(0, text.size() - most);
    text = CleanText(std::move(text), most);
  }
};
/// Deduces a rule that keeps the beginning.
template <class Rule>
Cleaned(std::int64_t, Rule) -> Cleaned<Rule>;
/// Deduces a rule that keeps the given end.
template <class Rule>
Cleaned(std::int64_t, Rule, Keep) -> Cleaned<Rule>;

/// Returns the rule for a text for humans of at most `most` bytes.
constexpr auto ForHumans(std::int64_t most, Keep keep = Keep::kBeginning) { return Cleaned{most, Text{0, most}, keep}; }

/// Rule: JSON text with a nesting depth of at most kMaxJsonNesting, because readers may be recursive.
template <class Least, class Most>
struct Json {
  Least least;  ///< minimum, in bytes
  Most most;    ///< maximum, in bytes

  /// Requires a length and nesting depth within the limits, valid UTF-8 and no NUL. The reader checks whether it is
  /// JSON.
  template <class Message>
  void Check(FieldCheck& check, std::string_view name, const std::string& value, const Message& message) const {
    check.Json(name, value, static_cast<std::size_t>(LimitOf(least, message)),
               static_cast<std::size_t>(LimitOf(most, message)));
  }
};
/// Deduces the limits; numbers become std::int64_t.
template <class Least, class Most>
Json(Least, Most) -> Json<LimitType<Least>, LimitType<Most>>;

/// Rule: 64 lower-case hexadecimal digits.
struct Hash {
  /// Requires such a text.
  template <class Message>
  void Check(FieldCheck& check, std::string_view name, const std::string& value, const Message& /*message*/) const {
    check.Hash(name, value);
  }
};

/// Rule: number that is neither infinite nor NaN.
struct Finite {
  /// Requires a finite value.
  template <class Message>
  void Check(FieldCheck& check, std::string_view name, double value, const Message& /*message*/) const {
    if (!std::isfinite(value)) check.Finite(name, value);
  }
};

/// Rule: number, or NaN if it is not available. A sender replaces infinities by NaN.
struct NanOrFinite {
  /// Requires a value that is not infinite.
  template <class Message>
  void Check(FieldCheck& check, std::string_view name, double value, const Message& /*message*/) const {
    if (std::isinf(value)) check.NanOrFinite(name, value);
  }
  /// Replaces an infinity by NaN.
  template <class Message>
  void Sanitize(Message& message, double Message::*member) const {
    if (std::isinf(message.*member)) message.*member = std::nan("");
  }
};

/// Condition: the load of a host is not negative. For messages with the field `load`.
template <class Message>
void LoadIsPossible(const Message& message, FieldCheck& check) {
  check.Require(!(message.load < 0), "load: must be at least 0, or NaN");
}

/// Rule: size of `array`, at most `most`. A sender sets it from the array.
template <class Message, class Array>
struct CountOf {
  Array Message::*array;
  std::int64_t most;  ///< maximum

  /// Requires that the value equals the size of the array and is at most `most`.
  void Check(FieldCheck& check, std::string_view name, std::int64_t value, const Message& message) const {
    check.Count(name, value, (message.*array).size(), most);
  }
  /// Sets the value to the size of the array.
  void Sanitize(Message& message, std::int32_t Message::*member) const {
    message.*member = static_cast<std::int32_t>((message.*array).size());
  }
};
/// Deduces the types.
template <class Message, class Array>
CountOf(Array Message::*, std::int64_t) -> CountOf<Message, Array>;

/// Rule for every element of an array. Nested messages need none: their own rules apply.
template <class Rule>
struct Each {
  Rule element;
};
/// Deduces the type of the rule.
template <class Rule>
Each(Rule) -> Each<Rule>;

}  // namespace legopt::bus::fields
