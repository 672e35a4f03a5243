#include "legopt/solvers/solver.h"

#include <algorithm>

namespace legopt {

void SolverContext::Record(IterationRecord step) const {
  if (history == nullptr) return;
  step.step = static_cast<int>(history->size());
  step.start = start;
  if (stamp) stamp(step);
  history->push_back(step);
}

size_t NumRecords(const SolverContext& context) { return context.history == nullptr ? 0 : context.history->size(); }

void CloseHistory(const SolverContext& context, size_t first_record, const ObjectiveValue& returned) {
  if (NumRecords(context) == first_record) return;
  std::vector<IterationRecord>& history = *context.history;
  const auto begin = history.begin() + static_cast<std::ptrdiff_t>(first_record);
  const auto last = std::find_if(history.rbegin(), std::make_reverse_iterator(begin),
                                 [](const IterationRecord& record) { return record.accepted; });
  const bool accepted = last != std::make_reverse_iterator(begin);
  if (accepted && last->cost == returned.cost && last->violation == returned.max_violation) return;
  const auto met = std::find_if(begin, history.end(), [&](const IterationRecord& record) {
    return record.cost == returned.cost && record.violation == returned.max_violation;
  });
  IterationRecord end = history.back();
  end.step = static_cast<int>(history.size());
  if (context.stamp) context.stamp(end);
  if (met != history.end()) {
    end.restart = met->restart;
    end.start = met->start;
  }
  end.cost = returned.cost;
  end.violation = returned.max_violation;
  end.accepted = true;
  history.push_back(end);
}

}  // namespace legopt
