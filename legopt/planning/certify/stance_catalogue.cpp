#include "legopt/planning/certify/stance_catalogue.h"

#include <algorithm>
#include <cstddef>
#include <map>
#include <string>

namespace legopt::certify {

StanceCatalogue::StanceCatalogue(const Dataset& dataset) {
  std::map<std::string, int> numbers;
  for (const TaskDescription& description : ProblemTasks()) {
    for (const ProblemDefinition& problem : dataset.problems(description.task)) {
      std::vector<int>& of_problem = problems_[description.task].emplace_back();
      for (const Stance& stance : problem.stances) {
        const auto [found, is_new] = numbers.emplace(FormatStance(stance), static_cast<int>(stances_.size()));
        if (is_new) stances_.push_back(stance);
        of_problem.push_back(found->second);
      }
    }
  }
  FindNeighbours();
}

void StanceCatalogue::FindNeighbours() {
  constexpr std::ptrdiff_t kReach = 2;
  neighbours_.resize(stances_.size());
  for (const TaskDescription& description : ProblemTasks()) {
    for (const std::vector<int>& problem : problems_[description.task]) {
      for (std::ptrdiff_t i = 0; i < std::ssize(problem); ++i) {
        const int stance = problem[static_cast<std::size_t>(i)];
        const std::ptrdiff_t last = std::min(i + kReach, std::ssize(problem) - 1);
        for (std::ptrdiff_t k = std::max<std::ptrdiff_t>(i - kReach, 0); k <= last; ++k) {
          const int other = problem[static_cast<std::size_t>(k)];
          if (other != stance) neighbours_[static_cast<std::size_t>(stance)].push_back(other);
        }
      }
    }
  }
  for (std::vector<int>& list : neighbours_) {
    std::sort(list.begin(), list.end());
    list.erase(std::unique(list.begin(), list.end()), list.end());
  }
}

}  // namespace legopt::certify
