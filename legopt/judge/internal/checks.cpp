#include "legopt/judge/internal/checks.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "legopt/judge/internal/diagnostic.h"
#include "legopt/robot/robot_model.h"

namespace legopt {
namespace {

std::string LinkName(const CheckedWaypoint& waypoint, int link) {
  return waypoint.dataset.robot().links()[static_cast<std::size_t>(link)].name;
}

std::string ObjectName(const CheckedWaypoint& waypoint, int object) {
  return "'" + waypoint.dataset.scene().objects[static_cast<std::size_t>(object)].name + "' of the scene";
}

std::string DepthToleranceText() { return " (tolerance " + LengthText(kDepthTolerance_m) + ")"; }

void CheckContacts(const CheckedWaypoint& waypoint, CheckRecorder& recorder) {
  for (const ContactTarget& target : waypoint.stance.contacts) {
    const Contact& contact = waypoint.dataset.contact(target.contact);
    const ContactPoseError error =
        ComputeContactPoseError(contact, target, waypoint.kinematics.link_pose(contact.link_index));
    recorder.Measure(Verdict::kFootPose, Rule::kLiteral, error.violation, Exceeds(error.violation, kPoseTolerance),
                     [&] {
                       return CheckFinding{target.contact, PoseErrorText(target.contact, error, kPoseTolerance)};
                     });
  }
}

/// Balance over the support polygon is demanded of stances on feet; CheckHolding judges the others.
void CheckCom(const CheckedWaypoint& waypoint, CheckRecorder& recorder) {
  if (!StandsOnFeet(waypoint.dataset, waypoint.stance)) return;
  const double distance =
      ComDistance(ActualPlacements(waypoint.dataset, waypoint.stance, waypoint.kinematics), waypoint.kinematics);
  recorder.Measure(Verdict::kCom, Rule::kLiteral, std::max(0.0, distance), Exceeds(distance, kComTolerance_m), [&] {
    return CheckFinding{"centre of mass", ComErrorText(distance, kComTolerance_m)};
  });
}

void CheckEnvironment(const CheckedWaypoint& waypoint, CheckRecorder& recorder) {
  const ExactCollision::SceneContacts deepest = waypoint.collision.DeepestEnvironmentContacts(waypoint.kinematics);
  const auto measure = [&](Rule rule, const ExactCollision::SceneContact& contact) {
    recorder.Measure(
        Verdict::kEnvironmentCollision, rule, contact.depth_m, Exceeds(contact.depth_m, kDepthTolerance_m), [&] {
          const std::string link = LinkName(waypoint, contact.link), object = ObjectName(waypoint, contact.object);
          return CheckFinding{link + " and " + object, link + " is " + LengthText(contact.depth_m) + " deep in " +
                                                           object + DepthToleranceText()};
        });
  };
  measure(Rule::kLiteral, deepest.literal);
  measure(Rule::kStrict, deepest.strict);
}

void CheckSelf(const CheckedWaypoint& waypoint, CheckRecorder& recorder) {
  const auto measure = [&](Rule rule, const LinkPair& pair, double depth_m) {
    recorder.Measure(Verdict::kSelfCollision, rule, depth_m, Exceeds(depth_m, kDepthTolerance_m), [&] {
      const std::string subject = LinkName(waypoint, pair.first) + " and " + LinkName(waypoint, pair.second);
      return CheckFinding{subject, subject + " overlap by " + LengthText(depth_m) + DepthToleranceText()};
    });
  };
  const ExactCollision::SelfDepths depths = waypoint.collision.SelfDepth(waypoint.kinematics);
  measure(Rule::kLiteral, depths.literal_pair, depths.literal_m);
  measure(Rule::kStrict, depths.strict_pair, depths.strict_m);
  const ExactCollision::LinkContact ignored = waypoint.collision.DeepestIgnoredContact(waypoint.kinematics);
  measure(Rule::kSolid, ignored.pair, ignored.depth_m);
}

void CheckContainment(const CheckedWaypoint& waypoint, CheckRecorder& recorder) {
  const ExactCollision::Containment deepest = waypoint.collision.DeepestContainment(waypoint.kinematics);
  recorder.Measure(
      Verdict::kContainment, Rule::kSolid, deepest.depth_m, Exceeds(deepest.depth_m, kDepthTolerance_m), [&] {
        const std::string subject =
            LinkName(waypoint, deepest.link) + " and " +
            (deepest.object < 0 ? LinkName(waypoint, deepest.other_link) : ObjectName(waypoint, deepest.object));
        return CheckFinding{subject, subject + " have a vertex " + LengthText(deepest.depth_m) +
                                         " inside of the other's closed body" + DepthToleranceText()};
      });
}

void CheckStep(const CheckedWaypoint& waypoint, CheckRecorder& recorder) {
  ExactCollision::Step longest;
  if (waypoint.previous != nullptr) {
    longest = waypoint.collision.LongestStep(*waypoint.previous, waypoint.kinematics);
  }
  const double limit_m = kStepShare * waypoint.dataset.robot_bounds().diagonal().norm();
  recorder.Measure(Verdict::kStep, Rule::kSolid, longest.distance_m, Exceeds(longest.distance_m, limit_m), [&] {
    const std::string link = LinkName(waypoint, longest.link);
    return CheckFinding{link, link + " moves by " + LengthText(longest.distance_m) +
                                  " from the waypoint before (at most " + LengthText(limit_m) + ")"};
  });
}

/// Contacts without declared points do not fail: their patch is a box, which a good sole may touch only in part.
void CheckTouch(const CheckedWaypoint& waypoint, CheckRecorder& recorder) {
  std::vector<Eigen::Vector2d> places_W;
  bool judged = true;
  for (const ContactTarget& target : waypoint.stance.contacts) {
    const Contact& contact = waypoint.dataset.contact(target.contact);
    const ContactTouch touch =
        waypoint.touch.Measure(contact, NormalOf(target), waypoint.kinematics.link_pose(contact.link_index));
    judged = judged && contact.declares_points;
    recorder.Measure(Verdict::kTouch, Rule::kSolid, touch.gap_m,
                     contact.declares_points && Exceeds(touch.gap_m, TouchTolerance_m(contact.kind)), [&] {
                       return CheckFinding{contact.name, TouchText(contact.name, contact.kind, touch.gap_m)};
                     });
    if (!contact.facts().supports || !target.carries) continue;
    places_W.insert(places_W.end(), touch.places_W.begin(), touch.places_W.end());
  }
  if (!StandsOnFeet(waypoint.dataset, waypoint.stance)) return;
  const std::vector<Eigen::Vector2d> polygon = ConvexHull2d(std::move(places_W));
  const double distance = polygon.empty() ? std::numeric_limits<double>::infinity()
                                          : SignedDistanceToPolygon(polygon, waypoint.kinematics.com().head<2>());
  recorder.Measure(Verdict::kCom, Rule::kSolid, std::max(0.0, distance), judged && Exceeds(distance, kComTolerance_m),
                   [&] {
                     return CheckFinding{"centre of mass", ComErrorText(distance, kComTolerance_m)};
                   });
}

/// Equilibrium and torques come from the same forces. Where hands carry, equilibrium is the balance of every rule.
void CheckHolding(const CheckedWaypoint& waypoint, CheckRecorder& recorder) {
  const Holding holding = waypoint.holding.Measure(waypoint.stance, waypoint.kinematics);
  recorder.CountHolding(holding);
  const Rule rule = StandsOnFeet(waypoint.dataset, waypoint.stance) ? Rule::kPhysical : Rule::kLiteral;
  recorder.Measure(Verdict::kEquilibrium, rule, holding.distance_m, !holding.balanced(), [&] {
    return CheckFinding{"centre of mass", EquilibriumText(holding.distance_m, waypoint.holding.slide())};
  });
  if (!holding.balanced()) return;
  recorder.Measure(Verdict::kTorque, Rule::kPhysical, holding.torque_ratio, !holding.within_torques(), [&] {
    const RobotModel& robot = waypoint.dataset.robot();
    const Joint& joint = robot.joints()[static_cast<std::size_t>(robot.dof_joint(holding.dof))];
    return CheckFinding{joint.name, TorqueText(joint, holding.torque_ratio)};
  });
  if (!waypoint.stance.push_N || !holding.within_torques()) return;
  const double required_N = *waypoint.stance.push_N;
  const double resisted_N = std::max(0.0, waypoint.holding.ResistedPush_N(waypoint.kinematics));
  const double missing_N = std::max(0.0, required_N - resisted_N);
  recorder.Measure(Verdict::kPush, Rule::kPhysical, missing_N, Exceeds(missing_N, kPushTolerance_N), [&] {
    return CheckFinding{"push", PushText(required_N, resisted_N)};
  });
}

}  // namespace

void Count(const Holding& holding, HoldingScore* score) {
  ++score->postures;
  if (!holding.balanced()) {
    ++score->without_equilibrium;
  } else if (!holding.within_torques()) {
    ++score->over_torque;
  }
}

void CheckLimits(const CheckedWaypoint& waypoint, CheckRecorder& recorder) {
  const RobotModel& robot = waypoint.dataset.robot();
  recorder.Measure(Verdict::kJointLimit, Rule::kLiteral, 0.0, false, [] { return CheckFinding{}; });
  for (int dof = 0; dof < robot.num_dofs(); ++dof) {
    const double q = waypoint.x[dof];
    const double lower = std::max(robot.lower_limits()[dof], -kUnlimitedJoint);
    const double upper = std::min(robot.upper_limits()[dof], kUnlimitedJoint);
    const double below = lower - q;
    const double violation = std::max(below, q - upper);
    // Same sums as in the original: lower - tolerance <= q <= upper + tolerance.
    const bool failed = !(q >= lower - kLimitTolerance && q <= upper + kLimitTolerance);
    recorder.Measure(Verdict::kJointLimit, Rule::kLiteral, std::max(0.0, violation), failed, [&] {
      const Joint& joint = robot.joints()[static_cast<std::size_t>(robot.dof_joint(dof))];
      const std::string unit = " " + std::string(UnitOf(joint.type));
      const bool is_below = below > 0;
      return CheckFinding{joint.name, joint.name + " = " + NumberText(q) + " is " + NumberText(violation) + unit +
                                          (is_below ? " below" : " above") + " its limit " +
                                          NumberText(is_below ? lower : upper) + " (tolerance " +
                                          NumberText(kLimitTolerance) + unit + ")"};
    });
  }
}

std::span<const WaypointCheck> PoseChecks() {
  static constexpr std::array kChecksOfPose = {WaypointCheck{Verdict::kFootPose, &CheckContacts},
                                               WaypointCheck{Verdict::kCom, &CheckCom},
                                               WaypointCheck{Verdict::kJointLimit, &CheckLimits}};
  return kChecksOfPose;
}

std::span<const WaypointCheck> BodyChecks() {
  static constexpr std::array kChecksOfBodies = {WaypointCheck{Verdict::kEnvironmentCollision, &CheckEnvironment},
                                                 WaypointCheck{Verdict::kSelfCollision, &CheckSelf},
                                                 WaypointCheck{Verdict::kContainment, &CheckContainment},
                                                 WaypointCheck{Verdict::kStep, &CheckStep},
                                                 WaypointCheck{Verdict::kTouch, &CheckTouch},
                                                 WaypointCheck{Verdict::kEquilibrium, &CheckHolding}};
  return kChecksOfBodies;
}

void CheckRecorder::Fail(Verdict check, Rule rule, const std::string& detail) {
  const bool first = evaluation_->by(rule) == Verdict::kSuccess;
  for (std::size_t other = EnumNumber(rule); other < kNumEnumerators<Rule>; ++other) {
    Verdict& verdict = evaluation_->by(static_cast<Rule>(other));
    if (verdict == Verdict::kSuccess) verdict = check;
  }
  if (!first) return;
  evaluation_->failed_waypoint = waypoint_;
  evaluation_->detail = (waypoint_ >= 0 ? "waypoint " + std::to_string(waypoint_) + ": " : "") +
                        (rule == Rule::kLiteral ? "" : "by the " + std::string(ToString(rule)) + " rule, ") + detail;
}

}  // namespace legopt
