#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>

/// @file
/// Enumerations and their words: the one place where a value meets its spelling in files, messages, databases and
/// command lines. Text becomes a value where it enters (ParseWord) and text again where it leaves (ToString); nothing
/// in between compares with a literal. Every room may use this one; it uses none. No state; thread-safe.

/// All of legopt but its bus and its generator, which have namespaces of their own.
namespace legopt {

/// One row of a table of words.
template <class Enum>
struct Word {
  Enum value;             ///< the enumerator
  std::string_view word;  ///< its spelling
};

/// The words of `Enum`, in the order of its enumerators 0, 1, 2, ...: each enumeration gives its own beside itself,
///
///     template <> inline constexpr auto kWords<Task> = Words<Task>({{Task::kPosture, "posture"}, ...});
template <class Enum>
inline constexpr std::nullptr_t kWords = nullptr;

/// Checks at compile time that the rows stand in the order of the enumerators without a gap.
template <class Enum, std::size_t n>
consteval std::array<Word<Enum>, n> Words(const Word<Enum> (&rows)[n]) {
  std::array<Word<Enum>, n> table{};
  for (std::size_t i = 0; i < n; ++i) {
    if (static_cast<std::size_t>(rows[i].value) != i) throw "the rows are not in the order of the enumerators";
    table[i] = rows[i];
  }
  return table;
}

/// An enumeration that has words.
template <class Enum>
concept Worded = std::is_enum_v<Enum> && !std::is_null_pointer_v<std::remove_const_t<decltype(kWords<Enum>)>>;

/// How many values the enumeration has.
template <Worded Enum>
inline constexpr std::size_t kNumWords = kWords<Enum>.size();

/// Whether the number, as it stands in a message, is a value of the enumeration.
template <Worded Enum>
constexpr bool IsValueOf(std::int64_t number) {
  return number >= 0 && static_cast<std::uint64_t>(number) < kNumWords<Enum>;
}

/// The number of a value, as it stands in a message.
template <Worded Enum>
constexpr auto NumberOf(Enum value) {
  return static_cast<std::underlying_type_t<Enum>>(value);
}

/// The word of a value. What is no value of its enumeration ends the program (std::array::at throws): it cannot have
/// come from outside, where IsValueOf and ParseWord stand.
template <Worded Enum>
constexpr std::string_view ToString(Enum value) {
  return kWords<Enum>.at(static_cast<std::size_t>(value)).word;
}

/// Inverse of ToString; empty when no value has this word.
template <Worded Enum>
constexpr std::optional<Enum> ParseWord(std::string_view word) {
  for (const Word<Enum>& row : kWords<Enum>) {
    if (row.word == word) return row.value;
  }
  return std::nullopt;
}

/// All words as a sentence needs them: "'good' or 'in_collision'", "'a', 'b' or 'c'".
template <Worded Enum>
std::string WordChoices() {
  std::string text;
  for (std::size_t i = 0; i < kNumWords<Enum>; ++i) {
    if (i > 0) text += i + 1 == kNumWords<Enum> ? " or " : ", ";
    text += "'" + std::string(kWords<Enum>[i].word) + "'";
  }
  return text;
}

/// One value of type T for every value of the enumeration.
template <Worded Enum, class T>
struct Per {
  std::array<T, kNumWords<Enum>> values{};  ///< by the number of the enumerator

  /// What is no value of the enumeration ends the program, as in ToString.
  constexpr T& operator[](Enum key) { return values.at(static_cast<std::size_t>(key)); }
  /// The same, for reading.
  constexpr const T& operator[](Enum key) const { return values.at(static_cast<std::size_t>(key)); }
  constexpr auto begin() { return values.begin(); }        ///< in the order of the enumerators
  constexpr auto end() { return values.end(); }            ///< behind the last value
  constexpr auto begin() const { return values.begin(); }  ///< the same, for reading
  constexpr auto end() const { return values.end(); }      ///< the same, for reading

  bool operator==(const Per&) const = default;
};

}  // namespace legopt
