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
/// command lines. Input converts names to values (ParseEnum), output converts values to names (ToString); other code
/// never compares with string literals. Every module may depend on this one; it depends on none. Stateless and
/// thread-safe.

/// All of legopt except the bus and the generator, which have their own namespaces.
namespace legopt {

/// Row of a table of enum names.
template <class Enum>
struct EnumName {
  Enum value;
  std::string_view word;  ///< name in files, messages and command lines
};

/// Names of the enumerators of `Enum`, in the order 0, 1, 2, ... Each enumeration specialises it next to its
/// declaration:
///
///     template <> inline constexpr auto kEnumNames<Task> = MakeEnumNames<Task>({{Task::kPosture, "posture"}, ...});
template <class Enum>
inline constexpr std::nullptr_t kEnumNames = nullptr;

/// Checks at compile time that the rows are in the order of the enumerators, without gaps.
template <class Enum, std::size_t n>
consteval std::array<EnumName<Enum>, n> MakeEnumNames(const EnumName<Enum> (&rows)[n]) {
  std::array<EnumName<Enum>, n> table{};
  for (std::size_t i = 0; i < n; ++i) {
    if (static_cast<std::size_t>(rows[i].value) != i) throw "the rows are not in the order of the enumerators";
    table[i] = rows[i];
  }
  return table;
}

/// Enumeration with names.
template <class Enum>
concept NamedEnum = std::is_enum_v<Enum> && !std::is_null_pointer_v<std::remove_const_t<decltype(kEnumNames<Enum>)>>;

/// Number of enumerators.
template <NamedEnum Enum>
inline constexpr std::size_t kNumEnumerators = kEnumNames<Enum>.size();

/// Returns whether a number from a message is an enumerator's.
template <NamedEnum Enum>
constexpr bool IsEnumNumber(std::int64_t number) {
  return number >= 0 && static_cast<std::uint64_t>(number) < kNumEnumerators<Enum>;
}

/// Returns the number of an enumerator, as used in messages.
template <NamedEnum Enum>
constexpr auto EnumNumber(Enum value) {
  return static_cast<std::underlying_type_t<Enum>>(value);
}

/// Returns the name of an enumerator. An invalid value terminates the program (std::array::at throws): values from
/// outside are checked by IsEnumNumber and ParseEnum first.
template <NamedEnum Enum>
constexpr std::string_view ToString(Enum value) {
  return kEnumNames<Enum>.at(static_cast<std::size_t>(value)).word;
}

/// Returns the enumerator with this name; empty if there is none.
template <NamedEnum Enum>
constexpr std::optional<Enum> ParseEnum(std::string_view word) {
  for (const EnumName<Enum>& row : kEnumNames<Enum>) {
    if (row.word == word) return row.value;
  }
  return std::nullopt;
}

/// Returns all names as an enumeration for a sentence: "'good' or 'in_collision'", "'a', 'b' or 'c'".
template <NamedEnum Enum>
std::string EnumChoices() {
  std::string text;
  for (std::size_t i = 0; i < kNumEnumerators<Enum>; ++i) {
    if (i > 0) text += i + 1 == kNumEnumerators<Enum> ? " or " : ", ";
    text += "'" + std::string(kEnumNames<Enum>[i].word) + "'";
  }
  return text;
}

/// Array with one value of type T for each enumerator.
template <NamedEnum Enum, class T>
struct EnumArray {
  std::array<T, kNumEnumerators<Enum>> values{};  ///< indexed by the enumerator's number

  /// An invalid enumerator terminates the program, as in ToString.
  constexpr T& operator[](Enum key) { return values.at(static_cast<std::size_t>(key)); }
  constexpr const T& operator[](Enum key) const { return values.at(static_cast<std::size_t>(key)); }
  constexpr auto begin() { return values.begin(); }
  constexpr auto end() { return values.end(); }
  constexpr auto begin() const { return values.begin(); }
  constexpr auto end() const { return values.end(); }

  bool operator==(const EnumArray&) const = default;
};

}  // namespace legopt
