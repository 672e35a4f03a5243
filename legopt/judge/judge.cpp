#include "legopt/judge/judge.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "legopt/dataset/support_polygon.h"
#include "legopt/geometry/exact_collision.h"
#include "legopt/judge/contact_pose_error.h"
#include "legopt/judge/diagnostic_text.h"
#include "legopt/judge/path_examiner.h"
#include "legopt/judge/timed_path.h"
#include "legopt/robot/configuration.h"
#include "legopt/robot/dof_names.h"
#include "legopt/robot/kinematics.h"
#include "legopt/types/input_error.h"

namespace legopt {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// Member of Evaluation for each rule's verdict.
constexpr std::array<std::pair<Rule, Verdict Evaluation::*>, kNumEnumerators<Rule>> kVerdicts = {
    {{Rule::kLiteral, &Evaluation::literal}, {Rule::kStrict, &Evaluation::strict}, {Rule::kSolid, &Evaluation::solid}}};

/// Updates a maximum that starts as NaN ("never evaluated"); a NaN value counts as infinite.
void Include(double value, double* largest) {
  if (std::isnan(value)) value = kInfinity;
  if (std::isnan(*largest) || value > *largest) *largest = value;
}

/// Appends the number of ODE failures; for a success this is the only detail.
void AppendOdeFailures(std::int64_t failures, std::string* detail) {
  if (failures == 0) return;
  *detail += (detail->empty() ? "" : "; ") + std::string("ODE failed an assertion in ") + std::to_string(failures) +
             (failures == 1 ? " mesh query" : " mesh queries") + ", answered by the exact triangle test";
}

}  // namespace

Verdict Evaluation::by(Rule rule) const { return this->*kVerdicts.at(EnumNumber(rule)).second; }

Verdict Evaluation::first_failure() const {
  for (const auto& [rule, verdict] : kVerdicts) {
    if (this->*verdict != Verdict::kSuccess) return this->*verdict;
  }
  return Verdict::kSuccess;
}

class Judge::Workspace {
 public:
  Workspace(std::shared_ptr<const Dataset> dataset, Culling culling)
      : dataset_(std::move(dataset)),
        robot_(dataset_->robot()),
        kinematics_(robot_),
        previous_(robot_),
        collision_(robot_, dataset_->scene(), dataset_->collision_model(), culling),
        examiner_(*dataset_, collision_),
        step_limit_m_(kStepShare * dataset_->robot_bounds().diagonal().norm()),
        clamped_(robot_.configuration_size()),
        torques_(robot_.num_dofs()) {}

  const Dataset& dataset() const { return *dataset_; }

  Evaluation Evaluate(Task task, const ProblemDefinition& problem, std::span<const Eigen::VectorXd> waypoints);
  Evaluation EvaluatePart(Task task, const ProblemDefinition& problem, int first_stance,
                          std::span<const Eigen::VectorXd> waypoints);

