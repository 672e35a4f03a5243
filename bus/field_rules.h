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

/// What a field may hold. Each rule can Check() a value; some can also PutRight() what a sender need not care about:
/// counts, texts for humans, figures that are not available. Thread rule: none, constants.
namespace legopt::bus::fields {

/// A limit is a number, another field, a function of the message, or an If.
template <class Message, class Word>
struct If {
  std::underlying_type_t<Word> Message::*field;
  Word word;
  std::int64_t then;  ///< the limit while the field has this value
  std::int64_t otherwise;
};
template <class Message, class Value, class Word>
If(Value Message::*, Word, std::int64_t, std::int64_t) -> If<Message, Word>;

template <class Message>
constexpr std::int64_t LimitOf(std::int64_t number, const Message& /*message*/) {
  return number;
}
template <class Message, class Value>
constexpr std::int64_t LimitOf(Value Message::*field, const Message& message) {
  return message.*field;
}
template <class Message>
constexpr std::int64_t LimitOf(std::int64_t (*limit)(const Message&), const Message& message) {
  return limit(message);
}
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
  Low low;
  High high;

  template <class Message>
  void Check(FieldCheck& check, std::string_view name, std::int64_t value, const Message& message) const {
    check.Range(name, value, LimitOf(low, message), LimitOf(high, message));
  }
};
template <class Low, class High>
Range(Low, High) -> Range<LimitType<Low>, LimitType<High>>;

template <class Low>
struct AtLeast {
  Low low;

  template <class Message>
  void Check(FieldCheck& check, std::string_view name, std::int64_t value, const Message& message) const {
    check.AtLeast(name, value, LimitOf(low, message));
  }
};
template <class Low>
AtLeast(Low) -> AtLeast<LimitType<Low>>;

struct NonZero {
  template <class Message>
  void Check(FieldCheck& check, std::string_view name, std::int64_t value, const Message& /*message*/) const {
    check.NonZero(name, value);
  }
};

/// The number of an enumerator.
template <Worded Enum>
struct ValueOf {
  template <class Value, class Message>
  void Check(FieldCheck& check, std::string_view name, Value value, const Message& /*message*/) const {
    static_assert(std::is_same_v<Value, std::underlying_type_t<Enum>>, "the enumeration is as wide as the field");
    if (!IsValueOf<Enum>(value)) check.Range(name, value, 0, static_cast<std::int64_t>(kNumWords<Enum>) - 1);
  }
};

/// The word of an enumerator.
template <Worded Enum>
struct WordOf {
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
  Least least;
  Most most;

  template <class Message>
  void Check(FieldCheck& check, std::string_view name, const std::string& value, const Message& message) const {
    check.Text(name, value, static_cast<std::size_t>(LimitOf(least, message)),
               static_cast<std::size_t>(LimitOf(most, message)));
  }
};
template <class Least, class Most>
Text(Least, Most) -> Text<LimitType<Least>, LimitType<Most>>;

/// Which end of a text is worth keeping.
enum class Keep : std::uint8_t { kBeginning, kEnd };

/// A text for humans: whatever it is, it does not keep the message from being delivered. A sender cuts and cleans it to
/// `bytes`.
template <class Rule>
struct Cleaned {
  std::int64_t bytes;
  Rule rule;
  Keep keep = Keep::kBeginning;

  template <class Message>
  void Check(FieldCheck& check, std::string_view name, const std::string& value, const Message& message) const {
    rule.Check(check, name, value, message);
  }
  template <class Message>
  void PutRight(Message& message, std::string Message::*member) const {
    std::string& text = message.*member;
    const auto most = static_cast<std::size_t>(bytes);
    if (keep == Keep::kEnd && text.size() > most) text.erase(0, text.size() - most);
    text = CleanText(std::move(text), most);
  }
};
template <class Rule>
Cleaned(std::int64_t, Rule) -> Cleaned<Rule>;
template <class Rule>
Cleaned(std::int64_t, Rule, Keep) -> Cleaned<Rule>;

/// A text for humans of at most so many bytes.
constexpr auto ForHumans(std::int64_t most, Keep keep = Keep::kBeginning) { return Cleaned{most, Text{0, most}, keep}; }

/// Text of JSON that nests at most kMaxJsonNesting deep: who reads it, or shows it in an error, may recurse.
template <class Least, class Most>
struct Json {
  Least least;
  Most most;

  template <class Message>
  void Check(FieldCheck& check, std::string_view name, const std::string& value, const Message& message) const {
    check.Json(name, value, static_cast<std::size_t>(LimitOf(least, message)),
               static_cast<std::size_t>(LimitOf(most, message)));
  }
};
template <class Least, class Most>
Json(Least, Most) -> Json<LimitType<Least>, LimitType<Most>>;

/// 64 lower-case hexadecimal digits.
struct Hash {
  template <class Message>
  void Check(FieldCheck& check, std::string_view name, const std::string& value, const Message& /*message*/) const {
    check.Hash(name, value);
  }
};

struct Finite {
  template <class Message>
  void Check(FieldCheck& check, std::string_view name, double value, const Message& /*message*/) const {
    if (!std::isfinite(value)) check.Finite(name, value);
  }
};

/// A figure; NaN when it is not available, which is also what a sender makes of an infinity.
struct NanOrFinite {
  template <class Message>
  void Check(FieldCheck& check, std::string_view name, double value, const Message& /*message*/) const {
    if (std::isinf(value)) check.NanOrFinite(name, value);
  }
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
  Array Message::*array;
  std::int64_t most;

  void Check(FieldCheck& check, std::string_view name, std::int64_t value, const Message& message) const {
    check.Count(name, value, (message.*array).size(), most);
  }
  void PutRight(Message& message, std::int32_t Message::*member) const {
    message.*member = static_cast<std::int32_t>((message.*array).size());
  }
};
template <class Message, class Array>
CountOf(Array Message::*, std::int64_t) -> CountOf<Message, Array>;

/// Every element of an array obeys the rule. Messages within a message need no rule: they have their own.
template <class Rule>
struct Each {
  Rule element;
};
template <class Rule>
Each(Rule) -> Each<Rule>;

}  // namespace legopt::bus::fields
