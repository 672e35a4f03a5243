#include "legopt/optimize/penalty_objective.h"

#include <cmath>

namespace legopt {

bool ObjectiveValue::IsFinite() const { return std::isfinite(cost) && std::isfinite(violation); }

ObjectiveValue EvaluateObjective(Program& program, Eigen::Ref<const Eigen::VectorXd> x, std::vector<double>& scratch) {
  program.SetPoint(x);
  ObjectiveValue value;
  const auto& terms = program.terms();
  for (size_t k = 0; k < terms.size(); ++k) {
    scratch.clear();
    terms[k]->Evaluate(scratch);
    const TermKind kind = terms[k]->shape().kind;
    for (const double r : scratch) {
      if (kind == TermKind::kCost) {
        value.cost += r * r;
        continue;
      }
      const double v = kind == TermKind::kEquality ? std::abs(r) : (r > 0.0 || std::isnan(r) ? r : 0.0);
      value.violation += v;
      if (v > value.max_violation) {
        value.max_violation = v;
        value.worst_term = static_cast<int>(k);
      }
    }
  }
  return value;
}

}  // namespace legopt
