#include "legopt/solvers/solver.h"

#include <algorithm>
#include <cmath>

namespace legopt {

namespace {

/// Returns max(0, r); NaN stays NaN.
double Excess(double r) { return r > 0.0 || std::isnan(r) ? r : 0.0; }

}  // namespace

bool ObjectiveValue::IsFinite() const { return std::isfinite(Objective()) && std::isfinite(violation); }

void ObjectiveValue::Add(const TermShape& shape, int term, const std::vector<double>& residuals) {
  for (const double r : residuals) {
    if (shape.kind == TermKind::kCost) {
      cost += r * r;
      continue;
    }
    if (shape.kind == TermKind::kPreference) {
      preference += shape.weight * Excess(r);
      continue;
    }
    const double v = shape.kind == TermKind::kEquality ? std::abs(r) : Excess(r);
    violation += v;
    if (v > max_violation) {
      max_violation = v;
      worst_term = term;
    }
  }
}

ObjectiveValue EvaluateObjective(Program& program, Eigen::Ref<const Eigen::VectorXd> x, std::vector<double>& scratch) {
  program.SetPoint(x);
  ObjectiveValue value;
  const auto& terms = program.terms();
  for (size_t k = 0; k < terms.size(); ++k) {
    scratch.clear();
    terms[k]->Evaluate(scratch);
    value.Add(terms[k]->shape(), static_cast<int>(k), scratch);
  }
  return value;
}

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