 private:
  Evaluation Judged(Task task, const ProblemDefinition& problem, std::span<const Eigen::VectorXd> waypoints);
  Evaluation JudgedPath(Task task, const ProblemDefinition& problem, std::span<const Eigen::VectorXd> points);
  static void CheckTask(Task task, const ProblemDefinition& problem);
  void CheckContactNames(const ProblemDefinition& problem) const;
  void Fail(Verdict verdict, int waypoint, const std::string& detail, Evaluation* evaluation) const;
  void FailBy(Rule rule, Verdict verdict, int waypoint, const std::string& detail, Evaluation* evaluation) const;
  bool IsWellFormed(const Eigen::VectorXd& x, int waypoint, Evaluation* evaluation) const;
  void SetState(const Eigen::VectorXd& x);
  void CheckContacts(const Stance& stance, int waypoint, Evaluation* evaluation);
  void CheckCom(int waypoint, Evaluation* evaluation);
  void CheckLimits(const Eigen::VectorXd& x, int waypoint, Evaluation* evaluation) const;
  void CheckEnvironment(int waypoint, Evaluation* evaluation);
  void CheckSelf(int waypoint, Evaluation* evaluation);
  void CheckIgnoredPairs(int waypoint, Evaluation* evaluation);
  void CheckContainment(int waypoint, Evaluation* evaluation);
  void CheckStep(int waypoint, Evaluation* evaluation);
  double Cost(Task task, std::span<const Eigen::VectorXd> waypoints);
  double Torques(std::span<const Eigen::VectorXd> waypoints);
  double JointSteps(std::span<const Eigen::VectorXd> waypoints) const;
  double PathCost(const TimedPath& path) const;
  const std::string& LinkName(int link) const { return robot_.links()[static_cast<size_t>(link)].name; }
  std::string ObjectName(int object) const {
    return "'" + dataset_->scene().objects[static_cast<size_t>(object)].name + "' of the scene";
  }
  std::string DescribeContact(const ExactCollision::SceneContact& contact) const;
  std::string DescribeOverlap(const LinkPair& pair, double depth_m) const;
  std::string DescribeContainment(const ExactCollision::Containment& containment) const;

  std::shared_ptr<const Dataset> dataset_;
  const RobotModel& robot_;
  Kinematics kinematics_;
  Kinematics previous_;  ///< state at the previous waypoint
  ExactCollision collision_;
  PathExaminer examiner_;  ///< used by tasks with continuous paths
  double step_limit_m_;
  Eigen::VectorXd clamped_;
  Eigen::VectorXd torques_;
  std::vector<ContactPlacement> placements_;  ///< contacts of the current waypoint
  int first_waypoint_ = 0;                    ///< number, in the whole motion, of the first judged waypoint
};

void Judge::Workspace::CheckTask(Task task, const ProblemDefinition& problem) {
  if (Fits(task, problem)) return;
  throw InputError({.file = "",
                    .field = "problem " + std::to_string(problem.id),
                    .value = std::to_string(problem.stances.size()) + " stances",
                    .message = "does not fit the task '" + std::string(ToString(task)) + "'",
                    .fix = DescribeStanceCounts()});
}

/// Checks the names of contacts. Errors refer to the problem, not to the dataset that reports them.
void Judge::Workspace::CheckContactNames(const ProblemDefinition& problem) const {
  for (size_t s = 0; s < problem.stances.size(); ++s) {
    for (const ContactTarget& target : problem.stances[s].contacts) {
      try {
        dataset_->contact(target.contact);
      } catch (const InputError& error) {
        InputError::Fault fault = error.fault();
        fault.file = "";
        fault.field = "problem " + std::to_string(problem.id) + ", definition, stance " + std::to_string(s);
        throw InputError(std::move(fault));
      }
    }
  }
}

/// Records a failure by all rules, unless there is an earlier one.
void Judge::Workspace::Fail(Verdict verdict, int waypoint, const std::string& detail, Evaluation* evaluation) const {
  FailBy(Rule::kLiteral, verdict, waypoint, detail, evaluation);
}

/// Records a failure by this rule and all stricter ones. Its detail is kept unless a later waypoint fails by a more
/// lenient rule.
void Judge::Workspace::FailBy(Rule rule, Verdict verdict, int waypoint, const std::string& detail,
                              Evaluation* evaluation) const {
  const bool first = evaluation->by(rule) == Verdict::kSuccess;
  for (const auto& [which, own] : kVerdicts) {
    if (which >= rule && evaluation->*own == Verdict::kSuccess) evaluation->*own = verdict;
  }
  if (!first) return;
  evaluation->failed_waypoint = waypoint < 0 ? waypoint : first_waypoint_ + waypoint;
  evaluation->detail = (waypoint >= 0 ? "waypoint " + std::to_string(evaluation->failed_waypoint) + ": " : "") +
                       (rule == Rule::kLiteral ? "" : "by the " + std::string(ToString(rule)) + " rule, ") + detail;
}

