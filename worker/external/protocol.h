#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "legopt/problem/program.h"
#include "legopt/solvers/internal/slotted_program.h"

namespace legopt::external {

/// Lines of the protocol between legopt and an external solver: docs/reference/external-solvers.md. Each is one JSON
/// object with a `type`. Pure functions.

/// Protocol version, in `hello` and `solve`.
inline constexpr int kProtocol = 1;

/// End of a solve according to the solver.
enum class ReportedStatus : std::uint8_t {
  kConverged,  ///< it considers its point an optimum
  kLimit,      ///< one of its limits, or `cancel`, ended it
  kFailed      ///< it could not continue
};

/// First line of a solver.
struct Hello {
  std::string name;     ///< name for logs
  std::string version;  ///< version for logs
};

/// Request of the solver to evaluate the program at x.
struct EvaluateRequest {
  std::int64_t id = 0;     ///< returned with the answer
  Eigen::VectorXd x;       ///< dx about the start
  bool gradients = false;  ///< if true, return derivatives as well
  bool contacts = false;   ///< if true, return pairs of bodies near each other as well
};

/// Progress report for the history.
struct ProgressReport {
  double cost = 0.0;       ///< F
  double violation = 0.0;  ///< largest violation of a row
};

/// Last line of a solve.
struct SolutionReport {
  Eigen::VectorXd x;                                ///< dx about the start
  ReportedStatus status = ReportedStatus::kFailed;  ///< according to the solver
  std::vector<Eigen::VectorXd> waypoints;           ///< configurations instead of x, which is empty then
};

/// Any message of a solver.
using SolverMessage = std::variant<Hello, EvaluateRequest, ProgressReport, SolutionReport>;

/// Parses a line of a solver. Throws SolverFault with the fault, also if an x does not have `num_variables` numbers.
SolverMessage ReadMessage(std::string_view line, int num_variables);

/// Contents of a `solve` in addition to the program.
struct SolveTerms {
  int round = 0;            ///< index of the round: 0, or a further one about a better point
  std::uint64_t seed = 0;   ///< seed of the solver's random numbers; below 2^53, which JSON parsers read exactly
  double tolerance = 0.0;   ///< smallest violation at which a row counts as violated
  nlohmann::json settings;  ///< settings from the declaration
  nlohmann::json robot;     ///< see RobotJson (protocol.h); null: not a robot's program
  nlohmann::json at_start;  ///< evaluation at the start for solvers without requests; otherwise null
};

/// Returns the line that begins a solve.
std::string SolveLine(const SlottedProgram& program, int num_waypoints, const SolveTerms& terms);

/// Returns the answer to an EvaluateRequest at the current point of the program. `finite` is the result of Evaluate,
/// `contacts` is ContactsJson() (protocol.h) if requested.
nlohmann::json EvaluationJson(const SlottedProgram& program, const EvaluateRequest& request, bool finite,
                              nlohmann::json contacts = {});

/// Returns the line that asks the solver to end the solve.
std::string CancelLine();

/// Returns the first line of a solver that sends none itself.
std::string HelloLine(const std::string& name);

/// Returns the `solution` in a file. The file may omit its type, a status `converged`, and its point if the status is
/// `failed`. Throws SolverFault.
std::string SolutionLine(std::string_view file, int num_variables);

/// Returns the `solution` of a solver that was stopped before it had any: the start.
std::string StoppedLine(int num_variables);

// Robot data for external solvers in addition to the nonlinear program, if the program is that of a robot
// (WaypointProgram).

/// Returns the pairs of bodies near or inside each other at the program's point, waypoint after waypoint
/// (docs/reference/external-solvers.md); an empty list if the program is not a robot's.
nlohmann::json ContactsJson(Program& program);

/// Returns the robot, the initial configurations `x` of a solve, and the targets of its feet
/// (docs/reference/external-solvers.md); null if the program is not a robot's.
nlohmann::json RobotJson(const Program& program, const Eigen::VectorXd& x);

/// Returns dx with Retract(x, dx) = `waypoints`. Throws SolverFault if their number or size differs from the program's,
/// a quaternion is zero, or the program is not a robot's.
Eigen::VectorXd TangentTo(const Program& program, const Eigen::VectorXd& x,
                          const std::vector<Eigen::VectorXd>& waypoints);

}  // namespace legopt::external
