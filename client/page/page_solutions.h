#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "client/report/result_filter.h"
#include "client/report/result_source.h"
#include "legopt/judge/internal/waypoint_inspector.h"
#include "legopt/types/task.h"

namespace legopt::client {

/// Returns the findings of one waypoint in the format of docs/reference/page-data.md, with the names of links, objects
/// and joints. `dataset` must be the dataset of the findings.
nlohmann::ordered_json FindingsJson(const WaypointDiagnostics& findings, const Dataset& dataset);

/// Returns only overlaps, as needed between waypoints.
nlohmann::ordered_json OverlapsJson(const std::vector<OverlapDiagnostic>& overlaps, const Dataset& dataset);

/// A job with a solution, read from the database.
struct PageJob {
  std::size_t experiment = 0;  ///< index in the experiments of the page
  std::int64_t job_id = 0;
  std::int64_t method_id = 0;
  Task task{};
  int problem = 0;
  bool solved = false;  ///< according to the page's rule
  std::optional<int> failed_waypoint;
};

/// The waypoints of a job to be displayed.
struct PageMotion {
  std::vector<Eigen::VectorXd> waypoints;  ///< the solution; only the solved windows if a window of the motion is
                                           ///< unsolved
  /// First waypoint of the best point of the unsolved window; from there on, waypoints have no time stamps, even for
  /// tasks whose solutions have them.
  std::optional<int> unsolved_from;
};

/// Reads the waypoints of a job. Throws the errors of ReadWaypointsOf.
PageMotion ReadPageMotion(ResultSource& source, const PageJob& job);

/// Returns the kept jobs of an experiment that have waypoints or a trace, in the order in which a page of limited size
/// includes them: failed postures, failed motions, other postures, other motions of the first two methods, the rest.
std::vector<PageJob> JobsWithSolutions(ResultSource& source, std::int64_t experiment_id, Rule rule,
                                       const ResultFilter& filter = {});

/// Level of detail of a motion's findings.
enum class FindingDepth : std::uint8_t {
  kNone,       ///< no findings, for solved motions in a report
  kWaypoints,  ///< findings at each waypoint
  kBetween     ///< findings at waypoints and, if the judge scores it, between them
};

/// Solutions that a page loads together, with the judge's findings.
class SolutionChunk {
 public:
  /// Adds a job. Waypoints of the wrong size are omitted and reported in "malformed".
  void Add(const PageJob& job, const PageMotion& motion, nlohmann::ordered_json trace, WaypointInspector* lister,
           FindingDepth depth);
  bool empty() const { return solutions_.empty(); }
  std::size_t weight() const { return bytes_.size() + text_bytes_; }  ///< approximate size in bytes before compression
  const std::string& bytes() const { return bytes_; }                 ///< waypoints of all jobs
  const nlohmann::ordered_json& json() const { return solutions_; }   ///< "solutions" of docs/reference/page-data.md

 private:
  nlohmann::ordered_json solutions_ = nlohmann::ordered_json::array();
  std::string bytes_;
  std::size_t text_bytes_ = 0;
};

/// Returns the convergence of a solve, thinned to at most kMaxShown steps, with the columns of
/// docs/reference/database.md; null if not recorded.
nlohmann::ordered_json TraceJson(ResultSource& source, std::int64_t job_id);
inline constexpr std::size_t kMaxShown = 200;  ///< number of steps of a convergence curve

}  // namespace legopt::client
