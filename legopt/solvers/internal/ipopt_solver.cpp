#include "legopt/solvers/internal/ipopt_solver.h"

#include <IpTNLP.hpp>
#include <algorithm>
#include <exception>
#include <string>

namespace legopt {
namespace {

constexpr double kIpoptInfinity = 2e19;  // beyond Ipopt's threshold for "no bound"
constexpr double kViolationShare = 0.1;  // share of the constraint tolerance that Ipopt must reach
constexpr double kStagnantError = 0.1;   // largest optimality error at which Ipopt may stop when the cost stagnates
constexpr int kStagnantIterations = 5;
constexpr double kLaterBarrier = 1e-3;  // initial barrier of rounds after the first, which start near an optimum
constexpr double kLaterPush = 1e-6;     // distance by which these are moved away from bounds

/// Adapter of a SlottedProgram to Ipopt's interface. It also calls the stop check, records the history and stores the
/// best point.
class IpoptProgram : public Ipopt::TNLP {
 public:
  using Index = Ipopt::Index;
  using Number = Ipopt::Number;

  /// Numerical settings of the solve.
  struct Settings {
    double tolerance = 0.0;  ///< a point with less violation is feasible
    double band = 0.0;       ///< half width of the band that replaces each equality; 0 for true equalities
    double damping = 0.0;    ///< added to the diagonal of the Gauss-Newton matrix
  };

  /// All arguments must outlive the solve.
  IpoptProgram(SlottedProgram& slotted, const SolverContext& context, const Settings& settings);

  /// Returns all members but `end`. Rethrows exceptions of terms and of the stop check.
  IpoptRound Result() const {
    if (error_) std::rethrow_exception(error_);
    return round_;
  }

  bool get_nlp_info(Index& n, Index& m, Index& nnz_jac, Index& nnz_hessian, IndexStyleEnum& style) override;
  bool get_bounds_info(Index n, Number* x_l, Number* x_u, Index m, Number* g_l, Number* g_u) override;
  bool get_starting_point(Index n, bool init_x, Number* x, bool init_z, Number* z_l, Number* z_u, Index m,
                          bool init_lambda, Number* lambda) override;
  bool eval_f(Index n, const Number* x, bool new_x, Number& value) override;
  bool eval_grad_f(Index n, const Number* x, bool new_x, Number* gradient) override;
  bool eval_g(Index n, const Number* x, bool new_x, Index m, Number* g) override;
  bool eval_jac_g(Index n, const Number* x, bool new_x, Index m, Index entries, Index* rows, Index* columns,
                  Number* values) override;
  bool eval_h(Index n, const Number* x, bool new_x, Number factor, Index m, const Number* lambda, bool new_lambda,
              Index entries, Index* rows, Index* columns, Number* values) override;
  bool intermediate_callback(Ipopt::AlgorithmMode mode, Index iteration, Number objective, Number inf_pr, Number inf_du,
                             Number mu, Number d_norm, Number regularization, Number alpha_du, Number alpha_pr,
                             Index trials, const Ipopt::IpoptData* data,
                             Ipopt::IpoptCalculatedQuantities* quantities) override;
  void finalize_solution(Ipopt::SolverReturn status, Index n, const Number* x, const Number* z_l, const Number* z_u,
                         Index m, const Number* g, const Number* lambda, Number objective, const Ipopt::IpoptData* data,
                         Ipopt::IpoptCalculatedQuantities* quantities) override;

 private:
  bool Evaluate(const Number* x);
  void UpdateBest();
  bool Better(const ObjectiveValue& a, const ObjectiveValue& b) const;

