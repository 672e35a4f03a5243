#pragma once

#include <cstdint>
#include <functional>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "legopt/types/enum_names.h"

namespace legopt::app {

/// Check of an option's value. The error contains the option, the permitted values, and the given one: "--workers: must
/// be a whole number from 1 to 1024 (got 'many')".
struct ValueCheck {
  std::function<std::string(const std::string& word)> fault;  ///< returns the fault of a word as typed; empty: none
  std::string range;                                          ///< shown in the help after the option; empty: nothing
};

/// Check for a decimal integer in [low, high]; without `high`, the error says "of at least LOW".
ValueCheck WholeNumber(std::int64_t low, std::int64_t high = std::numeric_limits<std::int64_t>::max());

/// Check for a finite number in [low, high].
ValueCheck Number(double low, double high);

/// Check for one of some words; the error contains the nearest one.
ValueCheck OneOf(std::vector<std::string> words);

/// Returns the names of an enumeration, in its order.
template <NamedEnum Enum>
std::vector<std::string> EnumNamesOf() {
  std::vector<std::string> words;
  for (const EnumName<Enum>& row : kEnumNames<Enum>) words.emplace_back(row.word);
  return words;
}

/// Returns the names of an enumeration with their enumerators, for Command::AddChoice.
template <NamedEnum Enum>
std::vector<std::pair<std::string, Enum>> EnumChoicesOf() {
  std::vector<std::pair<std::string, Enum>> choices;
  for (const EnumName<Enum>& row : kEnumNames<Enum>) choices.emplace_back(row.word, row.value);
  return choices;
}

/// Returns "a, b or c".
std::string Alternatives(const std::vector<std::string>& words);
/// Returns "a, b, c".
std::string Joined(const std::vector<std::string>& words);

}  // namespace legopt::app
