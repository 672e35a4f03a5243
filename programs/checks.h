#pragma once

#include <CLI/CLI.hpp>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

namespace legopt::programs {

// Checks of option values, for CLI::Option::check. The error names the option, what it takes, and what it got:
// "--workers: must be a whole number from 1 to 1024 (got 'many')".

/// A decimal whole number in [low, high]; without `high`, "of at least LOW".
CLI::Validator WholeNumber(std::int64_t low, std::int64_t high = std::numeric_limits<std::int64_t>::max());

/// A finite number in [low, high].
CLI::Validator Number(double low, double high);

/// One of some words; the error names the nearest one.
CLI::Validator OneOf(std::vector<std::string> words);

}  // namespace legopt::programs
