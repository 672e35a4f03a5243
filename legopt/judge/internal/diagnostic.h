#pragma once

#include <Eigen/Geometry>
#include <optional>
#include <string>
#include <vector>

#include "legopt/dataset/contact.h"
#include "legopt/dataset/dataset.h"
#include "legopt/dataset/problem_definition.h"
#include "legopt/dynamics/motion_timer.h"
#include "legopt/robot/kinematics.h"
#include "legopt/robot/robot_model.h"
#include "legopt/statics/equilibrium_polygon.h"

namespace legopt {

/// Largest component of a foot's pose error (docs/explanation/judge.md#foot-pose-error).
struct ContactPoseError {
  double violation = 0;  ///< quaternion component (1) or translation (m), >= 0; infinite for NaN
  int component = 0;     ///< 0..2: quaternion x y z, 3..5: translation x y z, in the target frame
};

/// Returns true if a value exceeds a tolerance. NaN counts as exceeding.
inline bool Exceeds(double value, double tolerance) { return !(value <= tolerance); }

/// Computes the largest component of the vector part of the quaternion and the translation of inverse(target) * actual.
/// Poses in the world.
ContactPoseError ComputeContactPoseError(const Eigen::Isometry3d& target, const Eigen::Isometry3d& actual);

/// Computes the pose error of a contact whose link is at X_WL, in the axes of the target. Rotations that the kind
/// leaves free do not count: a point contact has only the translation of its frame's origin; of a palm and a rail, the
/// rotation is the smallest one that turns the normal, or the bar, into that of the contact frame. A rail's translation
/// along the bar counts beyond Contact::SlideOf. Poses in the world.
ContactPoseError ComputeContactPoseError(const Contact& contact, const ContactTarget& target,
                                         const Eigen::Isometry3d& X_WL);

/// Returns the contacts of a stance where the robot has them. They reference contacts of the dataset. Throws InputError
/// for a contact that the dataset does not have.
std::vector<ContactPlacement> ActualPlacements(const Dataset& dataset, const Stance& stance,
                                               const Kinematics& kinematics);

/// Returns the signed distance, m, of the centre of mass from the support polygon of placed contacts: > 0 outside.
/// Infinite without supporting contacts, and for coordinates that overflowed.
double ComDistance(const std::vector<ContactPlacement>& placements, const Kinematics& kinematics);

// Texts of the judge's findings: numbers with four digits, lengths below a metre in mm.

/// Formats a number.
std::string NumberText(double value);
/// Formats a length given in metres.
std::string LengthText(double value_m);
/// Describes a foot pose error: foot, component, magnitude and tolerance (quaternion component, m).
std::string PoseErrorText(const std::string& link, const ContactPoseError& error, double tolerance);
/// Describes the gap below a contact (touch.h).
std::string TouchText(const std::string& contact, ContactKind kind, double gap_m);
/// Describes the distance of the centre of mass from the support polygon.
std::string ComErrorText(double distance_m, double tolerance_m);
/// Describes the distance of the centre of mass from the equilibrium polygon (holding_probe.h), and how a stance slides
/// that no posture holds.
std::string EquilibriumText(double distance_m, const std::optional<SlideProof>& slide);
/// Describes the push that a posture resists.
std::string PushText(double required_N, double resisted_N);
/// Describes why a motion has no time law: the place, and the limit that forbids one.
std::string TimingText(const MotionTiming& timing);
/// Describes the torque of a joint as a share of its limit.
std::string TorqueText(const Joint& joint, double ratio);

}  // namespace legopt
