#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "legopt/statics/stance_forces.h"
#include "legopt/types/enum_names.h"

namespace legopt {

/// A rigid motion of the whole robot by which its weight falls although no contact resists: the mechanical reading of a
/// proof that no forces balance the weight (collapse mechanism of limit analysis).
///
/// The point p moves with the velocity v(p) = velocity + turn x (p - center). Let g_l be the generators of the forces
/// (StanceForces) at their points p_l. In a proof y = (u, w), y . a_l = -g_l . v(p_l) with v = -(u + w x (p - center)).
/// So y . a_l <= 0 says that no contact force can brake the motion, and u_z > 0 that the centre of mass descends. With
/// bounds, the weight does more work than all bounded forces that brake.
///
/// Forces inside of their friction pyramid do no work only at points at rest. So a point that moves either leaves its
/// surface without force, or slips with the force at the edge of the pyramid. As in limit analysis with associated
/// flow, a slipping point also departs from its surface, with mu times its tangential speed.
struct CollapseMotion {
  Eigen::Vector3d center_W = Eigen::Vector3d::Zero();  ///< m, in the world
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();  ///< velocity of the robot at center_W; any scale
  Eigen::Vector3d turn = Eigen::Vector3d::Zero();      ///< angular velocity, 1/m in units of the velocity

  Eigen::Vector3d At(const Eigen::Vector3d& position_W) const;  ///< velocity of a point
};

/// Movement of a contact in a collapse.
enum class ContactMovement : std::uint8_t {
  kRests,   ///< a point stays where it is: the robot may tip about it
  kSlips,   ///< a point slips along the surface, against friction
  kYields,  ///< a bounded force is exceeded: a bar, or a surface with a largest normal force
  kLifts    ///< all points leave the surface
};

template <>
inline constexpr auto kEnumNames<ContactMovement> =
    MakeEnumNames<ContactMovement>({{ContactMovement::kRests, "rests"},
                                    {ContactMovement::kSlips, "slips"},
                                    {ContactMovement::kYields, "yields"},
                                    {ContactMovement::kLifts, "lifts"}});

/// Movement of one surface in a collapse.
struct SurfaceMovement {
  ContactMovement movement = ContactMovement::kRests;
  Eigen::Vector3d position_W = Eigen::Vector3d::Zero();   ///< mean of the points with this movement, m
  Eigen::Vector3d direction_W = Eigen::Vector3d::Zero();  ///< unit: of a slip, along the surface; zero at rest
  double speed = 0.0;  ///< largest speed of these points along the direction, relative to the fastest point
};

/// Work of the weight less the largest work of all forces, per weight and unit of velocity, from the generators alone:
/// > 0 proves that no forces balance a centre of mass at `com_W`. Brakes without a bound count as infinite beyond
/// rounding.
double CollapseMargin(const CollapseMotion& motion, const StanceForces& forces, const Eigen::Vector3d& com_W);

/// Describes the movement of each surface in a collapse. `surfaces`: those of the forces. Thread-safe.
std::vector<SurfaceMovement> MovementsOf(const CollapseMotion& motion, const std::vector<TouchedSurface>& surfaces,
                                         const StanceForces& forces);

}  // namespace legopt
