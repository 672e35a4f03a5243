#pragma once

#include <numbers>
#include <string>
#include <vector>

#include "legopt/dataset/contact.h"
#include "legopt/robot/robot_model.h"

namespace legopt {

/// Links on which a robot stands, found from its geometry.
struct FoundFeet {
  std::vector<std::string> links;       ///< one per foot, left before right and front before rear; empty: not found
  std::vector<std::string> candidates;  ///< all ends of the robot with collision geometry, lowest first
};

/// Finds the feet of a robot: the ends of its chains whose lowest points are within 6 % of the robot's height above the
/// lowest point of all. If there is only one such end, the limit is 15 %. If all of them are on one side, it is 40 %,
/// provided that this gives as many feet on the left as on the right.
///
/// Three postures are tried: `standing` (n + 7, base upright), all joints at 0, and all joints in the middle of their
/// limits. The most symmetric result counts; of equal ones, the first. Links connected by fixed joints are one body.
/// A posture counts only if the body of the root link, unless it is an end, is above the 6 %: else the robot lies. The
/// link of a foot is the one that touches the ground with the largest area, within 3 mm of the lowest point; if three
/// or more links touch, it is the body's first link. Loads meshes with the robot's guard; throws InputError for a mesh
/// that cannot be read.
FoundFeet FindFeet(const RobotModel& robot, const Eigen::VectorXd& standing);

/// Default of the largest angle between a sole and the horizontal; the flanks of bent legs are steeper.
inline constexpr double kSteepestSole_rad = 35.0 * std::numbers::pi / 180.0;

/// A contact measured on the geometry of a link.
struct FoundSole {
  ContactDescription contact;
  double area_m2 = 0.0;   ///< area of the patch
  double tilt_rad = 0.0;  ///< angle between the link's z axis and the patch's normal
  double height_m = 0.0;  ///< distance of the link's origin above the patch's plane
};

/// Measures the sole of a link and of links fixed to it: the facet of their convex hull with the largest area, seen
/// from below in `standing` (n + 7, base upright), among those within `steepest_rad` of the horizontal that reach
/// within 2 mm of the lowest point. Facets steeper than kSteepestSole_rad must face away from the joint above. The
/// contact frame is 1 mm below it, where the benchmark has its foot targets
/// (docs/explanation/paper.md#foot-targets). Its axes are those of the link if these fit within 1 degree; else z is the
/// patch's normal and x the robot's forward direction. Its origin is below the link's, or in the middle of the patch if
/// the link's origin is beside it. The points are at most eight corners of the part that
/// touches (touching_patch.h). If several spheres or capsules reach the facet's plane, their lowest points replace the
/// corners on them.
///
/// A body that ends in one ball, or has no facet of at least 8 cm^2, gets a point contact: at the ball, if one of its
/// spheres or capsules is lowest or a ball fits its lowest vertices within 1 mm; else at its lowest point. Loads meshes
/// like FindFeet. `link` must have collision geometry, or be fixed to links that have.
FoundSole MeasureSole(const RobotModel& robot, int link, const Eigen::VectorXd& standing,
                      double steepest_rad = kSteepestSole_rad);

}  // namespace legopt
