#include "legopt/import/used_contacts.h"

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

void UsedContactList::Add(Task task, std::span<const ProblemDefinition> problems) {
  for (const ProblemDefinition& problem : problems) {
    for (const Stance& stance : problem.stances) {
      for (const ContactTarget& target : stance.contacts) {
        const auto [place, fresh] = index_.try_emplace(FormatStance({{target}}), contacts_.size());
        if (fresh) contacts_.push_back({target, {}});
        contacts_[place->second].problems[task].insert(problem.id);
      }
    }
  }
}

}  // namespace legopt