bool Judge::Workspace::IsWellFormed(const Eigen::VectorXd& x, int waypoint, Evaluation* evaluation) const {
  if (x.size() != robot_.configuration_size()) {
    Fail(Verdict::kWrongSize, waypoint,
         std::to_string(x.size()) + " numbers instead of " + std::to_string(robot_.configuration_size()), evaluation);
    return false;
  }
  if (!x.allFinite()) {
    Eigen::Index bad = 0;
    while (std::isfinite(x[bad])) ++bad;
    Fail(Verdict::kNotFinite, waypoint, "number " + std::to_string(bad) + " is " + NumberText(x[bad]), evaluation);
    return false;
  }
  const double norm = PartsOf(x).quaternion_coefficients().stableNorm();
  if (!(norm > 0)) {
    Fail(Verdict::kNotFinite, waypoint, "the base quaternion has norm 0 and no direction", evaluation);
    return false;
  }
  return true;
}

void Judge::Workspace::SetState(const Eigen::VectorXd& x) {
  clamped_ = ClampedConfiguration(robot_, x);
  kinematics_.Update(clamped_);
}

void Judge::Workspace::CheckContacts(const Stance& stance, int waypoint, Evaluation* evaluation) {
  placements_.clear();
  for (const ContactTarget& target : stance.contacts) {
    const Contact& contact = dataset_->contact(target.contact);
    const Eigen::Isometry3d& actual = kinematics_.link_pose(contact.link_index);
    placements_.push_back({.contact = &contact, .X_WL = actual});
    const ContactPoseError error = ComputeContactPoseError(contact.LinkTarget(target), actual);
    Include(error.violation, &evaluation->foot_violation);
    if (Exceeds(error.violation, kPoseTolerance)) {
      Fail(Verdict::kFootPose, waypoint, PoseErrorText(target.contact, error, kPoseTolerance), evaluation);
    }
  }
}

void Judge::Workspace::CheckCom(int waypoint, Evaluation* evaluation) {
  // Coordinates near the largest double overflow in kinematics; such a pose has failed before.
  const bool finite = kinematics_.com().allFinite() &&
                      std::all_of(placements_.begin(), placements_.end(),
                                  [](const ContactPlacement& p) { return p.X_WL.matrix().allFinite(); });
  const double distance =
      finite ? SignedDistanceToPolygon(SupportPolygon(placements_), kinematics_.com().head<2>()) : kInfinity;
  Include(std::max(0.0, distance), &evaluation->com_violation_m);
  if (Exceeds(distance, kComTolerance_m)) {
    Fail(Verdict::kCom, waypoint, ComErrorText(distance, kComTolerance_m), evaluation);
  }
}

void Judge::Workspace::CheckLimits(const Eigen::VectorXd& x, int waypoint, Evaluation* evaluation) const {
  Include(0, &evaluation->limit_violation);
  for (int dof = 0; dof < robot_.num_dofs(); ++dof) {
    const double lower = std::max(robot_.lower_limits()[dof], -kUnlimitedJoint);
    const double upper = std::min(robot_.upper_limits()[dof], kUnlimitedJoint);
    const double below = lower - x[dof];
    const double violation = std::max(below, x[dof] - upper);
    Include(std::max(0.0, violation), &evaluation->limit_violation);
    // Same sums as in the original: lower - tolerance <= q <= upper + tolerance.
    if (x[dof] >= lower - kLimitTolerance && x[dof] <= upper + kLimitTolerance) continue;
    const Joint& joint = robot_.joints()[static_cast<size_t>(robot_.dof_joint(dof))];
    const std::string unit = " " + std::string(UnitOf(joint.type));
    const bool is_below = below > 0;
    Fail(Verdict::kJointLimit, waypoint,
         joint.name + " = " + NumberText(x[dof]) + " is " + NumberText(violation) + unit +
             (is_below ? " below" : " above") + " its limit " + NumberText(is_below ? lower : upper) + " (tolerance " +
             NumberText(kLimitTolerance) + unit + ")",
         evaluation);
  }
}

