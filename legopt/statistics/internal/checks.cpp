#include "legopt/statistics/internal/checks.h"

#include <cmath>

#include "legopt/types/input_error.h"
#include "legopt/types/number_text.h"

namespace legopt::statistics {
namespace {

std::string TextOf(double value) {
  ClassicOutput text;
  text << value;
  return text.str();
}

std::string TextOf(const NumberRule& rule) {
  std::string text = rule.infinity ? "must be a number or +infinity" : "must be a finite number";
  if (std::isfinite(rule.lowest)) text += (rule.above_lowest ? ", above " : ", not below ") + TextOf(rule.lowest);
  return text;
}

bool Holds(const NumberRule& rule, double value) {
  if (std::isinf(value)) return value > 0.0 && rule.infinity;
  return rule.above_lowest ? value > rule.lowest : value >= rule.lowest;
}

}  // namespace

void Refuse(const char* function, const char* argument, const std::string& message, double value) {
  throw InputError({.file = function, .field = argument, .value = TextOf(value), .message = message, .fix = ""});
}

void RequireNumbers(const char* function, const char* argument, std::span<const double> values, NumberRule rule) {
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (Holds(rule, values[i])) continue;
    Refuse(function, (std::string(argument) + "[" + std::to_string(i) + "]").c_str(), TextOf(rule), values[i]);
  }
}

void RequireTable(const char* function, std::span<const std::vector<double>> rows, NumberRule rule) {
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const std::string row = "rows[" + std::to_string(i) + "]";
    RequireEqualLengths(function, row.c_str(), rows[i].size(), rows[0].size());
    RequireNumbers(function, row.c_str(), rows[i], rule);
  }
}

void RequireLevel(const char* function, double level) {
  if (!(level > 0.0 && level < 1.0)) Refuse(function, "level", "must lie between 0 and 1", level);
}

void RequireCount(const char* function, const char* argument, int count, int least) {
  if (count < least) Refuse(function, argument, "must not be below " + std::to_string(least), count);
}

void RequireEqualLengths(const char* function, const char* argument, std::size_t length, std::size_t other) {
  if (length == other) return;
  Refuse(function, argument, "must be as long as its counterpart, " + std::to_string(other),
         static_cast<double>(length));
}

}  // namespace legopt::statistics
