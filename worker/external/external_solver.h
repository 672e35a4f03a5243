#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "legopt/solvers/internal/slotted_program.h"
#include "legopt/solvers/solver.h"
#include "worker/external/line_channel.h"
#include "worker/external/protocol.h"

namespace legopt::external {

/// Largest time budget of an external method: a week.
inline constexpr double kLongestBudget_s = 604'800.0;

/// Options of an external solver. Its declaration, identified by the hash, determines everything else.
struct ExternalOptions {
  std::string declaration;             ///< hash of the declaration (Declaration::hash)
  double constraint_tolerance = 1e-4;  ///< limit for each violation, (0, 1e-3]
  double budget_s = 0.0;               ///< wall time of a job after which the best point so far is the result; 0: none
  int max_rounds = 5;                  ///< nonlinear programs solved in sequence, each with the rows found so far, >= 1

  /// Keys under `options:` (option_fields.h).
  static void Visit(auto& options, auto& fields) {
    fields.Digest("declaration", options.declaration);
    fields.Number("constraint_tolerance", options.constraint_tolerance, 1e-12, 1e-3);
    fields.Integer("max_rounds", options.max_rounds, 1, 1000);
    fields.NumberWithDefault("budget_s", options.budget_s, 0.0, kLongestBudget_s, 0.0);
  }
};

/// Settings for the communication with one external solver.
struct ExternalProtocol {
  std::string name;                                    ///< name from its declaration, for messages
  nlohmann::json settings = nlohmann::json::object();  ///< passed on unchanged
  double silence_s = 60.0;      ///< maximum time without a line from it while legopt waits for one
  double cancel_grace_s = 2.0;  ///< time from `cancel` to its solution
  /// The solver cannot send requests: every `solve` contains the evaluation at its start, and another `solve` about the
  /// reached point follows while that point is infeasible and progress is made.
  bool has_no_requests = false;
};

/// Starts the solver and returns a channel on which it says hello.
using ChannelMaker = std::function<std::unique_ptr<LineChannel>()>;

/// External solver that requests evaluations over a LineChannel (protocol: docs/reference/external-solvers.md).
///
/// The solver receives the program in the form of SlottedProgram: smooth, with fixed structure, in dx about the start.
/// Like Ipopt it receives a sequence of them ("rounds"). If it ends at rows without their own slot, or infeasible while
/// new rows appear, another `solve` about that point follows, whatever its value.
///
/// The returned point is evaluated here. If the best of all requested points is better, that one is the result. Terms
/// count their own evaluations. The stop check runs at each request of the solver. While the solver is silent, it runs
/// only for stops without a result (wall time, a user): stops by effort therefore occur at the same evaluation whenever
/// the solver makes the same requests. With a time budget (budget_s), which all solves of this object share, the solver
/// is asked for its best point at the end of the budget, and the result is marked.
///
/// The history contains the progress reported by the solver, the first evaluation, and each evaluation that is better
/// than all before it.
///
/// The solver runs until this object is destroyed. Solve throws SolverFault, with the solver's name, if it violates the
/// protocol, is silent or ends; the next Solve restarts it.
class ExternalSolver final : public Solver {
 public:
  /// `options` must have been checked by Method::Validate.
  ExternalSolver(ExternalOptions options, ExternalProtocol manner, ChannelMaker make_channel);

  /// Starts the solver unless it is running, and receives its hello, so that no solve is charged for this. Throws like
  /// Solve, which otherwise does it.
  void Start();

  SolverResult Solve(Program& program, Eigen::VectorXd& x, const SolverContext& context) override;

 private:
  struct Best {
    Eigen::VectorXd x;
    ObjectiveValue value;
  };

  void WithSolverName(const std::function<void()>& talk);
  void RestartSolver();
  void Send(const std::string& line);
  std::optional<SolveStatus> Stopped(const SolverContext& context);
  SolverMessage Await(const SolverContext& context);
  void RunRounds(int num_waypoints, const SolverContext& context);
  SolutionReport SolveRound(const SolverContext& context);
  void Answer(EvaluateRequest request, const SolverContext& context);
  nlohmann::json Contacts();
  nlohmann::json AtStart();
  std::string SolveLineAbout(const Eigen::VectorXd& base, int round, int num_waypoints);
  void RecordProgress(const ProgressReport& progress, const SolverContext& context);
  SolutionReport Cancel();
  std::optional<SolutionReport> AwaitAfterCancel(LineChannel::Clock::time_point deadline);
  bool EvaluateSolution(const SolutionReport& solution, const ObjectiveValue& start);
  void RecordEnd(const SolverContext& context);
  void UpdateBest();
  bool Satisfied(const ObjectiveValue& value) const { return value.max_violation < options_.constraint_tolerance; }
  bool Better(const ObjectiveValue& a, const ObjectiveValue& b) const;
  SolveStatus Verdict(bool kept_end) const;

  ExternalOptions options_;
  ExternalProtocol protocol_;
  ChannelMaker make_channel_;
  std::unique_ptr<LineChannel> channel_;
  Program* program_ = nullptr;  ///< program of the current solve
  SlottedProgram slotted_;
  Best best_;  ///< best point of the current solve
  ReportedStatus claim_ = ReportedStatus::kFailed;
  bool kept_end_ = false;  ///< best_ is the point at which the solver ended
  int evaluations_ = 0;
  std::int64_t progress_lines_ = 0;
  Eigen::VectorXd last_requested_;  ///< point of the last request
  int repeats_ = 0;                 ///< consecutive requests for that point
  std::optional<SolveStatus> stop_status_;
  std::optional<LineChannel::Clock::time_point>
      budget_end_;             ///< end of the budget of all solves; empty: no solve has started, or no budget
  bool budget_spent_ = false;  ///< the budget ended the current solve
  std::uint64_t seed_ = 0;
  std::vector<double> scratch_;
};

}  // namespace legopt::external