  SlottedProgram& slotted_;
  std::vector<size_t> preferred_;  ///< rows of preferences, in the order of their excess variables
  const SolverContext& context_;
  Settings settings_;
  IpoptRound round_;
  std::exception_ptr error_;
};

IpoptProgram::IpoptProgram(SlottedProgram& slotted, const SolverContext& context, const Settings& settings)
    : slotted_(slotted), context_(context), settings_(settings) {
  round_.last_dx.setZero(slotted.num_variables());
  for (size_t i = 0; i < slotted.rows().size(); ++i) {
    if (slotted.rows()[i].kind == TermKind::kPreference) preferred_.push_back(i);
  }
  Evaluate(round_.last_dx.data());
}

bool IpoptProgram::Evaluate(const Number* x) {
  if (error_) return false;
  try {
    const bool finite = slotted_.Evaluate(x);
    if (finite) UpdateBest();
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

void IpoptProgram::UpdateBest() {
  if (round_.best_x.size() > 0 && !Better(slotted_.value(), round_.best_value)) return;
  round_.best_x = slotted_.x();
  round_.best_value = slotted_.value();
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
  std::fill(x_u + steps, x_u + n, kIpoptInfinity);
  for (Index i = 0; i < steps; ++i) {
    x_l[i] = std::clamp(slotted_.lower()[i], -kIpoptInfinity, 0.0);
    x_u[i] = std::clamp(slotted_.upper()[i], 0.0, kIpoptInfinity);
  }
  for (Index i = 0; i < m; ++i) {
    const bool equality = slotted_.rows()[static_cast<size_t>(i)].kind == TermKind::kEquality;
    g_l[i] = equality ? -settings_.band : -kIpoptInfinity;
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
      ++round_.iterations;
      const ObjectiveValue& value = slotted_.value();  // Ipopt has just moved to the point that it evaluated last
      context_.Record({.cost = value.cost, .violation = value.max_violation, .accepted = true});
    }
    round_.stop_status = context_.Stopped();
  } catch (...) {
    error_ = std::current_exception();
    return false;
  }
  return !round_.stop_status;
}

void IpoptProgram::finalize_solution(Ipopt::SolverReturn, Index, const Number* x, const Number*, const Number*, Index,
                                     const Number*, const Number*, Number, const Ipopt::IpoptData*,
                                     Ipopt::IpoptCalculatedQuantities*) {
  round_.last_dx = Eigen::Map<const Eigen::VectorXd>(x, round_.last_dx.size());
}

/// Returns whether there are more equalities than free variables, which Ipopt does not accept.
bool TooManyEqualities(const SlottedProgram& slotted) {
  const auto equality = [](const SlottedProgram::Row& row) { return row.kind == TermKind::kEquality; };
  const auto free = (slotted.upper().array() > slotted.lower().array()).count();
  return std::ranges::count_if(slotted.rows(), equality) > free;
}

void SetOptions(const IpoptOptions& options, int round, int max_iterations, QuietIpopt& ipopt) {
  ipopt.SetInteger("max_iter", max_iterations);
  ipopt.SetNumber("tol", options.tolerance);
  ipopt.SetNumber("constr_viol_tol", kViolationShare * options.constraint_tolerance);
  ipopt.SetInteger("acceptable_iter", kStagnantIterations);
  ipopt.SetNumber("acceptable_tol", std::max(options.tolerance, kStagnantError));
  ipopt.SetNumber("acceptable_obj_change_tol", options.stagnation_frac);
  ipopt.SetNumber("acceptable_constr_viol_tol", kViolationShare * options.constraint_tolerance);
  ipopt.SetNumber("bound_relax_factor", 0.0);
  ipopt.SetText("mu_strategy", std::string(ToString(options.barrier)));
  if (options.hessian == IpoptHessian::kLimitedMemory) ipopt.SetText("hessian_approximation", "limited-memory");
  if (round == 0) return;
  ipopt.SetNumber("mu_init", kLaterBarrier);
  ipopt.SetNumber("bound_push", kLaterPush);
  ipopt.SetNumber("bound_frac", kLaterPush);
}

}  // namespace

IpoptRound SolveByIpopt(SlottedProgram& slotted, const SolverContext& context, const IpoptOptions& options, int round,
                        int max_iterations) {
  QuietIpopt ipopt;
  SetOptions(options, round, max_iterations, ipopt);
  const double band = TooManyEqualities(slotted) ? 0.5 * options.constraint_tolerance : 0.0;
  const Ipopt::SmartPtr<IpoptProgram> program =
      new IpoptProgram(slotted, context, {options.constraint_tolerance, band, options.damping});
  const QuietIpopt::End end = ipopt.Solve(*program);
  IpoptRound result = program->Result();
  result.end = end;
  return result;
}

namespace {

constexpr double kProgress = 0.9;  // a failed round that reduces the violation below this share is followed by another

}  // namespace

SolverResult IpoptSolver::Solve(Program& program, Eigen::VectorXd& x, const SolverContext& context) {
  SolverResult result;
  program.ClearCache();
  program.ProjectOnBounds(x);
  value_ = EvaluateObjective(program, x, scratch_);
  if (!value_.IsFinite()) {
    result.status = SolveStatus::kNumericalFailure;
    result.value = value_;
    return result;
  }
  const size_t first_record = NumRecords(context);
  slotted_.Reset(program);
  iterations_ = 0;
  result.status = RunRounds(x, context);
  result.value = EvaluateObjective(program, x, scratch_);
  result.feasible = Satisfied(result.value);
  result.iterations = iterations_;
  CloseHistory(context, first_record, result.value);
  return result;
}

SolveStatus IpoptSolver::RunRounds(Eigen::VectorXd& x, const SolverContext& context) {
  stop_status_ = context.Stopped();
  if (stop_status_) return *stop_status_;
  slotted_.Rebase(x);
  QuietIpopt::End end = QuietIpopt::End::kIterationLimit;
  for (int round = 0; round < options_.max_rounds; ++round) {
    const double violation = value_.max_violation;
    end = SolveRound(x, round, context);
    if (end == QuietIpopt::End::kStopped || end == QuietIpopt::End::kIterationLimit) break;
    if (end == QuietIpopt::End::kSolved && !slotted_.SharedSlotActive(options_.constraint_tolerance)) break;
    const bool grown = slotted_.Rebase(x);
    const bool closer = !Satisfied(value_) && value_.max_violation < kProgress * violation;
    if (!grown && !closer) break;
  }
  return Verdict(end);
}

QuietIpopt::End IpoptSolver::SolveRound(Eigen::VectorXd& x, int round, const SolverContext& context) {
  const int iterations_left = options_.max_iterations - iterations_;
  if (iterations_left <= 0) return QuietIpopt::End::kIterationLimit;
  const IpoptRound made = SolveByIpopt(slotted_, context, options_, round, iterations_left);
  iterations_ += made.iterations;
  const bool solved = made.end == QuietIpopt::End::kSolved;
  if (solved && slotted_.Evaluate(made.last_dx.data()) && Satisfied(slotted_.value())) {
    x = slotted_.x();
    value_ = slotted_.value();
    return made.end;
  }
  x = made.best_x;
  value_ = made.best_value;
  stop_status_ = made.stop_status;
  return solved ? QuietIpopt::End::kFailed : made.end;
}

SolveStatus IpoptSolver::Verdict(QuietIpopt::End end) const {
  switch (end) {
    case QuietIpopt::End::kStopped:
      return *stop_status_;
    case QuietIpopt::End::kSolved:
      return SolveStatus::kConvergedFeasible;
    case QuietIpopt::End::kNoProgress:
      // A feasible point where Ipopt got stuck is not an optimum.
      return Satisfied(value_) ? SolveStatus::kIterationLimit : SolveStatus::kConvergedInfeasible;
    case QuietIpopt::End::kIterationLimit:
      return SolveStatus::kIterationLimit;
    case QuietIpopt::End::kFailed:
      break;
  }
  return Satisfied(value_) ? SolveStatus::kIterationLimit : SolveStatus::kNumericalFailure;
}

}  // namespace legopt