std::string Judge::Workspace::DescribeContact(const ExactCollision::SceneContact& contact) const {
  return LinkName(contact.link) + " is " + LengthText(contact.depth_m) + " deep in " + ObjectName(contact.object) +
         " (tolerance " + LengthText(kDepthTolerance_m) + ")";
}

void Judge::Workspace::CheckEnvironment(int waypoint, Evaluation* evaluation) {
  const ExactCollision::SceneContacts deepest = collision_.DeepestEnvironmentContacts(kinematics_);
  Include(deepest.literal.depth_m, &evaluation->environment_depth_m);
  if (Exceeds(deepest.literal.depth_m, kDepthTolerance_m)) {
    Fail(Verdict::kEnvironmentCollision, waypoint, DescribeContact(deepest.literal), evaluation);
  } else if (Exceeds(deepest.strict.depth_m, kDepthTolerance_m)) {
    FailBy(Rule::kStrict, Verdict::kEnvironmentCollision, waypoint, DescribeContact(deepest.strict), evaluation);
  }
  Include(deepest.strict.depth_m, &evaluation->solid_depth_m);
}

std::string Judge::Workspace::DescribeOverlap(const LinkPair& pair, double depth_m) const {
  return LinkName(pair.first) + " and " + LinkName(pair.second) + " overlap by " + LengthText(depth_m) +
         " (tolerance " + LengthText(kDepthTolerance_m) + ")";
}

void Judge::Workspace::CheckSelf(int waypoint, Evaluation* evaluation) {
  const ExactCollision::SelfDepths depths = collision_.SelfDepth(kinematics_);
  Include(depths.literal_m, &evaluation->self_depth_literal_m);
  Include(depths.strict_m, &evaluation->self_depth_strict_m);
  if (Exceeds(depths.literal_m, kDepthTolerance_m)) {
    Fail(Verdict::kSelfCollision, waypoint, DescribeOverlap(depths.literal_pair, depths.literal_m), evaluation);
  } else if (Exceeds(depths.strict_m, kDepthTolerance_m)) {
    FailBy(Rule::kStrict, Verdict::kSelfCollision, waypoint, DescribeOverlap(depths.strict_pair, depths.strict_m),
           evaluation);
  }
  Include(depths.strict_m, &evaluation->solid_depth_m);
}

void Judge::Workspace::CheckIgnoredPairs(int waypoint, Evaluation* evaluation) {
  const ExactCollision::LinkContact deepest = collision_.DeepestIgnoredContact(kinematics_);
  Include(deepest.depth_m, &evaluation->solid_depth_m);
  if (!Exceeds(deepest.depth_m, kDepthTolerance_m)) return;
  FailBy(Rule::kSolid, Verdict::kSelfCollision, waypoint, DescribeOverlap(deepest.pair, deepest.depth_m), evaluation);
}

std::string Judge::Workspace::DescribeContainment(const ExactCollision::Containment& containment) const {
  const std::string other = containment.object < 0 ? LinkName(containment.other_link) : ObjectName(containment.object);
  return LinkName(containment.link) + " and " + other + " have a vertex " + LengthText(containment.depth_m) +
         " inside of the other's closed body (tolerance " + LengthText(kDepthTolerance_m) + ")";
}

void Judge::Workspace::CheckContainment(int waypoint, Evaluation* evaluation) {
  const ExactCollision::Containment deepest = collision_.DeepestContainment(kinematics_);
  Include(deepest.depth_m, &evaluation->solid_depth_m);
  if (!Exceeds(deepest.depth_m, kDepthTolerance_m)) return;
  FailBy(Rule::kSolid, Verdict::kContainment, waypoint, DescribeContainment(deepest), evaluation);
}

