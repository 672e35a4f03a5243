#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "legopt/optimize/slotted_program.h"

/// The lines that pass between legopt and a solver of others: docs/solvers.md. Each is one JSON object with a `type`.
/// Pure functions.
namespace legopt::external {

/// Version of the protocol, in `hello` and `solve`.
inline constexpr int kProtocol = 1;

/// How a solver says that it ended.
enum class Claim : std::uint8_t {
  kConverged,  ///< it holds its point for an optimum
  kLimit,      ///< a limit of its own, or `cancel`, ended it
  kFailed      ///< it could not go on
};

/// First line of a solver.
struct Hello {
  std::string name;     ///< for logs
  std::string version;  ///< likewise
};

/// It wants to know the program at x.
struct EvaluateRequest {
  std::int64_t id = 0;     ///< comes back with the answer
  Eigen::VectorXd x;       ///< dx about the start
  bool gradients = false;  ///< derivatives, too
  bool contacts = false;   ///< what is near each other there, too
};

/// A line of its history.
struct ProgressReport {
  double cost = 0.0;       ///< F
  double violation = 0.0;  ///< largest of a row
};

/// Its last word on a solve.
struct SolutionReport {
  Eigen::VectorXd x;                       ///< dx about the start
  Claim status = Claim::kFailed;           ///< by its own word
  std::vector<Eigen::VectorXd> waypoints;  ///< configurations in place of x, which is empty then
};

/// What a solver may say.
using SolverMessage = std::variant<Hello, EvaluateRequest, ProgressReport, SolutionReport>;

/// Reads a line of a solver. Throws SolverFault that says what is wrong with it, `num_variables` numbers in each x
/// included.
SolverMessage ReadMessage(std::string_view line, int num_variables);

/// What a `solve` says besides the program.
struct SolveTerms {
  int round = 0;            ///< of this start: 0, or further ones about better points
  std::uint64_t seed = 0;   ///< for the solver's own draws; below 2^53, which every language reads exactly
  double tolerance = 0.0;   ///< violation from which on a row does not hold
  nlohmann::json settings;  ///< of the declaration
  nlohmann::json robot;     ///< as of RobotJson (robot_lines.h); null: it is no robot's program
  nlohmann::json at_start;  ///< for who cannot ask: the evaluation there; null for others
};

/// The line that begins a solve.
std::string SolveLine(const SlottedProgram& program, int num_waypoints, const SolveTerms& terms);

/// The answer to an EvaluateRequest, where the program is now; `finite` as Evaluate said, `contacts` as of ContactsJson
/// (robot_lines.h) where they are asked for.
nlohmann::json EvaluationJson(const SlottedProgram& program, const EvaluateRequest& request, bool finite,
                              nlohmann::json contacts = {});

/// Asks it to end the solve.
std::string CancelLine();

/// First line of a solver that says none itself.
std::string HelloLine(const std::string& name);

/// The `solution` that a file holds. It may leave out its type, its status where that is `converged`, and its point
/// where that is `failed`. Throws SolverFault.
std::string SolutionLine(std::string_view file, int num_variables);

/// The `solution` of one that was ended before it had any: the start.
std::string StoppedLine(int num_variables);

}  // namespace legopt::external
