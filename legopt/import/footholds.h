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
  Foothold foothold;
  ProblemIds problems;
};

/// Collects the footholds of problems, each different one once, in the order of their first use.
class FootholdList {
 public:
  void Add(Task task, std::span<const ProblemDefinition> problems);
  const std::vector<UsedFoothold>& all() const { return footholds_; }

 private:
  std::vector<UsedFoothold> footholds_;
  std::map<std::string, size_t> index_;  ///< by the text of the foothold
};

}  // namespace legopt
