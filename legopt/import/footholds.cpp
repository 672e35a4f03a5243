#include "legopt/import/footholds.h"

namespace legopt {

std::string ToString(const ProblemIds& ids) {
  std::string text;
  for (const auto& [task, set] : ids) {
    if (set.empty()) continue;
    text += (text.empty() ? "" : "; ") + std::string(ToString(task));
    const char* separator = " ";
    for (auto id = set.begin(); id != set.end();) {
      const int first = *id;
      int last = first;
      for (++id; id != set.end() && *id == last + 1; ++id) last = *id;
      text += separator + std::to_string(first);
      if (last > first) text += "-" + std::to_string(last);
      separator = ", ";
    }
  }
  return text;
}

void FootholdList::Add(Task task, std::span<const ProblemDefinition> problems) {
  for (const ProblemDefinition& problem : problems) {
    for (const Stance& stance : problem.stances) {
      for (const Foothold& foothold : stance.footholds) {
        const auto [place, fresh] = index_.try_emplace(FormatStance({{foothold}}), footholds_.size());
        if (fresh) footholds_.push_back({foothold, {}});
        footholds_[place->second].problems[task].insert(problem.id);
      }
    }
  }
}

}  // namespace legopt
