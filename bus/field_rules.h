#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "bus/field_check.h"
#include "bus/text.h"
#include "words/words.h"

/// @file
/// What a field may hold. Each rule can Check() a value; some can also PutRight() what a sender need not care about:
/// counts, texts for humans, figures that are not available. Thread rule: none, constants.

namespace legopt::bus::fields {

/// A limit is a number, another field, a function of the message, or an If.
template <class Message, class Word>
struct If {
  std::underlying_type_t<Word> Message::*field;  ///< which field decides
  Word word;                                     ///< which value of it
  std::int64_t then;                             ///< the limit while the field has this value
  std::int64_t otherwise;                        ///< the limit while it has any other
};
/// From the arguments' types.
template <class Message, class Value, class Word>
If(Value Message::*, Word, std::int64_t, std::int64_t) -> If<Message, Word>;

/// The limit as a number, given the message it is for. A number is itself.
template <class Message>
constexpr std::int64_t LimitOf(std::int64_t number, const Message& /*message*/) {
  return number;
}
/// Another field: its value.
template <class Message, class Value>
constexpr std::int64_t LimitOf(Value Message::*field, const Message& message) {
  return message.*field;
}
/// A function of the message.
template <class Message>
constexpr std::int64_t LimitOf(std::int64_t (*limit)(const Message&), const Message& message) {
  return limit(message);
}
/// An If: one of its two numbers.
template <class Message, class Word>
constexpr std::int64_t LimitOf(const If<Message, Word>& limit, const Message& message) {
  return message.*limit.field == static_cast<std::underlying_type_t<Word>>(limit.word) ? limit.then : limit.otherwise;
}

/// All numbers as one type, so that few rules are instantiated.
template <class Limit>
using LimitType = std::conditional_t<std::is_integral_v<Limit>, std::int64_t, Limit>;

/// An integer, inclusive.
template <class Low, class High>
struct Range {
  Low low;    ///< least value
  High high;  ///< greatest value

  /// A fault unless low <= value <= high.
  template <class Message>
  void Check(FieldCheck& check, std::string_view name, std::int64_t value, const Message& message) const {
    check.Range(name, value, LimitOf(low, message), LimitOf(high, message));
  }
};
/// From the limits, numbers as std::int64_t.
template <class Low, class High>
Range(Low, High) -> Range<LimitType<Low>, LimitType<High>>;

/// An integer that has no upper limit.
template <class Low>
struct AtLeast {
  Low low;  ///< least value

  /// A fault unless value >= low.
  template <class Message>
  void Check(FieldCheck& check, std::string_view name, std::int64_t value, const Message& message) const {
    check.AtLeast(name, value, LimitOf(low, message));
  }
};
/// From the limit, a number as std::int64_t.
template <class Low>
AtLeast(Low) -> AtLeast<LimitType<Low>>;

/// An integer that 0 does not stand for.
struct NonZero {
  /// A fault for 0.
  template <class Message>
  void Check(FieldCheck& check, std::string_view name, std::int64_t value, const Message& /*message*/) const {
    check.NonZero(name, value);
  }
};

/// The number of an enumerator.
template <Worded Enum>
struct ValueOf {
  /// A fault for a number that no enumerator has.
  template <class Value, class Message>
  void Check(FieldCheck& check, std::string_view name, Value value, const Message& /*message*/) const {
    static_assert(std::is_same_v<Value, std::underlying_type_t<Enum>>, "the enumeration is as wide as the field");
    if (!IsValueOf<Enum>(value)) check.Range(name, value, 0, static_cast<std::int64_t>(kNumWords<Enum>) - 1);
  }
};

/// The word of an enumerator.
template <Worded Enum>
struct WordOf {
  /// A fault, with the words there are, for a text that is none of them.
  template <class Message>
  void Check(FieldCheck& check, std::string_view name, const std::string& value, const Message& /*message*/) const {
    if (ParseWord<Enum>(value)) return;
    std::string choices = WordChoices<Enum>();
    std::erase(choices, '\'');
    check.NoneOf(name, value, choices);
  }
};

/// UTF-8 without NUL, of so many bytes.
template <class Least, class Most>
struct Text {
  Least least;  ///< bytes
  Most most;    ///< bytes

