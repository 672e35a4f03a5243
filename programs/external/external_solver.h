#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "legopt/optimize/slotted_program.h"
#include "legopt/optimize/solver.h"
#include "programs/external/external_options.h"
#include "programs/external/line_channel.h"
#include "programs/external/protocol.h"

namespace legopt::external {

/// How legopt speaks to one solver of others.
struct ExternalManner {
  std::string name;                                    ///< the word of its declaration, for reasons
  nlohmann::json settings = nlohmann::json::object();  ///< handed on as they are
  double silence_s = 60.0;                             ///< longest time without a line of it while it is its turn
  double cancel_grace_s = 2.0;                         ///< from `cancel` to its solution
  /// It cannot ask: every solve says how its start evaluates, and another one follows about where it got to, as long as
  /// that does not hold and it gets on.
  bool asks_nothing = false;
};

/// Starts the solver: a channel on which it says hello.
using ChannelMaker = std::function<std::unique_ptr<LineChannel>()>;

/// A solver of others, which asks for evaluations over a LineChannel (docs/solvers.md has the protocol).
///
/// It is given the program as SlottedProgram makes it: smooth, of fixed structure, in dx about the start, and, as Ipopt
/// is, a sequence of them ("rounds"): where it ends at rows that had no slot of their own, or infeasible with new rows
/// in sight, another `solve` about that point follows, whatever its worth.
///
/// What it says is judged: its point is evaluated here, and the best of all points that it has asked for is returned
/// where that is better. Term evaluations are counted by the terms. The stop check is asked at each of its requests,
/// and while it is silent, then for what is no result only (a clock, a person): what ends by effort does so at the same
/// evaluation whenever it asks for the same ones. With a budget of time (budget_s), which all solves of this object
/// share, the solver is asked for its best point at the end of it, and the result says so.
///
/// The history has the progress that the solver reports and each evaluation that is the first one or better than all
/// before it.
///
/// The solver serves until this goes. Solve throws SolverFault, naming the solver, when it breaks the protocol, is
/// silent or ends; the next Solve starts it anew.
class ExternalSolver final : public Solver {
 public:
  /// Options as checked by Method::Validate.
  ExternalSolver(ExternalOptions options, ExternalManner manner, ChannelMaker make_channel);

  /// Starts the solver unless it runs, and hears its hello: what no solve is charged for. Throws as Solve, which does
  /// so itself where nobody has.
  void Start();

  SolverResult Solve(Program& program, Eigen::VectorXd& x, const SolverContext& context) override;

 private:
  struct Best {
    Eigen::VectorXd x;
    ObjectiveValue value;
  };

  void NamingTheSolver(const std::function<void()>& talk);
  void StartAnew();
  void Send(const std::string& line);
  std::optional<SolveStatus> Stopped(const SolverContext& context);
  SolverMessage Await(const SolverContext& context);
  void RunRounds(int num_waypoints, const SolverContext& context);
  SolutionReport SolveRound(const SolverContext& context);
  void Answer(EvaluateRequest request, const SolverContext& context);
  nlohmann::json Contacts();
  nlohmann::json AtStart();
  std::string SolveLineAbout(const Eigen::VectorXd& base, int round, int num_waypoints);
  void TakeIn(const ProgressReport& progress, const SolverContext& context);
  SolutionReport Cancel();
  std::optional<SolutionReport> AwaitAfterCancel(LineChannel::Clock::time_point deadline);
  bool TakeEnd(const SolutionReport& solution, const ObjectiveValue& start);
  void RecordEnd(const SolverContext& context);
  void NoteBest();
  bool Satisfied(const ObjectiveValue& value) const { return value.max_violation < options_.constraint_tolerance; }
  bool Better(const ObjectiveValue& a, const ObjectiveValue& b) const;
  SolveStatus Verdict(bool kept_end) const;

  ExternalOptions options_;
  ExternalManner manner_;
  ChannelMaker make_channel_;
  std::unique_ptr<LineChannel> channel_;
  Program* program_ = nullptr;  ///< of the solve at hand
  SlottedProgram slotted_;
  Best best_;  ///< of the solve at hand
  Claim claim_ = Claim::kFailed;
  bool kept_end_ = false;  ///< best_ is where the solver ended
  int evaluations_ = 0;
  std::int64_t progress_lines_ = 0;
  Eigen::VectorXd asked_;  ///< by the last request
  int repeats_ = 0;        ///< of it, in a row
  std::optional<SolveStatus> stop_status_;
  std::optional<LineChannel::Clock::time_point>
      budget_end_;             ///< end of the budget of all solves; empty: no solve has begun, or no budget
  bool budget_spent_ = false;  ///< the budget ended the present solve
  std::uint64_t seed_ = 0;
  std::vector<double> scratch_;
};

}  // namespace legopt::external
