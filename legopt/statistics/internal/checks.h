#pragma once

#include <limits>
#include <span>
#include <string>
#include <vector>

/// Intervals, tests and summaries for comparisons of methods. All functions are pure and thread-safe. On bad input they
/// throw InputError with function, argument and value.
namespace legopt::statistics {

/// Value of a failed run.
inline constexpr double kInfinity = std::numeric_limits<double>::infinity();
/// Mean of no values.
inline constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

/// Throws the InputError "FUNCTION: ARGUMENT: MESSAGE (got 'VALUE')".
[[noreturn]] void Refuse(const char* function, const char* argument, const std::string& message, double value);

/// Range of an argument; NaN is never allowed.
struct NumberRule {
  double lowest = -std::numeric_limits<double>::infinity();  ///< allowed itself, unless infinite
  bool above_lowest = false;                                 ///< excludes `lowest` itself
  bool infinity = false;                                     ///< allows +infinity, a failure
};

/// Throws InputError for the first number that violates the rule; its index is part of the argument's name.
void RequireNumbers(const char* function, const char* argument, std::span<const double> values, NumberRule rule = {});

/// Throws InputError unless all rows have the same length and their numbers follow the rule.
void RequireTable(const char* function, std::span<const std::vector<double>> rows, NumberRule rule = {});

/// Throws InputError unless the confidence level lies in (0, 1).
void RequireLevel(const char* function, double level);

/// Throws InputError unless a count is at least `least`.
void RequireCount(const char* function, const char* argument, int count, int least = 0);

/// Throws InputError unless two lengths are equal.
void RequireEqualLengths(const char* function, const char* argument, std::size_t length, std::size_t other);

}  // namespace legopt::statistics
