#include "legopt/judge/internal/path_examiner.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "legopt/judge/internal/checks.h"
#include "legopt/judge/internal/diagnostic.h"
#include "legopt/robot/configuration.h"
#include "legopt/types/task.h"

namespace legopt {
namespace {

std::string PointAt(std::size_t i, double time) {
  return "point " + std::to_string(i) + " (time " + NumberText(time) + ")";
}

PathDiagnostic MakeTimeStampDiagnostic(int waypoint, const std::string& detail) {
  return {Verdict::kWrongSize, waypoint, detail};
}

/// Checks sizes and numbers of time stamps; the judge checks the configurations.
std::optional<PathDiagnostic> CheckPathNumbers(std::span<const Eigen::VectorXd> points, int configuration_size) {
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (points[i].size() != configuration_size + 1) {
      return PathDiagnostic{Verdict::kWrongSize, -1,
                            "point " + std::to_string(i) + " has " + std::to_string(points[i].size()) +
                                " numbers instead of " + std::to_string(configuration_size + 1) +
                                ", a configuration and its time stamp"};
    }
    if (!std::isfinite(points[i][configuration_size])) {
      return PathDiagnostic{Verdict::kNotFinite, -1, "the time stamp of point " + std::to_string(i) + " is not finite"};
    }
  }
  return std::nullopt;
}

/// Checks the time stamp of point i; `before` is that of the previous point.
std::optional<PathDiagnostic> CheckTimeStamp(std::size_t i, double time, double before, int pieces) {
  const int waypoint = static_cast<int>(std::floor(before));
  if (!(time > before)) {
    return MakeTimeStampDiagnostic(
        waypoint, PointAt(i, time) + " is not later than the point before it, at " + NumberText(before));
  }
  const double next = waypoint + 1.0;
  if (time > next) {
    return MakeTimeStampDiagnostic(waypoint, "no point at waypoint " + std::to_string(waypoint + 1) + ": " +
                                                 PointAt(i, time) + " follows that at " + NumberText(before));
  }
  if (pieces > kMaxPieces) {
    return MakeTimeStampDiagnostic(waypoint, "more than " + std::to_string(kMaxPieces) + " pieces from waypoint " +
                                                 std::to_string(waypoint) + " to the next: " + PointAt(i, time));
  }
  return std::nullopt;
}

}  // namespace

std::optional<PathDiagnostic> ParsePath(std::span<const Eigen::VectorXd> points, int num_waypoints,
                                        int configuration_size, TimedPath* path) {
  *path = {};
  if (auto fault = CheckPathNumbers(points, configuration_size)) return fault;
  int pieces = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const double time = points[i][configuration_size];
    if (i == 0 && time != 0.0) return MakeTimeStampDiagnostic(0, PointAt(0, time) + " is the first and not at time 0");
    ++pieces;
    if (i > 0) {
      if (auto fault = CheckTimeStamp(i, time, path->times.back(), pieces)) return fault;
    }
    if (time == std::floor(time)) {
      path->waypoints.push_back(i);
      pieces = 0;
    }
    path->points.emplace_back(points[i].head(configuration_size));
    path->times.push_back(time);
  }
  if (!points.empty() && path->waypoints.back() + 1 != points.size()) {
    return MakeTimeStampDiagnostic(static_cast<int>(path->waypoints.size()) - 1,
                                   PointAt(points.size() - 1, path->times.back()) + " is the last and no waypoint");
  }
  if (std::ssize(path->waypoints) != num_waypoints) {
    return PathDiagnostic{
        Verdict::kWrongWaypointCount, -1,
        std::to_string(path->waypoints.size()) + " waypoints instead of " + std::to_string(num_waypoints)};
  }
  return std::nullopt;
}

TimedPath MakePath(std::span<const Eigen::VectorXd> waypoints, std::span<const std::vector<Eigen::VectorXd>> ways) {
  TimedPath path;
  const auto keep = [&path](const Eigen::VectorXd& point, double time) {
    path.points.push_back(point);
    path.times.push_back(time);
  };
  for (std::size_t w = 0; w < waypoints.size(); ++w) {
    const auto time = static_cast<double>(w);
    path.waypoints.push_back(path.points.size());
    keep(waypoints[w], time);
    if (w == ways.size()) break;
    const double pieces = static_cast<double>(ways[w].size()) + 1.0;
    for (std::size_t k = 0; k < ways[w].size(); ++k) keep(ways[w][k], time + static_cast<double>(k + 1) / pieces);
  }
  return path;
}

