#pragma once

#include <Eigen/Core>

namespace legopt {

/// @file
/// Sign conventions of all collision code, defined only here.
///
///  * Signed distance d [m]: d > 0 the shapes are separate by d; d = 0 they touch; d < 0 they penetrate and -d is the
///    length of the shortest translation that separates them. Penetration *depth* = -d, reported only as a
///    non-negative number (the judge's depths; 0 means no contact).
///  * Shape A belongs to `link_a`, which is always a robot link. Shape B belongs to `link_b`: a robot link with
///    link_b > link_a, or the environment (kScene).
///  * The normal is a unit vector in world axes and points from B to A: moving A along +normal increases d.
///  * Witness points: point_a_W lies on the surface of A, point_b_W on the surface of B, and
///        point_a_W - point_b_W = d * normal_W          for both signs of d
///    (separate: the closest points; penetrating: the deepest points, A's inside B and B's inside A).
///  * Linearised distance about the current configuration, points fixed in their links, normal constant:
///        d(x + dx) ~ d + normal^T (J_A(point_a_W) - J_B(point_b_W)) dx,     J_B = 0 for the environment.
///  * `distance < margin` selects contacts; a margin is the positive distance up to which contacts are reported.

/// `link_b` of a contact with the environment.
inline constexpr int kScene = -1;

/// One pair of convex shapes closer than the query's margin. World frame, metres; signs as defined in this file.
struct ProximityPair {
  int link_a = 0;                                       ///< robot link
  int link_b = kScene;                                  ///< robot link > link_a, or kScene
  Eigen::Vector3d point_a_W = Eigen::Vector3d::Zero();  ///< on the surface of A
  Eigen::Vector3d point_b_W = Eigen::Vector3d::Zero();  ///< on the surface of B
  Eigen::Vector3d normal_W = Eigen::Vector3d::UnitZ();  ///< unit vector from B to A
  double distance_m = 0.0;                              ///< signed distance
  int pair_id = 0;                                      ///< identifies the pair of shapes within one CollisionModel
};

}  // namespace legopt
