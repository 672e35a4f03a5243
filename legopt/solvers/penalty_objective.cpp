#include "legopt/solvers/penalty_objective.h"

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

}  // namespace legopt