  /// A fault for other lengths, NUL, and what is no UTF-8.
  template <class Message>
  void Check(FieldCheck& check, std::string_view name, const std::string& value, const Message& message) const {
    check.Text(name, value, static_cast<std::size_t>(LimitOf(least, message)),
               static_cast<std::size_t>(LimitOf(most, message)));
  }
};
/// From the limits, numbers as std::int64_t.
template <class Least, class Most>
Text(Least, Most) -> Text<LimitType<Least>, LimitType<Most>>;

/// Which end of a text is worth keeping.
enum class Keep : std::uint8_t {
  kBeginning,  ///< what is said first
  kEnd         ///< what was said last, as in a log
};

/// A text for humans: whatever it is, it does not keep the message from being delivered. A sender cuts and cleans it to
/// `bytes`.
template <class Rule>
struct Cleaned {
  std::int64_t bytes = 0;        ///< at most, after PutRight
  Rule rule;                     ///< what the receiver checks
  Keep keep = Keep::kBeginning;  ///< which end of a longer text stays

  /// As the rule has it.
  template <class Message>
  void Check(FieldCheck& check, std::string_view name, const std::string& value, const Message& message) const {
    rule.Check(check, name, value, message);
  }
  /// Cuts the text to `bytes`, and makes UTF-8 without NUL of it.
  template <class Message>
  void PutRight(Message& message, std::string Message::*member) const {
    std::string& text = message.*member;
    const auto most = static_cast<std::size_t>(bytes);
    if (keep == Keep::kEnd && text.size() > most) text.erase(0, text.size() - most);
    text = CleanText(std::move(text), most);
  }
};
/// Keeps the beginning.
template <class Rule>
Cleaned(std::int64_t, Rule) -> Cleaned<Rule>;
/// Keeps the end asked for.
template <class Rule>
Cleaned(std::int64_t, Rule, Keep) -> Cleaned<Rule>;

/// A text for humans of at most so many bytes.
constexpr auto ForHumans(std::int64_t most, Keep keep = Keep::kBeginning) { return Cleaned{most, Text{0, most}, keep}; }

/// Text of JSON that nests at most kMaxJsonNesting deep: who reads it, or shows it in an error, may recurse.
template <class Least, class Most>
struct Json {
  Least least;  ///< bytes
  Most most;    ///< bytes

  /// A fault for other lengths, deeper nesting, NUL, and what is no UTF-8. Whether it is JSON is the reader's check.
  template <class Message>
  void Check(FieldCheck& check, std::string_view name, const std::string& value, const Message& message) const {
    check.Json(name, value, static_cast<std::size_t>(LimitOf(least, message)),
               static_cast<std::size_t>(LimitOf(most, message)));
  }
};
/// From the limits, numbers as std::int64_t.
template <class Least, class Most>
Json(Least, Most) -> Json<LimitType<Least>, LimitType<Most>>;

/// 64 lower-case hexadecimal digits.
struct Hash {
  /// A fault for any other text.
  template <class Message>
  void Check(FieldCheck& check, std::string_view name, const std::string& value, const Message& /*message*/) const {
    check.Hash(name, value);
  }
};

/// A number, neither infinite nor NaN.
struct Finite {
  /// A fault for the others.
  template <class Message>
  void Check(FieldCheck& check, std::string_view name, double value, const Message& /*message*/) const {
    if (!std::isfinite(value)) check.Finite(name, value);
  }
};

/// A figure; NaN when it is not available, which is also what a sender makes of an infinity.
struct NanOrFinite {
  /// A fault for an infinity.
  template <class Message>
  void Check(FieldCheck& check, std::string_view name, double value, const Message& /*message*/) const {
    if (std::isinf(value)) check.NanOrFinite(name, value);
  }
  /// Makes NaN of an infinity.
  template <class Message>
  void PutRight(Message& message, double Message::*member) const {
    if (std::isinf(message.*member)) message.*member = std::nan("");
  }
};

/// The load of a host, of a message that has this field.
template <class Message>
void LoadIsPossible(const Message& message, FieldCheck& check) {
  check.Require(!(message.load < 0), "load: must be at least 0, or NaN");
}

/// How many elements `array` has, at most `most`. A sender takes it from the array.
template <class Message, class Array>
struct CountOf {
  Array Message::*array;  ///< which array
  std::int64_t most;      ///< elements

  /// A fault when the number is another than the array has, or above `most`.
  void Check(FieldCheck& check, std::string_view name, std::int64_t value, const Message& message) const {
    check.Count(name, value, (message.*array).size(), most);
  }
  /// Takes the number from the array.
  void PutRight(Message& message, std::int32_t Message::*member) const {
    message.*member = static_cast<std::int32_t>((message.*array).size());
  }
};
/// From the arguments' types.
template <class Message, class Array>
CountOf(Array Message::*, std::int64_t) -> CountOf<Message, Array>;

/// Every element of an array obeys the rule. Messages within a message need no rule: they have their own.
template <class Rule>
struct Each {
  Rule element;  ///< the rule of one
};
/// From the rule's type.
template <class Rule>
Each(Rule) -> Each<Rule>;

}  // namespace legopt::bus::fields