std::vector<Eigen::VectorXd> FormatPath(const TimedPath& path) {
  std::vector<Eigen::VectorXd> points;
  for (std::size_t i = 0; i < path.points.size(); ++i) {
    Eigen::VectorXd& point = points.emplace_back(path.points[i].size() + 1);
    point << path.points[i], path.times[i];
  }
  return points;
}

namespace {

// Beyond this, poses may overflow in kinematics; solver results are far below it.
constexpr double kLargestNumber = 1e6;

bool IsUsable(const RobotModel& robot, const Eigen::VectorXd& x) {
  return x.size() == robot.configuration_size() && x.allFinite() && x.cwiseAbs().maxCoeff() <= kLargestNumber &&
         PartsOf(x).quaternion_coefficients().stableNorm() > 0;
}

}  // namespace

Eigen::VectorXd ClampedConfiguration(const RobotModel& robot, const Eigen::VectorXd& waypoint) {
  Eigen::VectorXd x = waypoint;
  robot.ClampJoints(x);
  MutablePartsOf(x).quaternion_coefficients() = PartsOf(waypoint).quaternion_coefficients().stableNormalized();
  return x;
}

InterpolationScore ScoreInterpolation(std::span<const Eigen::VectorXd> waypoints, Kinematics& kinematics,
                                      ExactCollision& collision) {
  const RobotModel& robot = kinematics.model();
  const bool usable =
      std::all_of(waypoints.begin(), waypoints.end(), [&](const auto& x) { return IsUsable(robot, x); });
  if (waypoints.size() < 2 || !usable) return {};
  InterpolationScore score{.environment_depth_m = 0, .self_depth_m = 0, .free_share = 0};
  Eigen::VectorXd x(robot.configuration_size());
  Eigen::VectorXd from = ClampedConfiguration(robot, waypoints[0]);
  int free = 0;
  for (size_t w = 1; w < waypoints.size(); ++w) {
    const Eigen::VectorXd to = ClampedConfiguration(robot, waypoints[w]);
    double deepest = 0;
    for (int k = 1; k <= kInterpolationSteps; ++k) {
      InterpolateConfiguration(from, to, static_cast<double>(k) / (kInterpolationSteps + 1), x);
      kinematics.Update(x);
      const double environment = collision.EnvironmentDepth(kinematics);
      const double self = collision.SelfDepth(kinematics).strict_m;
      score.environment_depth_m = std::max(score.environment_depth_m, environment);
      score.self_depth_m = std::max(score.self_depth_m, self);
      deepest = std::max({deepest, environment, self});
    }
    if (deepest <= kFreeDepth_m) ++free;
    from = to;
  }
  score.free_share = static_cast<double>(free) / static_cast<double>(waypoints.size() - 1);
  return score;
}

/// Largest part of a piece of a spline between consecutive samples.
constexpr double kLongestCurve = 0.25;

/// Segment between two consecutive waypoints.
struct PathExaminer::Segment {
  int waypoint = 0;  ///< index of the first of the two
  bool balanced = false;
  Stance planted;
};

PathExaminer::PathExaminer(const Dataset& dataset, ExactCollision& collision)
    : dataset_(&dataset), collision_(&collision), holding_(dataset), x_(dataset.robot().configuration_size()) {}

PathExamination PathExaminer::Examine(Task task, const ProblemDefinition& problem, const TimedPath& path) {
  PathExamination findings;
  findings.score = {.environment_depth_m = 0.0, .self_depth_m = 0.0, .free_share = 0.0};
  spline_.reset();
  if (HasTimeLaw(task)) spline_.emplace(path.times, path.points);
  int free = 0;
  const int ways = static_cast<int>(path.waypoints.size()) - 1;
  for (int w = 0; w < ways; ++w) {
    const auto stance = [&](int waypoint) -> const Stance& {
      return problem.stances[static_cast<std::size_t>(StanceOfWaypoint(task, waypoint))];
    };
    ExamineSegment(
        {.waypoint = w, .balanced = IsBalanced(task), .planted = PlantedContacts(*dataset_, stance(w), stance(w + 1))},
        path, &findings);
    if (!segment_failed_) ++free;
  }
  findings.score.free_share = static_cast<double>(free) / ways;
  return findings;
}

