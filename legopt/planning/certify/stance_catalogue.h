#pragma once

#include <vector>

#include "legopt/dataset/dataset.h"
#include "legopt/dataset/stance.h"
#include "legopt/types/task.h"

namespace legopt::certify {

/// The distinct stances of a dataset; problems, and neighbours within a motion, repeat them. Numbered by first
/// occurrence, task by task, problem by problem. Immutable; any thread.
class StanceCatalogue {
 public:
  /// Two stances are identical if all their digits are.
  explicit StanceCatalogue(const Dataset& dataset);

  const std::vector<Stance>& stances() const { return stances_; }  ///< indexed by number
  /// Returns the numbers of the stances of each problem, problems in the order of the dataset.
  const std::vector<std::vector<int>>& problems(Task task) const { return problems_[task]; }
  /// Returns the numbers of the stances at most two places from this one in a problem; ascending, without itself.
  const std::vector<int>& neighbours(int stance) const { return neighbours_[static_cast<std::size_t>(stance)]; }

 private:
  void FindNeighbours();

  std::vector<Stance> stances_;
  EnumArray<Task, std::vector<std::vector<int>>> problems_;
  std::vector<std::vector<int>> neighbours_;
};

}  // namespace legopt::certify