void Judge::Workspace::CheckStep(int waypoint, Evaluation* evaluation) {
  Include(0.0, &evaluation->longest_step_m);
  if (waypoint == 0) return;
  const ExactCollision::Step longest = collision_.LongestStep(previous_, kinematics_);
  Include(longest.distance_m, &evaluation->longest_step_m);
  if (!Exceeds(longest.distance_m, step_limit_m_)) return;
  FailBy(Rule::kSolid, Verdict::kStep, waypoint,
         LinkName(longest.link) + " moves by " + LengthText(longest.distance_m) +
             " from the waypoint before (at most " + LengthText(step_limit_m_) + ")",
         evaluation);
}

/// Computes the cost per waypoint (docs/explanation/judge.md#cost).
double Judge::Workspace::Cost(Task task, std::span<const Eigen::VectorXd> waypoints) {
  const double sum = DescriptionOf(task).cost == TaskCost::kTorques ? Torques(waypoints) : JointSteps(waypoints);
  return sum / static_cast<double>(waypoints.size());
}

double Judge::Workspace::Torques(std::span<const Eigen::VectorXd> waypoints) {
  double sum = 0;
  for (const Eigen::VectorXd& x : waypoints) {
    SetState(x);
    kinematics_.GravityTorques(dataset_->gravity_m_s2(), torques_);
    sum += torques_.squaredNorm();
  }
  return sum;
}

double Judge::Workspace::JointSteps(std::span<const Eigen::VectorXd> waypoints) const {
  const int n = robot_.num_dofs();
  double sum = 0;
  for (size_t w = 1; w < waypoints.size(); ++w) {
    sum += (waypoints[w].head(n) - waypoints[w - 1].head(n)).squaredNorm();
  }
  return sum;
}

/// Computes the cost of a path: the limit of the joint step cost for ever more waypoints.
double Judge::Workspace::PathCost(const TimedPath& path) const {
  const int n = robot_.num_dofs();
  double sum = 0;
  for (size_t i = 1; i < path.points.size(); ++i) {
    sum += (path.points[i].head(n) - path.points[i - 1].head(n)).squaredNorm() / (path.times[i] - path.times[i - 1]);
  }
  return sum / static_cast<double>(path.waypoints.size());
}

Evaluation Judge::Workspace::Evaluate(Task task, const ProblemDefinition& problem,
                                      std::span<const Eigen::VectorXd> waypoints) {
  CheckTask(task, problem);
  CheckContactNames(problem);
  const std::int64_t failures_before = collision_.ode_failures();
  first_waypoint_ = 0;
  Evaluation evaluation = IsTimed(task) ? JudgedPath(task, problem, waypoints) : Judged(task, problem, waypoints);
  if (DescriptionOf(task).between == TransitionRule::kScored) {
    evaluation.interpolation = ScoreInterpolation(waypoints, kinematics_, collision_);
  }
  AppendOdeFailures(collision_.ode_failures() - failures_before, &evaluation.detail);
  return evaluation;
}

Evaluation Judge::Workspace::EvaluatePart(Task task, const ProblemDefinition& problem, int first_stance,
                                          std::span<const Eigen::VectorXd> waypoints) {
  CheckTask(task, problem);
  CheckContactNames(problem);
  const auto num_stances = static_cast<std::ptrdiff_t>(waypoints.size()) / DescriptionOf(task).waypoints_per_stance;
  const auto first = problem.stances.begin() + first_stance;
  ProblemDefinition part{.id = problem.id, .stances = {first, std::min(first + num_stances, problem.stances.end())}};
  const std::int64_t failures_before = collision_.ode_failures();
  first_waypoint_ = NumWaypoints(task, first_stance);
  Evaluation evaluation = Judged(task, part, waypoints);
  AppendOdeFailures(collision_.ode_failures() - failures_before, &evaluation.detail);
  return evaluation;
}

