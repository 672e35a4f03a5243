#include "legopt/judge/internal/waypoint_inspector.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "legopt/judge/internal/checks.h"
#include "legopt/judge/internal/diagnostic.h"
#include "legopt/judge/judge.h"
#include "legopt/robot/configuration.h"

namespace legopt {
namespace {

// The original evaluator's rule counts only the first colliding link pair, in the order of ExactCollision.
std::vector<OverlapDiagnostic> Classified(const std::vector<ExactCollision::Overlap>& overlaps) {
  std::vector<OverlapDiagnostic> findings;
  bool first_pair = true;
  for (const ExactCollision::Overlap& overlap : overlaps) {
    const bool counts = overlap.other_link < 0 || first_pair;
    if (overlap.other_link >= 0 && !overlap.ignored && overlap.literal_m >= 0.0) first_pair = false;
    OverlapDiagnostic& finding = findings.emplace_back(OverlapDiagnostic{.overlap = overlap, .fails = {}});
    if (!overlap.ignored && counts && overlap.literal_m > kDepthTolerance_m) {
      finding.fails = Rule::kLiteral;
    } else if (!overlap.ignored && overlap.depth_m > kDepthTolerance_m) {
      finding.fails = Rule::kStrict;
    } else if (overlap.depth_m > kDepthTolerance_m || overlap.inside_m > kDepthTolerance_m) {
      finding.fails = Rule::kSolid;
    }
  }
  return findings;
}

}  // namespace

WaypointInspector::WaypointInspector(std::shared_ptr<const Dataset> dataset)
    : dataset_(std::move(dataset)),
      kinematics_(dataset_->robot()),
      previous_(dataset_->robot()),
      collision_(dataset_->robot(), dataset_->scene(), dataset_->collision_model()),
      touch_(*dataset_, collision_),
      holding_(*dataset_) {}

/// Clamps the joints to their limits, as for a verdict.
bool WaypointInspector::SetState(const Eigen::VectorXd& x, Kinematics* kinematics) const {
  const RobotModel& robot = dataset_->robot();
  if (x.size() != robot.configuration_size() || !x.allFinite()) return false;
  if (!(PartsOf(x).quaternion_coefficients().stableNorm() > 0)) return false;
  kinematics->Update(ClampedConfiguration(robot, x));
  return true;
}

void WaypointInspector::ListFeet(const Stance& stance, WaypointDiagnostics* findings) {
  const std::vector<ContactPlacement> placements = ActualPlacements(*dataset_, stance, kinematics_);
  for (std::size_t i = 0; i < placements.size(); ++i) {
    const ContactTarget& target = stance.contacts[i];
    const ContactPoseError error = ComputeContactPoseError(*placements[i].contact, target, placements[i].X_WL);
    findings->feet.push_back({.link = target.contact,
                              .violation = error.violation,
                              .component = error.component,
                              .violated = !(error.violation <= kPoseTolerance)});
  }
  findings->com_W = kinematics_.com();
  const bool on_feet = findings->on_feet = StandsOnFeet(*dataset_, stance);
  findings->com_m = on_feet ? ComDistance(placements, kinematics_) : holding_.SignedDistance(stance, kinematics_);
  if (std::isfinite(findings->com_m)) findings->polygon_W = on_feet ? SupportPolygon(placements) : holding_.polygon();
  findings->com_violated = !(findings->com_m <= kComTolerance_m);
}

void WaypointInspector::ListLimits(const Eigen::VectorXd& x, WaypointDiagnostics* findings) const {
  const RobotModel& robot = dataset_->robot();
  for (int dof = 0; dof < robot.num_dofs(); ++dof) {
    const double lower = std::max(robot.lower_limits()[dof], -kUnlimitedJoint);
    const double upper = std::min(robot.upper_limits()[dof], kUnlimitedJoint);
    const double below = lower - x[dof], above = x[dof] - upper;
    const double excess = std::max(below, above);
    if (excess < -kNearLimit) continue;
    findings->limits.push_back({.dof = dof,
                                .value = x[dof],
                                .limit = below > above ? lower : upper,
                                .excess = excess,
                                .violated = x[dof] < lower - kLimitTolerance || x[dof] > upper + kLimitTolerance});
  }
}

void WaypointInspector::ListValues(const Stance& stance, const Eigen::VectorXd& x, bool has_previous,
                                   WaypointDiagnostics* findings) {
  const CheckedWaypoint waypoint{.dataset = *dataset_,
                                 .stance = stance,
                                 .x = x,
                                 .kinematics = kinematics_,
                                 .previous = has_previous ? &previous_ : nullptr,
                                 .collision = collision_,
                                 .touch = touch_,
                                 .holding = holding_};
  for (const auto checks : {PoseChecks(), BodyChecks()}) {
    for (const WaypointCheck& check : checks) {
      const CheckDrawing drawing = DescriptionOf(check.check).drawing;
      const bool holding = check.check == Verdict::kEquilibrium;  // with torque and push, one after the other
      if (drawing != CheckDrawing::kLink && drawing != CheckDrawing::kNone && !holding) continue;
      Evaluation evaluation;
      CheckRecorder recorder(0, &evaluation);
      check.measure(waypoint, recorder);
      for (const Violation& value : evaluation.violations) {
        const Verdict verdict = evaluation.by(value.rule);
        findings->values.push_back(
            {.value = value, .violated = holding ? verdict == value.check : verdict != Verdict::kSuccess});
      }
    }
  }
}

WaypointDiagnostics WaypointInspector::At(const Stance& stance, const Eigen::VectorXd& x,
                                          const Eigen::VectorXd* before) {
  WaypointDiagnostics findings;
  if (!SetState(x, &kinematics_)) return findings;
  ListFeet(stance, &findings);
  ListLimits(x, &findings);
  findings.overlaps = Classified(collision_.Overlaps(kinematics_));
  ListValues(stance, x, before != nullptr && SetState(*before, &previous_), &findings);
  findings.holding = ExplainHolding(*dataset_, stance, kinematics_, &holding_);
  return findings;
}

std::vector<OverlapDiagnostic> WaypointInspector::TransitionRule(const Eigen::VectorXd& from, const Eigen::VectorXd& to,
                                                                 double s) {
  // As in ScoreInterpolation, only the ends are clamped, not the configurations between them.
  const RobotModel& robot = dataset_->robot();
  if (from.size() != robot.configuration_size() || to.size() != from.size()) return {};
  Eigen::VectorXd a = from, b = to, x(from.size());
  robot.ClampJoints(a);
  robot.ClampJoints(b);
  const auto has_rotation = [](const Eigen::VectorXd& y) { return PartsOf(y).quaternion_coefficients().norm() > 0; };
  if (!a.allFinite() || !b.allFinite() || !has_rotation(a) || !has_rotation(b)) return {};
  InterpolateConfiguration(a, b, s, x);
  kinematics_.UpdatePoses(x);
  return Classified(collision_.Overlaps(kinematics_));
}

}  // namespace legopt
