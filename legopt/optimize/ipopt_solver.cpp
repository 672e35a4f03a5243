#include "legopt/optimize/ipopt_solver.h"

#include <algorithm>
#include <mutex>

#include "legopt/optimize/ipopt_program.h"
#include "legopt/subproblem/ipopt_application.h"

namespace legopt {
namespace {

constexpr double kViolationShare = 0.1;  // of the constraint tolerance: what Ipopt aims at
constexpr double kStagnantError = 0.1;   // largest optimality error at which Ipopt may stop when the cost stagnates
constexpr int kStagnantIterations = 5;
constexpr double kProgress = 0.9;       // of the violation: a failed round that came closer than this gets another
constexpr double kLaterBarrier = 1e-3;  // of rounds after the first, which start near an optimum
constexpr double kLaterPush = 1e-6;     // how far they are moved away from bounds

/// Ipopt requires at most as many equalities as free variables.
bool TooManyEqualities(const SlottedProgram& slotted) {
  const auto equality = [](const SlottedProgram::Row& row) { return row.kind == TermKind::kEquality; };
  const auto free = (slotted.upper().array() > slotted.lower().array()).count();
  return std::ranges::count_if(slotted.rows(), equality) > free;
}

void SetOptions(const IpoptOptions& options, int round, int max_iterations, Ipopt::OptionsList& list) {
  list.SetIntegerValue("max_iter", max_iterations);
  list.SetNumericValue("tol", options.tolerance);
  list.SetNumericValue("constr_viol_tol", kViolationShare * options.constraint_tolerance);
  list.SetIntegerValue("acceptable_iter", kStagnantIterations);
  list.SetNumericValue("acceptable_tol", std::max(options.tolerance, kStagnantError));
  list.SetNumericValue("acceptable_obj_change_tol", options.stagnation_frac);
  list.SetNumericValue("acceptable_constr_viol_tol", kViolationShare * options.constraint_tolerance);
  list.SetNumericValue("bound_relax_factor", 0.0);
  list.SetStringValue("mu_strategy", options.barrier);
  if (options.hessian == "limited_memory") list.SetStringValue("hessian_approximation", "limited-memory");
  if (round == 0) return;
  list.SetNumericValue("mu_init", kLaterBarrier);
  list.SetNumericValue("bound_push", kLaterPush);
  list.SetNumericValue("bound_frac", kLaterPush);
}

}  // namespace

SolverResult IpoptSolver::Solve(Program& program, Eigen::VectorXd& x, const SolverContext& context) {
  SolverResult result;
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
  if (stop_status_ != SolveStatus::kNotRun) return stop_status_;
  slotted_.Rebase(x);
  RoundEnd end = RoundEnd::kIterationLimit;
  for (int round = 0; round < options_.max_rounds; ++round) {
    const double violation = value_.max_violation;
    end = SolveRound(x, round, context);
    if (end == RoundEnd::kStopped || end == RoundEnd::kIterationLimit) break;
    if (end == RoundEnd::kConverged && !slotted_.SharedSlotActive(options_.constraint_tolerance)) break;
    const bool grown = slotted_.Rebase(x);
    const bool closer = !Satisfied(value_) && value_.max_violation < kProgress * violation;
    if (!grown && !closer) break;
  }
  return Verdict(end);
}

IpoptSolver::RoundEnd IpoptSolver::SolveRound(Eigen::VectorXd& x, int round, const SolverContext& context) {
  const int iterations_left = options_.max_iterations - iterations_;
  if (iterations_left <= 0) return RoundEnd::kIterationLimit;
  const std::lock_guard<std::mutex> lock(IpoptMutex());
  const Ipopt::SmartPtr<Ipopt::IpoptApplication> application = MakeQuietIpopt();
  SetOptions(options_, round, iterations_left, *application->Options());
  if (!InitializeQuietly(*application)) return RoundEnd::kFailed;
  const double band = TooManyEqualities(slotted_) ? 0.5 * options_.constraint_tolerance : 0.0;
  const Ipopt::SmartPtr<IpoptProgram> program =
      new IpoptProgram(slotted_, context, {options_.constraint_tolerance, band, options_.damping});
  const Ipopt::ApplicationReturnStatus status = application->OptimizeTNLP(Ipopt::GetRawPtr(program));
  program->Rethrow();
  iterations_ += program->iterations();
  const bool succeeded = status == Ipopt::Solve_Succeeded || status == Ipopt::Solved_To_Acceptable_Level;
  if (succeeded && slotted_.Evaluate(program->last_dx().data()) && Satisfied(slotted_.value())) {
    x = slotted_.x();
    value_ = slotted_.value();
    return RoundEnd::kConverged;
  }
  x = program->best_x();
  value_ = program->best_value();
  stop_status_ = program->stop_status();
  switch (status) {
    case Ipopt::User_Requested_Stop:
      return RoundEnd::kStopped;
    case Ipopt::Maximum_Iterations_Exceeded:
      return RoundEnd::kIterationLimit;
    case Ipopt::Infeasible_Problem_Detected:
    case Ipopt::Restoration_Failed:
    case Ipopt::Search_Direction_Becomes_Too_Small:
      return RoundEnd::kNoProgress;
    default:
      return RoundEnd::kFailed;
  }
}

SolveStatus IpoptSolver::Verdict(RoundEnd end) const {
  switch (end) {
    case RoundEnd::kStopped:
      return stop_status_;
    case RoundEnd::kConverged:
      return SolveStatus::kConvergedFeasible;
    case RoundEnd::kNoProgress:
      // A feasible point where Ipopt got stuck is not an optimum.
      return Satisfied(value_) ? SolveStatus::kIterationLimit : SolveStatus::kConvergedInfeasible;
    case RoundEnd::kIterationLimit:
      return SolveStatus::kIterationLimit;
    case RoundEnd::kFailed:
      break;
  }
  return Satisfied(value_) ? SolveStatus::kIterationLimit : SolveStatus::kNumericalFailure;
}

}  // namespace legopt
