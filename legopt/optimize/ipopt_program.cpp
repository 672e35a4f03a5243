#include "legopt/optimize/ipopt_program.h"

#include <algorithm>

namespace legopt {
namespace {

constexpr double kInfinity = 2e19;  // beyond Ipopt's notion of "no bound"

}  // namespace

IpoptProgram::IpoptProgram(SlottedProgram& slotted, const SolverContext& context, const Settings& settings)
    : slotted_(slotted), context_(context), settings_(settings) {
  last_dx_.setZero(slotted.num_variables());
  for (size_t i = 0; i < slotted.rows().size(); ++i) {
    if (slotted.rows()[i].kind == TermKind::kPreference) preferred_.push_back(i);
  }
  Evaluate(last_dx_.data());
}

bool IpoptProgram::Evaluate(const Number* x) {
  if (error_) return false;
  try {
    const bool finite = slotted_.Evaluate(x);
    if (finite) NoteBest();
    return finite;
  } catch (...) {
    error_ = std::current_exception();
    return false;
  }
}

bool IpoptProgram::Better(const ObjectiveValue& a, const ObjectiveValue& b) const {
  const bool a_feasible = a.max_violation < settings_.tolerance;
  const bool b_feasible = b.max_violation < settings_.tolerance;
  if (a_feasible != b_feasible) return a_feasible;
  return a_feasible ? a.Objective() < b.Objective() : a.max_violation < b.max_violation;
}

void IpoptProgram::NoteBest() {
  if (best_x_.size() > 0 && !Better(slotted_.value(), best_value_)) return;
  best_x_ = slotted_.x();
  best_value_ = slotted_.value();
}

bool IpoptProgram::get_nlp_info(Index& n, Index& m, Index& nnz_jac, Index& nnz_hessian, IndexStyleEnum& style) {
  const auto excesses = static_cast<Index>(preferred_.size());
  n = slotted_.num_variables() + excesses;
  m = static_cast<Index>(slotted_.rows().size());
  nnz_jac = static_cast<Index>(slotted_.jacobian().size()) + excesses;
  nnz_hessian = 0;
  ForEachHessianEntry(slotted_.cost(), slotted_.coupled(), [&](int, int, double) { ++nnz_hessian; });
  style = C_STYLE;
  return true;
}

bool IpoptProgram::get_bounds_info(Index n, Number* x_l, Number* x_u, Index m, Number* g_l, Number* g_u) {
  const Index steps = slotted_.num_variables();
  std::fill(x_l + steps, x_l + n, 0.0);
  std::fill(x_u + steps, x_u + n, kInfinity);
  for (Index i = 0; i < steps; ++i) {
    x_l[i] = std::clamp(slotted_.lower()[i], -kInfinity, 0.0);
    x_u[i] = std::clamp(slotted_.upper()[i], 0.0, kInfinity);
  }
  for (Index i = 0; i < m; ++i) {
    const bool equality = slotted_.rows()[static_cast<size_t>(i)].kind == TermKind::kEquality;
    g_l[i] = equality ? -settings_.band : -kInfinity;
    g_u[i] = equality ? settings_.band : 0.0;
  }
  return true;
}

bool IpoptProgram::get_starting_point(Index n, bool, Number* x, bool, Number*, Number*, Index, bool, Number*) {
  std::fill_n(x, n, 0.0);
  if (!Evaluate(x)) return false;
  for (size_t k = 0; k < preferred_.size(); ++k) {
    x[slotted_.num_variables() + static_cast<Index>(k)] = std::max(0.0, slotted_.row_values()[preferred_[k]]);
  }
  return true;
}

bool IpoptProgram::eval_f(Index, const Number* x, bool, Number& value) {
  if (!Evaluate(x)) return false;
  value = slotted_.cost().constant();
  const Number* excess = x + slotted_.num_variables();
  for (const size_t row : preferred_) value += slotted_.rows()[row].weight * *excess++;
  return true;
}

bool IpoptProgram::eval_grad_f(Index n, const Number* x, bool, Number* gradient) {
  if (!Evaluate(x)) return false;
  const ConvexSubproblem& cost = slotted_.cost();
  const Index steps = slotted_.num_variables();
  for (Index k = steps; k < n; ++k) gradient[k] = slotted_.rows()[preferred_[static_cast<size_t>(k - steps)]].weight;
  for (Index i = 0; i < steps; ++i) {
    const int padded = i / cost.block_size() * cost.stride() + i % cost.block_size();
    gradient[i] = cost.gradient()[static_cast<size_t>(padded)];
  }
  return true;
}

bool IpoptProgram::eval_g(Index, const Number* x, bool, Index, Number* g) {
  if (!Evaluate(x)) return false;
  std::ranges::copy(slotted_.row_values(), g);
  const Number* excess = x + slotted_.num_variables();
  for (const size_t row : preferred_) g[row] -= *excess++;
  return true;
}

bool IpoptProgram::eval_jac_g(Index, const Number* x, bool, Index m, Index, Index* rows, Index* columns,
                              Number* values) {
  if (values != nullptr) {
    if (!Evaluate(x)) return false;
    Number* const excesses = std::ranges::copy(slotted_.jacobian(), values).out;
    std::fill_n(excesses, preferred_.size(), -1.0);
    return true;
  }
  Index k = 0;
  for (Index i = 0; i < m; ++i) {
    const SlottedProgram::Row& row = slotted_.rows()[static_cast<size_t>(i)];
    for (int j = 0; j < row.size; ++j, ++k) {
      rows[k] = i;
      columns[k] = row.first + j;
    }
  }
  for (size_t p = 0; p < preferred_.size(); ++p, ++k) {
    rows[k] = static_cast<Index>(preferred_[p]);
    columns[k] = slotted_.num_variables() + static_cast<Index>(p);
  }
  return true;
}

bool IpoptProgram::eval_h(Index, const Number* x, bool, Number factor, Index, const Number*, bool, Index, Index* rows,
                          Index* columns, Number* values) {
  if (values != nullptr && !Evaluate(x)) return false;
  Index k = 0;
  ForEachHessianEntry(slotted_.cost(), slotted_.coupled(), [&](int i, int j, double h) {
    if (values != nullptr) {
      values[k++] = factor * (h + (i == j ? settings_.damping : 0.0));
    } else {
      rows[k] = j;  // lower triangle
      columns[k++] = i;
    }
  });
  return true;
}

bool IpoptProgram::intermediate_callback(Ipopt::AlgorithmMode, Index iteration, Number, Number, Number, Number, Number,
                                         Number, Number, Number, Index, const Ipopt::IpoptData*,
                                         Ipopt::IpoptCalculatedQuantities*) {
  if (error_) return false;
  try {
    if (iteration > 0) {
      ++iterations_;
      const ObjectiveValue& value = slotted_.value();  // Ipopt has just moved to the point that it evaluated last
      if (context_.history != nullptr) {
        context_.history->push_back({.cost = value.cost, .violation = value.max_violation, .accepted = true});
      }
    }
    stop_status_ = context_.Stopped();
  } catch (...) {
    error_ = std::current_exception();
    return false;
  }
  return stop_status_ == SolveStatus::kNotRun;
}

void IpoptProgram::finalize_solution(Ipopt::SolverReturn, Index, const Number* x, const Number*, const Number*, Index,
                                     const Number*, const Number*, Number, const Ipopt::IpoptData*,
                                     Ipopt::IpoptCalculatedQuantities*) {
  last_dx_ = Eigen::Map<const Eigen::VectorXd>(x, last_dx_.size());
}

}  // namespace legopt