void PathExaminer::ExamineSegment(const Segment& segment, const TimedPath& path, PathExamination* findings) {
  segment_failed_ = false;
  const std::size_t first = path.waypoints[static_cast<std::size_t>(segment.waypoint)];
  const std::size_t last = path.waypoints[static_cast<std::size_t>(segment.waypoint) + 1];
  for (std::size_t i = first; i < last; ++i) {
    from_ = ClampedConfiguration(dataset_->robot(), path.points[i]);
    to_ = ClampedConfiguration(dataset_->robot(), path.points[i + 1]);
    t_from_ = path.times[i];
    t_to_ = path.times[i + 1];
    turn_ = LargestTurn();
    ExaminePiece(segment, findings);
  }
}

void PathExaminer::ExaminePiece(const Segment& segment, PathExamination* findings) {
  Kinematics& at_from = Level(0);
  Kinematics& at_to = Level(1);
  at_from.Update(from_);
  at_to.Update(to_);
  const double length_m = collision_->LongestStep(at_from, at_to).distance_m;
  if (Exceeds(length_m, kLongestPiece_m) || Exceeds(turn_, kLargestPieceTurn)) {
    Fail(segment, 0.0, Verdict::kWrongSize,
         "a piece of " + LengthText(length_m) + " and " + NumberText(turn_) + " rad (at most " +
             LengthText(kLongestPiece_m) + " and " + NumberText(kLargestPieceTurn) + " rad)",
         findings);
    return;
  }
  ExamineSample(segment, 0.0, at_from, findings);
  Bisect(segment, 2, 0.0, at_from, 1.0, at_to, findings);
  ExamineSample(segment, 1.0, at_to, findings);
}

double PathExaminer::LargestTurn() const {
  const auto from = PartsOf(from_), to = PartsOf(to_);
  const double joints = from.num_joints() == 0 ? 0.0 : (to.joints() - from.joints()).cwiseAbs().maxCoeff();
  const double half = std::min(1.0, std::abs(from.quaternion_coefficients().dot(to.quaternion_coefficients())));
  return std::max(joints, 2.0 * std::acos(half));
}

Kinematics& PathExaminer::Level(std::size_t level) {
  while (levels_.size() <= level) levels_.emplace_back(dataset_->robot());
  return levels_[level];
}

void PathExaminer::Place(double s, Kinematics* kinematics) {
  if (spline_) {
    spline_->Evaluate(TimeAt(s), &point_);
    x_ = ClampedConfiguration(dataset_->robot(), point_.x);
  } else {
    InterpolateConfiguration(from_, to_, s, x_);
  }
  kinematics->Update(x_);
}

/// Checks the joint limits between points, which a spline may exceed although its points do not.
void PathExaminer::CheckCurveLimits(const Segment& segment, double s, PathExamination* findings) {
  spline_->Evaluate(TimeAt(s), &point_);
  const RobotModel& robot = dataset_->robot();
  for (int i = 0; i < robot.num_dofs(); ++i) {
    const double lower = robot.lower_limits()[i], upper = robot.upper_limits()[i], value = point_.x[i];
    const double beyond = std::max({0.0, lower - value, value - upper});
    const auto name = [&] { return DofNames(robot)[static_cast<std::size_t>(i)]; };
    IncludeViolation(Verdict::kJointLimit, Rule::kLiteral, segment.waypoint, beyond, name, &findings->violations);
    if (!Exceeds(beyond, kLimitTolerance)) continue;
    Fail(segment, s, Verdict::kJointLimit,
         name() + " is " + NumberText(beyond) + " beyond its limit (tolerance " + NumberText(kLimitTolerance) + ")",
         findings);
  }
}

