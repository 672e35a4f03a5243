#pragma once

#include <map>
#include <set>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "legopt/dataset/stance.h"
#include "legopt/types/task.h"

namespace legopt {

/// Problem ids by task.
using ProblemIds = std::map<Task, std::set<int>>;

/// Formats problem ids like "posture 3, 33, 38-39; motion 0-4".
std::string ToString(const ProblemIds& ids);

/// A target contact and the problems that use it.
struct UsedContact {
  ContactTarget target;
  ProblemIds problems;  ///< problems with a stance that contains it
};

/// Collects the different target contacts of problems, in the order of their first use.
class UsedContactList {
 public:
  /// Adds the contacts of the problems of one task.
  void Add(Task task, std::span<const ProblemDefinition> problems);
  /// Different contacts in the order of first use.
  const std::vector<UsedContact>& all() const { return contacts_; }

 private:
  std::vector<UsedContact> contacts_;
  std::map<std::string, size_t> index_;  ///< keyed by the contact's text
};

}  // namespace legopt
