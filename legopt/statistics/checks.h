#pragma once

#include <limits>
#include <span>
#include <string>
#include <vector>

/// Intervals, tests and summaries for comparisons of methods: pure functions, safe to call from any thread. Every one
/// throws InputError on bad input, which names function, argument and value.
namespace legopt::statistics {

/// A failure, or never.
inline constexpr double kInfinity = std::numeric_limits<double>::infinity();
/// Nothing to take a mean of.
inline constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

/// Throws the InputError "FUNCTION: ARGUMENT: MESSAGE (got 'VALUE')".
[[noreturn]] void Refuse(const char* function, const char* argument, const std::string& message, double value);

/// What numbers an argument may hold; NaN never.
struct NumberRule {
  double lowest = -std::numeric_limits<double>::infinity();  ///< itself allowed, unless infinite
  bool above_lowest = false;                                 ///< `lowest` itself is not allowed
  bool infinity = false;                                     ///< +infinity is allowed: a failure, or never
};

/// Throws InputError at the first number that breaks the rule, with its index in the name of the argument.
void RequireNumbers(const char* function, const char* argument, std::span<const double> values, NumberRule rule = {});

/// Throws InputError unless every row is as long as the first, and for numbers as RequireNumbers.
void RequireTable(const char* function, std::span<const std::vector<double>> rows, NumberRule rule = {});

/// Throws InputError unless the confidence level lies in (0, 1).
void RequireLevel(const char* function, double level);

/// Throws InputError unless a count is at least `least`.
void RequireCount(const char* function, const char* argument, int count, int least = 0);

/// Throws InputError unless two lengths are equal.
void RequireEqualLengths(const char* function, const char* argument, std::size_t length, std::size_t other);

}  // namespace legopt::statistics
