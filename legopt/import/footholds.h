#pragma once

#include <map>
#include <set>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "legopt/dataset/stance.h"
#include "words/task.h"

namespace legopt {

/// Problem ids by task.
using ProblemIds = std::map<Task, std::set<int>>;

/// "posture 3, 33, 38-39; motion 0-4".
std::string ToString(const ProblemIds& ids);

/// A foothold and everything that uses it.
struct UsedFoothold {
  Foothold foothold;    ///< as in the problems
  ProblemIds problems;  ///< whose stances have it
};

/// Collects the footholds of problems, each different one once, in the order of their first use.
class FootholdList {
 public:
  /// Adds what the problems of one task use.
  void Add(Task task, std::span<const ProblemDefinition> problems);
  /// Each different one once, in the order of first use.
  const std::vector<UsedFoothold>& all() const { return footholds_; }

 private:
  std::vector<UsedFoothold> footholds_;
  std::map<std::string, size_t> index_;  ///< by the text of the foothold
};

}  // namespace legopt
