#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>

/// @file
/// Enumerations with names: the only place that maps enumerators to their spelling in files, messages, databases and
/// command lines. Input converts names to values (ParseWord), output converts values to names (ToString); other code
/// never compares with string literals. Every module may depend on this one; it depends on none. Stateless and
/// thread-safe.

/// All of legopt except the bus and the generator, which have their own namespaces.
namespace legopt {

/// Row of a table of enum names.
template <class Enum>
struct Word {
  Enum value;
  std::string_view word;  ///< name in files, messages and command lines
};

/// Names of the enumerators of `Enum`, in the order 0, 1, 2, ... Each enumeration specialises it next to its
/// declaration:
///
///     template <> inline constexpr auto kWords<Task> = Words<Task>({{Task::kPosture, "posture"}, ...});
template <class Enum>
inline constexpr std::nullptr_t kWords = nullptr;

/// Checks at compile time that the rows are in the order of the enumerators, without gaps.
template <class Enum, std::size_t n>
consteval std::array<Word<Enum>, n> Words(const Word<Enum> (&rows)[n]) {
  std::array<Word<Enum>, n> table{};
  for (std::size_t i = 0; i < n; ++i) {
    if (static_cast<std::size_t>(rows[i].value) != i) throw "the rows are not in the order of the enumerators";
    table[i] = rows[i];
  }
  return table;
}

/// Enumeration with names.
template <class Enum>
concept Worded = std::is_enum_v<Enum> && !std::is_null_pointer_v<std::remove_const_t<decltype(kWords<Enum>)>>;

/// Number of enumerators.
template <Worded Enum>
inline constexpr std::size_t kNumWords = kWords<Enum>.size();

/// Returns whether a number from a message is an enumerator's.
template <Worded Enum>
constexpr bool IsValueOf(std::int64_t number) {
  return number >= 0 && static_cast<std::uint64_t>(number) < kNumWords<Enum>;
}

/// Returns the number of an enumerator, as used in messages.
template <Worded Enum>
constexpr auto NumberOf(Enum value) {
  return static_cast<std::underlying_type_t<Enum>>(value);
}

/// Returns the name of an enumerator. An invalid value terminates the program (std::array::at throws): values from
/// outside are checked by IsValueOf and ParseWord first.
template <Worded Enum>
constexpr std::string_view ToString(Enum value) {
  return kWords<Enum>.at(static_cast<std::size_t>(value)).word;
}

/// Returns the enumerator with this name; empty if there is none.
template <Worded Enum>
constexpr std::optional<Enum> ParseWord(std::string_view word) {
  for (const Word<Enum>& row : kWords<Enum>) {
    if (row.word == word) return row.value;
  }
  return std::nullopt;
}

/// Returns all names as an enumeration for a sentence: "'good' or 'in_collision'", "'a', 'b' or 'c'".
template <Worded Enum>
std::string WordChoices() {
  std::string text;
  for (std::size_t i = 0; i < kNumWords<Enum>; ++i) {
    if (i > 0) text += i + 1 == kNumWords<Enum> ? " or " : ", ";
    text += "'" + std::string(kWords<Enum>[i].word) + "'";
  }
  return text;
}

/// Array with one value of type T for each enumerator.
template <Worded Enum, class T>
struct Per {
  std::array<T, kNumWords<Enum>> values{};  ///< indexed by the enumerator's number

  /// An invalid enumerator terminates the program, as in ToString.
  constexpr T& operator[](Enum key) { return values.at(static_cast<std::size_t>(key)); }
  constexpr const T& operator[](Enum key) const { return values.at(static_cast<std::size_t>(key)); }
  constexpr auto begin() { return values.begin(); }
  constexpr auto end() { return values.end(); }
  constexpr auto begin() const { return values.begin(); }
  constexpr auto end() const { return values.end(); }

  bool operator==(const Per&) const = default;
};

}  // namespace legopt
