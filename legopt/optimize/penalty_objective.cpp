#include "legopt/optimize/penalty_objective.h"

#include <cmath>

namespace legopt {

bool ObjectiveValue::IsFinite() const { return std::isfinite(cost) && std::isfinite(violation); }

void ObjectiveValue::Add(TermKind kind, int term, const std::vector<double>& residuals) {
  for (const double r : residuals) {
    if (kind == TermKind::kCost) {
      cost += r * r;
      continue;
    }
    const double v = kind == TermKind::kEquality ? std::abs(r) : (r > 0.0 || std::isnan(r) ? r : 0.0);
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
    value.Add(terms[k]->shape().kind, static_cast<int>(k), scratch);
  }
  return value;
}

}  // namespace legopt