/// Runs phases A to C.
Evaluation Judge::Workspace::Judged(Task task, const ProblemDefinition& problem,
                                    std::span<const Eigen::VectorXd> waypoints) {
  Evaluation evaluation;
  evaluation.num_waypoints = NumWaypoints(task, static_cast<int>(problem.stances.size()));
  const int count = static_cast<int>(waypoints.size());
  if (count != evaluation.num_waypoints) {
    Fail(Verdict::kWrongWaypointCount, -1,
         std::to_string(count) + " waypoints instead of " + std::to_string(evaluation.num_waypoints), &evaluation);
    return evaluation;
  }
  for (int w = 0; w < count; ++w) {
    const Eigen::VectorXd& x = waypoints[static_cast<size_t>(w)];
    if (!IsWellFormed(x, w, &evaluation)) continue;
    SetState(x);
    CheckContacts(problem.stances[static_cast<size_t>(StanceOfWaypoint(task, w))], w, &evaluation);
    CheckCom(w, &evaluation);
    CheckLimits(x, w, &evaluation);
  }
  if (evaluation.literal != Verdict::kSuccess) return evaluation;
  for (int w = 0; w < count; ++w) {
    std::swap(previous_, kinematics_);
    SetState(waypoints[static_cast<size_t>(w)]);
    CheckEnvironment(w, &evaluation);
    CheckSelf(w, &evaluation);
    CheckIgnoredPairs(w, &evaluation);
    CheckContainment(w, &evaluation);
    CheckStep(w, &evaluation);
  }
  if (evaluation.literal == Verdict::kSuccess) evaluation.cost = Cost(task, waypoints);
  return evaluation;
}

/// Checks the waypoints in phases A to C; if they pass, checks the segments between them.
Evaluation Judge::Workspace::JudgedPath(Task task, const ProblemDefinition& problem,
                                        std::span<const Eigen::VectorXd> points) {
  Evaluation evaluation;
  evaluation.num_waypoints = NumWaypoints(task, static_cast<int>(problem.stances.size()));
  TimedPath path;
  if (const auto fault = ParsePath(points, evaluation.num_waypoints, robot_.configuration_size(), &path)) {
    Fail(fault->verdict, fault->waypoint, fault->detail, &evaluation);
    return evaluation;
  }
  for (size_t i = 0; i < path.points.size(); ++i) {
    const int waypoint = static_cast<int>(std::floor(path.times[i]));
    if (!IsWellFormed(path.points[i], waypoint, &evaluation)) return evaluation;
    CheckLimits(path.points[i], waypoint, &evaluation);
  }
  std::vector<Eigen::VectorXd> waypoints;
  for (const size_t i : path.waypoints) waypoints.push_back(path.points[i]);
  if (evaluation.literal != Verdict::kSuccess) return evaluation;
  evaluation = Judged(task, problem, waypoints);
  if (evaluation.literal != Verdict::kSuccess) return evaluation;
  const PathExamination between = examiner_.Examine(task, problem, path);
  evaluation.interpolation = between.score;
  Include(between.foot_violation, &evaluation.foot_violation);
  Include(between.com_violation_m, &evaluation.com_violation_m);
  evaluation.cost = PathCost(path);
  if (between.verdict == Verdict::kSuccess) return evaluation;
  Fail(between.verdict, between.waypoint, between.detail, &evaluation);
  evaluation.cost = Evaluation::kNotEvaluated;
  return evaluation;
}

Judge::Judge(std::shared_ptr<const Dataset> dataset, Culling culling)
    : workspace_(std::make_unique<Workspace>(std::move(dataset), culling)) {}
Judge::~Judge() = default;
Judge::Judge(Judge&&) noexcept = default;
Judge& Judge::operator=(Judge&&) noexcept = default;

const Dataset& Judge::dataset() const { return workspace_->dataset(); }

Evaluation Judge::Evaluate(Task task, const ProblemDefinition& problem, std::span<const Eigen::VectorXd> waypoints) {
  return workspace_->Evaluate(task, problem, waypoints);
}

Evaluation Judge::EvaluatePart(Task task, const ProblemDefinition& problem, int first_stance,
                               std::span<const Eigen::VectorXd> waypoints) {
  return workspace_->EvaluatePart(task, problem, first_stance, waypoints);
}

}  // namespace legopt