/// Samples a piece recursively, in the order of time.
void PathExaminer::Bisect(const Segment& segment, std::size_t level, double s_from, const Kinematics& at_from,
                          double s_to, const Kinematics& at_to, PathExamination* findings) {
  const bool near =
      collision_->LongestStep(at_from, at_to).distance_m <= kPathSample_m && turn_ * (s_to - s_from) <= kPathSampleTurn;
  // A spline may leave a point and come back to it.
  const bool may_return = spline_ && s_to - s_from > kLongestCurve;
  if (near && !may_return) return;
  const double s = 0.5 * (s_from + s_to);
  Kinematics& middle = Level(level);
  Place(s, &middle);
  Bisect(segment, level + 1, s_from, at_from, s, middle, findings);
  ExamineSample(segment, s, middle, findings);
  Bisect(segment, level + 1, s, middle, s_to, at_to, findings);
}

void PathExaminer::Fail(const Segment& segment, double s, Verdict verdict, const std::string& detail,
                        PathExamination* findings) {
  segment_failed_ = true;
  if (findings->verdict != Verdict::kSuccess) return;
  findings->verdict = verdict;
  findings->waypoint = segment.waypoint;
  findings->detail = "on the segment to the next waypoint, at time " + NumberText(TimeAt(s)) + ": " + detail;
}

void PathExaminer::ExamineSample(const Segment& segment, double s, const Kinematics& kinematics,
                                 PathExamination* findings) {
  const auto include = [&](Verdict check, double value, const std::string& subject) {
    IncludeViolation(
        check, Rule::kLiteral, segment.waypoint, value, [&] { return subject; }, &findings->violations);
  };
  if (spline_) CheckCurveLimits(segment, s, findings);
  const std::vector<ContactPlacement> placements = ActualPlacements(*dataset_, segment.planted, kinematics);
  for (std::size_t i = 0; i < placements.size(); ++i) {
    const ContactTarget& target = segment.planted.contacts[i];
    const ContactPoseError error = ComputeContactPoseError(*placements[i].contact, target, placements[i].X_WL);
    include(Verdict::kFootPose, error.violation, target.contact);
    if (!Exceeds(error.violation, kPlantedTolerance)) continue;
    Fail(segment, s, Verdict::kFootPose, "planted " + PoseErrorText(target.contact, error, kPlantedTolerance),
         findings);
  }
  if (segment.balanced) {
    const bool on_feet = StandsOnFeet(*dataset_, segment.planted);
    const Verdict check = on_feet ? Verdict::kCom : Verdict::kEquilibrium;
    const double distance =
        on_feet ? ComDistance(placements, kinematics) : holding_.SignedDistance(segment.planted, kinematics);
    include(check, std::max(0.0, distance), "centre of mass");
    if (Exceeds(distance, kPathComTolerance_m)) {
      Fail(segment, s, check,
           on_feet ? ComErrorText(distance, kPathComTolerance_m) : EquilibriumText(distance, holding_.slide()),
           findings);
    }
  }
  const ExactCollision::SceneContact contact = collision_->DeepestEnvironmentContacts(kinematics).strict;
  findings->score.environment_depth_m = std::max(findings->score.environment_depth_m, contact.depth_m);
  const auto link_name = [&](int link) { return dataset_->robot().links()[static_cast<std::size_t>(link)].name; };
  if (Exceeds(contact.depth_m, kPathDepthTolerance_m)) {
    Fail(segment, s, Verdict::kEnvironmentCollision,
         link_name(contact.link) + " is " + LengthText(contact.depth_m) + " deep in '" +
             dataset_->scene().objects[static_cast<std::size_t>(contact.object)].name + "' of the scene",
         findings);
  }
  const ExactCollision::SelfDepths self = collision_->SelfDepth(kinematics);
  findings->score.self_depth_m = std::max(findings->score.self_depth_m, self.strict_m);
  if (Exceeds(self.strict_m, kPathDepthTolerance_m)) {
    Fail(segment, s, Verdict::kSelfCollision,
         link_name(self.strict_pair.first) + " and " + link_name(self.strict_pair.second) + " overlap by " +
             LengthText(self.strict_m),
         findings);
  }
}

}  // namespace legopt
