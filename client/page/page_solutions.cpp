#include "client/page/page_solutions.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "client/page/page_file.h"
#include "client/page/page_holding.h"
#include "client/replay/stored_job.h"
#include "db/named_queries.h"
#include "legopt/input/json.h"
#include "legopt/judge/internal/path_examiner.h"
#include "legopt/planning/internal/trace.h"
#include "legopt/robot/robot_model.h"

namespace legopt::client {
namespace {

using Json = nlohmann::ordered_json;

// A ten-millionth of a metre is smaller than anything displayed.
Json RoundedJson(double value) {
  constexpr double kRounding = 1e-7;
  return std::isfinite(value) ? Json(std::round(value / kRounding) * kRounding) : Json();
}

template <class Vector>
Json VectorJson(const Vector& vector) {
  Json json = Json::array();
  for (const double value : vector) json.push_back(RoundedJson(value));
  return json;
}

Json FootJson(const FootDiagnostic& foot) {
  constexpr const char* kComponents[] = {"rotation x",    "rotation y",    "rotation z",
                                         "translation x", "translation y", "translation z"};
  return {{"link", foot.link},
          {"error", RoundedJson(foot.violation)},
          {"component", kComponents[foot.component]},
          {"violated", foot.violated}};
}

Json LimitJson(const LimitDiagnostic& limit, const RobotModel& robot) {
  const Joint& joint = robot.joints()[static_cast<std::size_t>(robot.dof_joint(limit.dof))];
  return {{"joint", joint.name},
          {"unit", UnitOf(joint.type)},
          {"link", joint.child_link},
          {"value", RoundedJson(limit.value)},
          {"limit", RoundedJson(limit.limit)},
          {"excess", RoundedJson(limit.excess)},
          {"violated", limit.violated}};
}

Json ValueJson(const CheckDiagnostic& finding) {
  const CheckDescription& check = DescriptionOf(finding.value.check);
  return {{"check", check.name}, {"subject", finding.value.subject},  {"value", RoundedJson(finding.value.value)},
          {"unit", check.unit},  {"tolerance", ToleranceText(check)}, {"violated", finding.violated}};
}

}  // namespace

Json OverlapsJson(const std::vector<OverlapDiagnostic>& overlaps, const Dataset& dataset) {
  Json list = Json::array();
  for (const OverlapDiagnostic& finding : overlaps) {
    const ExactCollision::Overlap& overlap = finding.overlap;
    Json json = {{"link", overlap.link}};
    if (overlap.other_link >= 0) {
      json["other"] = overlap.other_link;
    } else {
      json["object"] = overlap.object;
    }
    json["names"] = {dataset.robot().links()[static_cast<std::size_t>(overlap.link)].name,
                     overlap.other_link >= 0
                         ? dataset.robot().links()[static_cast<std::size_t>(overlap.other_link)].name
                         : dataset.scene().objects[static_cast<std::size_t>(overlap.object)].name};
    json["depth_m"] = overlap.depth_m < 0.0 ? Json() : RoundedJson(overlap.depth_m);
    json["literal_m"] = overlap.literal_m < 0.0 ? Json() : RoundedJson(overlap.literal_m);
    json["inside_m"] = RoundedJson(overlap.inside_m);
    json["fails"] = finding.fails ? Json(ToString(*finding.fails)) : Json();
    if (overlap.point_W.allFinite()) json["points"] = {VectorJson(overlap.point_W), VectorJson(overlap.other_point_W)};
    list.push_back(std::move(json));
  }
  return list;
}

Json FindingsJson(const WaypointDiagnostics& findings, const Dataset& dataset) {
  Json feet = Json::array(), limits = Json::array(), polygon = Json::array(), values = Json::array();
  for (const CheckDiagnostic& value : findings.values) values.push_back(ValueJson(value));
  for (const FootDiagnostic& foot : findings.feet) feet.push_back(FootJson(foot));
  for (const LimitDiagnostic& limit : findings.limits) limits.push_back(LimitJson(limit, dataset.robot()));
  for (const Eigen::Vector2d& corner : findings.polygon_W) polygon.push_back(VectorJson(corner));
  return {{"feet", feet},
          {"com", VectorJson(findings.com_W)},
          {"polygon", polygon},
          {"com_m", RoundedJson(findings.com_m)},
          {"com_violated", findings.com_violated},
          {"limits", limits},
          {"overlaps", OverlapsJson(findings.overlaps, dataset)},
          {"values", values},
          {"holding", HoldingJson(findings.holding, findings.on_feet)}};
}

namespace {

// Rounds to seven digits, more than a curve shows.
double Short(double value) {
  constexpr int kDigits = 7;
  if (value == 0.0 || !std::isfinite(value)) return value;
  const double unit = std::pow(10.0, std::floor(std::log10(std::abs(value))) - kDigits + 1);
  return std::round(value / unit) * unit;
}

int Turn(const PageJob& job, std::int64_t first_method, std::int64_t second_method) {
  const bool small = !DescriptionOf(job.task).windowed;
  if (!job.solved) return small ? 0 : 1;
  if (small) return 2;
  return job.method_id == first_method || job.method_id == second_method ? 3 : 4;
}

Json FindingsOf(const PageJob& job, const std::vector<Eigen::VectorXd>& waypoints, WaypointInspector* lister) {
  const ProblemDefinition& problem = lister->dataset().problem(job.task, job.problem);
  Json list = Json::array();
  for (std::size_t w = 0; w < waypoints.size(); ++w) {
    const auto stance = static_cast<std::size_t>(StanceOfWaypoint(job.task, static_cast<int>(w)));
    if (stance >= problem.stances.size()) break;
    const Eigen::VectorXd* before = w > 0 ? &waypoints[w - 1] : nullptr;
    list.push_back(FindingsJson(lister->At(problem.stances[stance], waypoints[w], before), lister->dataset()));
  }
  return list;
}

// Returns the judge's findings between waypoints: only samples with overlaps, as [waypoint, s, overlaps].
Json BetweenOf(const std::vector<Eigen::VectorXd>& waypoints, WaypointInspector* lister) {
  Json list = Json::array();
  for (std::size_t w = 1; w < waypoints.size(); ++w) {
    for (int k = 1; k <= kInterpolationSteps; ++k) {
      const double s = static_cast<double>(k) / (kInterpolationSteps + 1);
      const auto overlaps = lister->TransitionRule(waypoints[w - 1], waypoints[w], s);
      if (!overlaps.empty()) list.push_back({w - 1, s, OverlapsJson(overlaps, lister->dataset())});
    }
  }
  return list;
}

}  // namespace

std::vector<PageJob> JobsWithSolutions(ResultSource& source, std::int64_t experiment_id, Rule rule,
                                       const ResultFilter& filter) {
  const KeptCells kept(source, experiment_id, filter);
  const Listing rows = source.Query(
      db::Sql(db::Query::kPageSolutions, {{"experiment_id", experiment_id}, {"rule", rule}, {"cell_ids", kept.ids()}}));
  std::vector<PageJob> jobs;
  std::int64_t first = -1, second = -1;
  for (std::size_t i = 0; i < rows.rows.size(); ++i) {
    PageJob& job = jobs.emplace_back();
    job.job_id = rows.At(i, "job_id").get<std::int64_t>();
    job.method_id = rows.At(i, "method_id").get<std::int64_t>();
    job.task = rows.EnumAt<Task>(i, "task");
    job.problem = rows.At(i, "problem_id").get<int>();
    job.solved = rows.At(i, "solved").is_number() && rows.At(i, "solved").get<int>() == 1;
    if (!rows.At(i, "failed_waypoint").is_null()) job.failed_waypoint = rows.At(i, "failed_waypoint").get<int>();
    if (first < 0) first = job.method_id;
    if (second < 0 && job.method_id != first) second = job.method_id;
  }
  std::ranges::stable_sort(jobs, {}, [&](const PageJob& job) { return Turn(job, first, second); });
  return jobs;
}

Json TraceJson(ResultSource& source, std::int64_t job_id) {
  const Listing row = source.Query(db::Sql(db::Query::kTraceOfResult, {{"job_id", job_id}}));
  if (row.rows.empty()) return {};
  const auto all = TraceRecords(row, job_id);
  if (all.empty()) return {};
  const auto records = CondenseTrace(all, kMaxShown);
  Json window = Json::array(), restart = Json::array(), accepted = Json::array(), evaluations = Json::array();
  Json elapsed = Json::array(), cost = Json::array(), violation = Json::array();
  for (const IterationRecord& record : records) {
    window.push_back(record.window);
    restart.push_back(record.restart);
    accepted.push_back(record.accepted ? 1 : 0);
    evaluations.push_back(record.evaluations);
    elapsed.push_back(record.elapsed_us);
    cost.push_back(Short(record.cost));
    violation.push_back(Short(record.violation));
  }
  return {{"of", all.size()},           {"window", window},      {"restart", restart}, {"accepted", accepted},
          {"evaluations", evaluations}, {"elapsed_us", elapsed}, {"cost", cost},       {"violation", violation}};
}

PageMotion ReadPageMotion(ResultSource& source, const PageJob& job) {
  PageMotion motion{ReadWaypointsOf(source, job.job_id), {}};
  if (!DescriptionOf(job.task).windowed) return motion;
  const UnsolvedWaypoints unsolved = ReadUnsolvedOf(source, job.job_id);
  if (unsolved.waypoints.empty()) return motion;
  motion.unsolved_from = unsolved.first_waypoint;
  // The window begins within the last stance of the previous window.
  motion.waypoints.resize(std::min(motion.waypoints.size(), static_cast<std::size_t>(unsolved.first_waypoint)));
  const Eigen::Index size = unsolved.waypoints.front().size();
  for (Eigen::VectorXd& x : motion.waypoints) x = x.head(std::min(size, x.size())).eval();
  motion.waypoints.insert(motion.waypoints.end(), unsolved.waypoints.begin(), unsolved.waypoints.end());
  return motion;
}

void SolutionChunk::Add(const PageJob& job, const PageMotion& motion, Json trace, WaypointInspector* lister,
                        FindingDepth depth) {
  const std::vector<Eigen::VectorXd>& waypoints = motion.waypoints;
  const Eigen::Index size = lister->dataset().robot().configuration_size();
  const bool stamped = HasTimeStamps(job.task) && !motion.unsolved_from;
  const Eigen::Index stamps = stamped ? 1 : 0;
  const bool whole = std::ranges::all_of(waypoints, [&](const auto& x) { return x.size() == size + stamps; });
  std::vector<Eigen::VectorXd> shown;
  Json times = Json::array();
  for (const Eigen::VectorXd& x : whole ? waypoints : shown) {
    shown.emplace_back(x.head(size));
    if (stamped) times.push_back(x[size]);
  }
  if (stamped) depth = FindingDepth::kNone;  // the judge's findings on a path are in its detail text
  std::string packed = PackWaypoints(shown);
  const bool exact = packed.empty();
  if (exact) packed = PackExactly(shown);
  Json json = {{"experiment", job.experiment},      {"job", job.job_id},       {"waypoints", shown.size()},
               {"encoding", exact ? "f64" : "d32"}, {"offset", bytes_.size()}, {"bytes", packed.size()}};
  if (!whole) json["malformed"] = true;
  if (stamped) json["times"] = std::move(times);
  if (motion.unsolved_from) {
    json["unsolved"] = {{"from", *motion.unsolved_from},
                        {"waypoints_per_stance", DescriptionOf(job.task).waypoints_per_stance}};
  }
  if (job.failed_waypoint) json["failed_waypoint"] = *job.failed_waypoint;
  if (depth != FindingDepth::kNone) json["findings"] = FindingsOf(job, shown, lister);
  if (depth == FindingDepth::kBetween && DescriptionOf(job.task).between == TransitionRule::kScored) {
    json["between"] = BetweenOf(shown, lister);
  }
  json["trace"] = std::move(trace);
  text_bytes_ += Dump(json).size();
  bytes_ += packed;
  solutions_.push_back(std::move(json));
}

}  // namespace legopt::client
