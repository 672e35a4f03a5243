#include "legopt/judge/judge.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "legopt/geometry/internal/exact_collision.h"
#include "legopt/judge/internal/checks.h"
#include "legopt/judge/internal/diagnostic.h"
#include "legopt/judge/internal/holding_probe.h"
#include "legopt/judge/internal/path_examiner.h"
#include "legopt/judge/internal/touch.h"
#include "legopt/robot/configuration.h"
#include "legopt/robot/kinematics.h"
#include "legopt/types/input_error.h"

namespace legopt {
namespace {

/// Member of Evaluation for each rule's verdict.
constexpr std::array<std::pair<Rule, Verdict Evaluation::*>, kNumEnumerators<Rule>> kVerdicts = {
    {{Rule::kLiteral, &Evaluation::literal},
     {Rule::kStrict, &Evaluation::strict},
     {Rule::kSolid, &Evaluation::solid},
     {Rule::kPhysical, &Evaluation::physical}}};

/// Appends the number of ODE failures; for a success this is the only detail.
void AppendOdeFailures(std::int64_t failures, std::string* detail) {
  if (failures == 0) return;
  *detail += (detail->empty() ? "" : "; ") + std::string("ODE failed an assertion in ") + std::to_string(failures) +
             (failures == 1 ? " mesh query" : " mesh queries") + ", answered by the exact triangle test";
}

}  // namespace

Verdict& Evaluation::by(Rule rule) { return this->*kVerdicts.at(EnumNumber(rule)).second; }

Verdict Evaluation::by(Rule rule) const { return this->*kVerdicts.at(EnumNumber(rule)).second; }

double Evaluation::Largest(Verdict check, Rule rule) const {
  double largest = kNotEvaluated;
  for (const Violation& violation : violations) {
    if (violation.check == check && violation.rule <= rule && !(largest >= violation.value)) largest = violation.value;
  }
  return largest;
}

double Evaluation::SolidDepth_m() const {
  double largest = kNotEvaluated;
  for (const CheckDescription& check : kChecks) {
    if (check.drawing != CheckDrawing::kOverlap) continue;
    const double depth_m = Largest(check.check, Rule::kSolid);
    if (std::isnan(largest) || depth_m > largest) largest = depth_m;
  }
  return largest;
}

std::vector<Violation> Evaluation::StoredViolations() const {
  std::vector<Violation> stored;
  for (const Violation& violation : violations) {
    const bool known = std::ranges::any_of(violations, [&](const Violation& other) {
      return other.check == violation.check && other.rule < violation.rule && other.value >= violation.value;
    });
    if (!known && std::isfinite(violation.value)) stored.push_back(violation);
  }
  return stored;
}

Verdict Evaluation::first_failure() const {
  for (const auto& [rule, verdict] : kVerdicts) {
    if (this->*verdict != Verdict::kSuccess) return this->*verdict;
  }
  return Verdict::kSuccess;
}

/// Appends the contact that does not touch, although the solution does not fail for it.
void AppendTouchFinding(Evaluation* evaluation) {
  if (evaluation->solid != Verdict::kSuccess) return;
  for (const Violation& violation : evaluation->violations) {
    if (violation.check != Verdict::kTouch || !Exceeds(violation.value, kTouchTolerance_m)) continue;
    evaluation->detail += (evaluation->detail.empty() ? "" : "; ") + std::string("waypoint ") +
                          std::to_string(violation.waypoint) + ": " +
                          TouchText(violation.subject, ContactKind::kSole, violation.value) +
                          " (reported only: the contact declares no points)";
  }
}

class Judge::Workspace {
 public:
  Workspace(std::shared_ptr<const Dataset> dataset, Culling culling)
      : dataset_(std::move(dataset)),
        robot_(dataset_->robot()),
        kinematics_(robot_),
        previous_(robot_),
        collision_(robot_, dataset_->scene(), dataset_->collision_model(), culling),
        touch_(*dataset_, collision_),
        holding_(*dataset_),
        examiner_(*dataset_, collision_),
        timer_(*dataset_),
        clamped_(robot_.configuration_size()),
        torques_(robot_.num_dofs()) {}

  const Dataset& dataset() const { return *dataset_; }

  Evaluation Evaluate(Task task, const ProblemDefinition& problem, std::span<const Eigen::VectorXd> waypoints);
  Evaluation EvaluatePart(Task task, const ProblemDefinition& problem, int first_stance,
                          std::span<const Eigen::VectorXd> waypoints);

