#pragma once

#include <limits>
#include <vector>

namespace legopt::statistics {

/// Returns a pool in which the method that fails most looks best if only solved problems are counted: five problems
/// with limit 100, rows of the times of A, B and C.
inline std::vector<std::vector<double>> ToyRows() {
  constexpr double kFailed = std::numeric_limits<double>::infinity();
  return {{1, 2, 4}, {2, 1, 4}, {4, kFailed, 2}, {8, 4, kFailed}, {kFailed, 16, kFailed}};
}

/// Returns the times of one method.
inline std::vector<double> ToyColumn(std::size_t method) {
  std::vector<double> column;
  for (const std::vector<double>& row : ToyRows()) column.push_back(row[method]);
  return column;
}

}  // namespace legopt::statistics
