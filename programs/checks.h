#pragma once

#include <cstdint>
#include <functional>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "words/words.h"

namespace legopt::programs {

/// What the value of an option may be. The error names the option, what it takes, and what it got: "--workers: must be
/// a whole number from 1 to 1024 (got 'many')".
struct ValueCheck {
  std::function<std::string(const std::string& word)> fault;  ///< of a word as it was typed; empty: none
  std::string range;                                          ///< in the help, behind the option; empty: nothing
};

/// A decimal whole number in [low, high]; without `high`, "of at least LOW".
ValueCheck WholeNumber(std::int64_t low, std::int64_t high = std::numeric_limits<std::int64_t>::max());

/// A finite number in [low, high].
ValueCheck Number(double low, double high);

/// One of some words; the error names the nearest one.
ValueCheck OneOf(std::vector<std::string> words);

/// The words of an enumeration, in its order.
template <Worded Enum>
std::vector<std::string> WordsOf() {
  std::vector<std::string> words;
  for (const Word<Enum>& row : kWords<Enum>) words.emplace_back(row.word);
  return words;
}

/// Likewise, each with its value, for Command::AddChoice.
template <Worded Enum>
std::vector<std::pair<std::string, Enum>> WordChoicesOf() {
  std::vector<std::pair<std::string, Enum>> choices;
  for (const Word<Enum>& row : kWords<Enum>) choices.emplace_back(row.word, row.value);
  return choices;
}

/// "a, b or c".
std::string Alternatives(const std::vector<std::string>& words);
/// "a, b, c".
std::string Joined(const std::vector<std::string>& words);

}  // namespace legopt::programs
