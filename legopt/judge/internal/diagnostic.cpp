#include "legopt/judge/internal/diagnostic.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "legopt/judge/internal/touch.h"
#include "legopt/robot/internal/smallest_rotation.h"
#include "legopt/types/check.h"
#include "legopt/types/number_text.h"

namespace legopt {

ContactPoseError ComputeContactPoseError(const Eigen::Isometry3d& target, const Eigen::Isometry3d& actual) {
  const Eigen::Isometry3d error = target.inverse(Eigen::Isometry) * actual;
  Eigen::Matrix<double, 6, 1> components;
  components << Eigen::Quaterniond(error.linear()).normalized().vec(), error.translation();
  ContactPoseError result;
  for (int i = 0; i < components.size(); ++i) {
    const double violation =
        std::isnan(components[i]) ? std::numeric_limits<double>::infinity() : std::abs(components[i]);
    if (violation > result.violation) result = {.violation = violation, .component = i};
  }
  return result;
}

ContactPoseError ComputeContactPoseError(const Contact& contact, const ContactTarget& target,
                                         const Eigen::Isometry3d& X_WL) {
  const ContactKindDescription& facts = contact.facts();
  if (facts.free_rotation == FreeRotation::kNone) return ComputeContactPoseError(contact.LinkTarget(target), X_WL);
  Eigen::Isometry3d goal = Eigen::Isometry3d::Identity(), actual = Eigen::Isometry3d::Identity();
  goal.linear() = actual.linear() = target.rotation.normalized().toRotationMatrix();
  goal.translation() = contact.OriginTarget(target);
  actual.translation() = X_WL * contact.X_LC.translation();
  if (facts.free_rotation != FreeRotation::kAll) {
    const int axis = facts.free_rotation == FreeRotation::kAboutBar ? 0 : 2;
    const Eigen::Matrix3d R_WC = X_WL.linear() * contact.X_LC.linear();
    actual.linear() = SmallestRotation(goal.linear().col(axis), R_WC.col(axis)).toRotationMatrix() * goal.linear();
  }
  if (facts.slides) {
    const Eigen::Vector3d bar = goal.linear().col(0);
    const double slide_m = contact.SlideOf(target);
    actual.translation() -= std::clamp(bar.dot(actual.translation() - goal.translation()), -slide_m, slide_m) * bar;
  }
  return ComputeContactPoseError(goal, actual);
}

std::vector<ContactPlacement> ActualPlacements(const Dataset& dataset, const Stance& stance,
                                               const Kinematics& kinematics) {
  std::vector<ContactPlacement> placements;
  for (const ContactTarget& target : stance.contacts) {
    const Contact& contact = dataset.contact(target.contact);
    placements.push_back({.contact = &contact,
                          .X_WL = kinematics.link_pose(contact.link_index),
                          .normal_W = NormalOf(target),
                          .carries = target.carries});
  }
  return placements;
}

double ComDistance(const std::vector<ContactPlacement>& placements, const Kinematics& kinematics) {
  // Coordinates near the largest double overflow in kinematics.
  const bool finite = kinematics.com().allFinite() && std::ranges::all_of(placements, [](const ContactPlacement& p) {
                        return p.X_WL.matrix().allFinite();
                      });
  if (!finite) return std::numeric_limits<double>::infinity();
  const std::vector<Eigen::Vector2d> polygon = SupportPolygon(placements);
  if (polygon.empty()) return std::numeric_limits<double>::infinity();
  return SignedDistanceToPolygon(polygon, kinematics.com().head<2>());
}

std::string NumberText(double value) {
  constexpr int kDigits = 4;
  return FormatGeneral(value, kDigits);
}

std::string LengthText(double value_m) {
  constexpr double kMillimetres = 1000.0;
  return value_m < 1 ? NumberText(value_m * kMillimetres) + " mm" : NumberText(value_m) + " m";
}

std::string PoseErrorText(const std::string& link, const ContactPoseError& error, double tolerance) {
  const std::string axis(1, "xyz"[error.component % 3]);
  if (error.component >= 3) {
    return link + " translation " + axis + " off by " + LengthText(error.violation) + " (tolerance " +
           LengthText(tolerance) + ")";
  }
  return link + " rotation about " + axis + " off by " + NumberText(error.violation) +
         " (quaternion component, tolerance " + NumberText(tolerance) + ", half the angle in rad)";
}

std::string TouchText(const std::string& contact, ContactKind kind, double gap_m) {
  constexpr double kPercent = 100.0;
  const std::string gap = gap_m < kFarGap_m ? LengthText(gap_m) : "more than " + LengthText(kFarGap_m);
  const std::string tolerance = LengthText(TouchTolerance_m(kind));
  const ContactShape shape = DescriptionOf(kind).shape;
  if (shape == ContactShape::kBar) {
    return contact + " grips no bar of the scene: around the axis, its surface must be within the bar's radius and " +
           tolerance + ", and is further away by " + gap;
  }
  if (shape == ContactShape::kBall) {
    return contact + " does not touch the scene: its gap must be at most " + tolerance + ", and is " + gap;
  }
  return contact + " does not touch the scene: " + NumberText(kPercent * kTouchShare) +
         " % of its patch must be within " + tolerance + " of a surface, and are within " + gap;
}

std::string ComErrorText(double distance_m, double tolerance_m) {
  return "centre of mass " + LengthText(distance_m) + " outside the support polygon (tolerance " +
         LengthText(tolerance_m) + ")";
}

std::string EquilibriumText(double distance_m, const std::optional<SlideProof>& slide) {
  if (slide) {
    const Eigen::Vector3d along = -slide->direction.normalized();
    return "no forces within friction hold these contacts in any posture: the robot slides along (" +
           NumberText(along.x()) + ", " + NumberText(along.y()) + ", " + NumberText(along.z()) + ")";
  }
  if (!std::isfinite(distance_m)) return "no forces within friction hold these contacts in any posture";
  return "no forces within friction balance the weight: the centre of mass is " + LengthText(distance_m) +
         " outside the equilibrium polygon (tolerance " + LengthText(kComTolerance_m) + ")";
}

std::string TimingText(const MotionTiming& timing) {
  if (timing.blocked_at < 0.0) return "no time law was found";
  return "no time law exists: at time " + NumberText(timing.blocked_at) + ", the " + timing.blocked_by +
         " forbids every speed and acceleration";
}

std::string PushText(double required_N, double resisted_N) {
  return "the posture resists a push of " + NumberText(resisted_N) + " N, and must resist " + NumberText(required_N) +
         " N (tolerance " + NumberText(kPushTolerance_N) + " N)";
}

std::string TorqueText(const Joint& joint, double ratio) {
  constexpr double kPercent = 100.0;
  const std::string unit = joint.type == JointType::kPrismatic ? " N" : " N m";
  return joint.name + " needs at least " + NumberText(kPercent * ratio) + " % of its limit of " +
         NumberText(joint.effort) + unit;
}

}  // namespace legopt
