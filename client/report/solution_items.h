#pragma once

#include <nlohmann/json.hpp>
#include <vector>

#include "legopt/dataset/dataset.h"
#include "legopt/judge/solution_file.h"

namespace legopt::client {

/// A solution of a file with the problem that it solves. Both live as long as file and dataset.
struct SolutionItem {
  const ProblemDefinition* problem = nullptr;
  const Solution* solution = nullptr;
};

/// Returns all solutions of a file, in its order. Problems without a definition in the file use the dataset's. Throws
/// InputError for a problem that neither defines.
std::vector<SolutionItem> SolutionItems(const SolutionFile& file, const Dataset& dataset);

/// Returns a number as JSON; null if it is not finite.
nlohmann::json FiniteOrNull(double value);

/// Returns the median of finite or infinite values; null if there are none, or if it is infinite.
nlohmann::json MedianOrNull(std::vector<double> values);

}  // namespace legopt::client