 private:
  Evaluation Judged(Task task, const ProblemDefinition& problem, std::span<const Eigen::VectorXd> waypoints);
  Evaluation JudgedPath(Task task, const ProblemDefinition& problem, std::span<const Eigen::VectorXd> points);
  bool PassesPointwise(Task task, const ProblemDefinition& problem, const TimedPath& path, Evaluation* evaluation);
  static void CheckTask(Task task, const ProblemDefinition& problem);
  void CheckContactNames(const ProblemDefinition& problem) const;
  bool IsWellFormed(const Eigen::VectorXd& x, CheckRecorder& recorder) const;
  void SetState(const Eigen::VectorXd& x);
  void Make(std::span<const WaypointCheck> checks, const Stance& stance, const Eigen::VectorXd& x, bool has_previous,
            CheckRecorder& recorder);
  double Cost(Task task, std::span<const Eigen::VectorXd> waypoints);
  double Torques(std::span<const Eigen::VectorXd> waypoints);
  double JointSteps(std::span<const Eigen::VectorXd> waypoints) const;
  double PathCost(const TimedPath& path) const;
  void FindTimeLaw(Task task, const ProblemDefinition& problem, const TimedPath& path, Evaluation* evaluation,
                   CheckRecorder& recorder);
  HoldingScore HoldingHalfway(Task task, const ProblemDefinition& problem, std::span<const Eigen::VectorXd> waypoints);
  std::shared_ptr<const Dataset> dataset_;
  const RobotModel& robot_;
  Kinematics kinematics_;
  Kinematics previous_;  ///< state at the previous waypoint
  ExactCollision collision_;
  TouchProbe touch_;
  HoldingProbe holding_;
  PathExaminer examiner_;  ///< used by tasks with continuous paths
  MotionTimer timer_;      ///< used by tasks with a time law
  Eigen::VectorXd clamped_;
  Eigen::VectorXd torques_;
  int first_waypoint_ = 0;  ///< number, in the whole motion, of the first judged waypoint
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

bool Judge::Workspace::IsWellFormed(const Eigen::VectorXd& x, CheckRecorder& recorder) const {
  if (x.size() != robot_.configuration_size()) {
    recorder.Fail(Verdict::kWrongSize, Rule::kLiteral,
                  std::to_string(x.size()) + " numbers instead of " + std::to_string(robot_.configuration_size()));
    return false;
  }
  if (!x.allFinite()) {
    Eigen::Index bad = 0;
    while (std::isfinite(x[bad])) ++bad;
    recorder.Fail(Verdict::kNotFinite, Rule::kLiteral, "number " + std::to_string(bad) + " is " + NumberText(x[bad]));
    return false;
  }
  const double norm = PartsOf(x).quaternion_coefficients().stableNorm();
  if (!(norm > 0)) {
    recorder.Fail(Verdict::kNotFinite, Rule::kLiteral, "the base quaternion has norm 0 and no direction");
    return false;
  }
  return true;
}

void Judge::Workspace::SetState(const Eigen::VectorXd& x) {
  clamped_ = ClampedConfiguration(robot_, x);
  kinematics_.Update(clamped_);
}

void Judge::Workspace::Make(std::span<const WaypointCheck> checks, const Stance& stance, const Eigen::VectorXd& x,
                            bool has_previous, CheckRecorder& recorder) {
  const CheckedWaypoint waypoint{.dataset = *dataset_,
                                 .stance = stance,
                                 .x = x,
                                 .kinematics = kinematics_,
                                 .previous = has_previous ? &previous_ : nullptr,
                                 .collision = collision_,
                                 .touch = touch_,
                                 .holding = holding_};
  for (const WaypointCheck& check : checks) check.measure(waypoint, recorder);
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
  Evaluation evaluation = HasTimeStamps(task) ? JudgedPath(task, problem, waypoints) : Judged(task, problem, waypoints);
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
  CheckRecorder recorder(first_waypoint_, &evaluation);
  evaluation.num_waypoints = NumWaypoints(task, static_cast<int>(problem.stances.size()));
  const int count = static_cast<int>(waypoints.size());
  if (count != evaluation.num_waypoints) {
    recorder.Fail(Verdict::kWrongWaypointCount, Rule::kLiteral,
                  std::to_string(count) + " waypoints instead of " + std::to_string(evaluation.num_waypoints));
    return evaluation;
  }
  const auto stance = [&](int w) -> const Stance& {
    return problem.stances[static_cast<size_t>(StanceOfWaypoint(task, w))];
  };
  for (int w = 0; w < count; ++w) {
    const Eigen::VectorXd& x = waypoints[static_cast<size_t>(w)];
    recorder.set_waypoint(w);
    if (!IsWellFormed(x, recorder)) continue;
    SetState(x);
    Make(PoseChecks(), stance(w), x, false, recorder);
  }
  if (evaluation.literal != Verdict::kSuccess) return evaluation;
  for (int w = 0; w < count; ++w) {
    const Eigen::VectorXd& x = waypoints[static_cast<size_t>(w)];
    std::swap(previous_, kinematics_);
    SetState(x);
    recorder.set_waypoint(w);
    Make(BodyChecks(), stance(w), x, w > 0, recorder);
  }
  if (evaluation.literal == Verdict::kSuccess) evaluation.cost = Cost(task, waypoints);
  evaluation.holding_halfway = HoldingHalfway(task, problem, waypoints);
  AppendTouchFinding(&evaluation);
  return evaluation;
}

/// Counts the postures half way between consecutive waypoints that the contacts of both can hold.
HoldingScore Judge::Workspace::HoldingHalfway(Task task, const ProblemDefinition& problem,
                                              std::span<const Eigen::VectorXd> waypoints) {
  HoldingScore score;
  Eigen::VectorXd halfway(robot_.configuration_size());
  for (size_t w = 1; w < waypoints.size(); ++w) {
    const auto stance = [&](size_t waypoint) -> const Stance& {
      return problem.stances[static_cast<size_t>(StanceOfWaypoint(task, static_cast<int>(waypoint)))];
    };
    InterpolateConfiguration(ClampedConfiguration(robot_, waypoints[w - 1]), ClampedConfiguration(robot_, waypoints[w]),
                             0.5, halfway);
    SetState(halfway);
    Count(holding_.MeasureOnce(PlantedContacts(*dataset_, stance(w - 1), stance(w)), kinematics_), &score);
  }
  return score;
}

/// Checks form and joint limits of all points of a path.
bool Judge::Workspace::PassesPointwise(Task task, const ProblemDefinition& problem, const TimedPath& path,
                                       Evaluation* evaluation) {
  CheckRecorder recorder(first_waypoint_, evaluation);
  for (size_t i = 0; i < path.points.size(); ++i) {
    const int waypoint = static_cast<int>(std::floor(path.times[i]));
    recorder.set_waypoint(waypoint);
    if (!IsWellFormed(path.points[i], recorder)) return false;
    const Stance& stance = problem.stances[static_cast<size_t>(StanceOfWaypoint(task, waypoint))];
    Make({{{Verdict::kJointLimit, &CheckLimits}}}, stance, path.points[i], false, recorder);
  }
  return evaluation->literal == Verdict::kSuccess;
}

/// Checks the waypoints in phases A to C; if they pass, checks the segments between them.
Evaluation Judge::Workspace::JudgedPath(Task task, const ProblemDefinition& problem,
                                        std::span<const Eigen::VectorXd> points) {
  Evaluation evaluation;
  evaluation.num_waypoints = NumWaypoints(task, static_cast<int>(problem.stances.size()));
  TimedPath path;
  if (const auto fault = ParsePath(points, evaluation.num_waypoints, robot_.configuration_size(), &path)) {
    CheckRecorder recorder(first_waypoint_, &evaluation);
    recorder.set_waypoint(fault->waypoint);
    recorder.Fail(fault->verdict, Rule::kLiteral, fault->detail);
    return evaluation;
  }
  if (!PassesPointwise(task, problem, path, &evaluation)) return evaluation;
  std::vector<Eigen::VectorXd> waypoints;
  for (const size_t i : path.waypoints) waypoints.push_back(path.points[i]);
  evaluation = Judged(task, problem, waypoints);
  if (evaluation.literal != Verdict::kSuccess) return evaluation;
  const PathExamination between = examiner_.Examine(task, problem, path);
  evaluation.interpolation = between.score;
  for (const Violation& found : between.violations) {
    IncludeViolation(
        found.check, found.rule, found.waypoint, found.value, [&] { return found.subject; }, &evaluation.violations);
  }
  CheckRecorder recorder(first_waypoint_, &evaluation);
  if (between.verdict != Verdict::kSuccess) {
    recorder.set_waypoint(between.waypoint);
    recorder.Fail(between.verdict, Rule::kLiteral, between.detail);
    evaluation.cost = Evaluation::kNotEvaluated;
  } else if (!HasTimeLaw(task)) {
    evaluation.cost = PathCost(path);
  } else {
    FindTimeLaw(task, problem, path, &evaluation, recorder);
  }
  return evaluation;
}

/// Computes the least duration of a path that keeps all other rules, and the cost from it.
void Judge::Workspace::FindTimeLaw(Task task, const ProblemDefinition& problem, const TimedPath& path,
                                   Evaluation* evaluation, CheckRecorder& recorder) {
  std::vector<const Stance*> stances;
  for (int w = 0; w < evaluation->num_waypoints; ++w) {
    stances.push_back(&problem.stances[static_cast<size_t>(StanceOfWaypoint(task, w))]);
  }
  try {
    evaluation->timing = timer_.Compute(stances, path.times, path.points);
  } catch (const InputError& error) {
    recorder.Fail(Verdict::kTiming, Rule::kLiteral, error.fault().message + ": " + error.fault().value);
    return;
  }
  evaluation->cost = evaluation->timing->shortest_s / static_cast<double>(problem.stances.size());
  if (std::isfinite(evaluation->cost)) return;
  evaluation->cost = Evaluation::kNotEvaluated;
  recorder.set_waypoint(static_cast<int>(evaluation->timing->blocked_at));
  recorder.Fail(Verdict::kTiming, Rule::kLiteral, TimingText(*evaluation->timing));
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
