#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "client/report/result_source.h"
#include "legopt/evaluate/findings.h"
#include "words/task.h"

namespace legopt::client {

/// A job with a solution, as the database has it.
struct PageJob {
  std::size_t experiment = 0;  ///< index among the page's
  std::int64_t job_id = 0;
  std::int64_t method_id = 0;
  Task task{};
  int problem = 0;
  bool solved = false;  ///< by the page's rule
  std::optional<int> failed_waypoint;
};

/// The waypoints of a job as a page shows them.
struct PageMotion {
  std::vector<Eigen::VectorXd> waypoints;  ///< the solution; of a motion with an unsolved window its solved windows
  /// Number of the waypoint from which on they are the best point of the window that was not solved; they have no time
  /// stamps then, also of tasks whose solutions have them.
  std::optional<int> unsolved_from;
};

/// Reads them. Errors as ReadWaypointsOf.
PageMotion ReadPageMotion(ResultSource& source, const PageJob& job);

/// The jobs of an experiment that have waypoints or a trace, in the order in which a page of limited size takes them:
/// failed postures, failed motions, other postures, other motions of the first two methods, the rest.
std::vector<PageJob> JobsWithSolutions(ResultSource& source, std::int64_t experiment_id, Rule rule);

/// How far the findings of a motion go.
enum class FindingDepth : std::uint8_t {
  kNone,       ///< no findings: of solved motions in a report
  kWaypoints,  ///< of each waypoint
  kBetween     ///< and between waypoints, where the judge scores them
};

/// Solutions that a page reads together, with what the judge finds in them.
class SolutionChunk {
 public:
  /// Adds a job. Waypoints that have not the robot's size are left out, and said in "malformed".
  void Add(const PageJob& job, const PageMotion& motion, nlohmann::ordered_json trace, FindingLister* lister,
           FindingDepth depth);
  bool empty() const { return solutions_.empty(); }
  std::size_t weight() const { return bytes_.size() + text_bytes_; }  ///< bytes before compression, about
  const std::string& bytes() const { return bytes_; }                 ///< waypoints of all
  const nlohmann::ordered_json& json() const { return solutions_; }   ///< "solutions" of docs/page-data.md

 private:
  nlohmann::ordered_json solutions_ = nlohmann::ordered_json::array();
  std::string bytes_;
  std::size_t text_bytes_ = 0;
};

/// How a solve converged, thinned to at most kMostShown steps: columns as in docs/database.md. Null: not recorded.
nlohmann::ordered_json TraceJson(ResultSource& source, std::int64_t job_id);
inline constexpr std::size_t kMostShown = 200;  ///< steps of a convergence curve

}  // namespace legopt::client
