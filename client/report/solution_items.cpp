#include "client/report/solution_items.h"

#include <algorithm>
#include <cmath>

#include "client/report/motion_path.h"

namespace legopt::client {

std::vector<SolutionItem> SolutionItems(const SolutionFile& file, const Dataset& dataset) {
  std::vector<SolutionItem> items;
  for (const SolvedProblem& problem : file.problems) {
    const ProblemDefinition& definition = DefinitionOf(file, problem, dataset);
    for (const Solution& solution : problem.solutions) items.push_back({&definition, &solution});
  }
  return items;
}

nlohmann::json FiniteOrNull(double value) { return std::isfinite(value) ? nlohmann::json(value) : nlohmann::json(); }

nlohmann::json MedianOrNull(std::vector<double> values) {
  if (values.empty()) return {};
  std::ranges::sort(values);
  const std::size_t half = values.size() / 2;
  return FiniteOrNull(values.size() % 2 == 1 ? values[half] : 0.5 * (values[half - 1] + values[half]));
}

}  // namespace legopt::client
