#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "legopt/statics/stance_forces.h"

namespace legopt {

/// Proof that no forces of a stance balance the robot's weight, wherever its centre of mass is.
///
/// y = (u, w) with |y|_inf = 1. For every generator, y . a_l = u . v_l + w (p_l x v_l)_z. If y . a_l <= 0 for all
/// generators, a force balance sum lambda v = e_z, sum lambda (p x v)_z = 0 would give u_z <= 0; so u_z > 0 excludes
/// one. With bounded normal forces, u_z must exceed the sum over their contacts of bound * max(0, max y . a_l), and
/// with bars also the sum over their generators of bound * max(0, y . a_l). Seen as a motion: pushed along u, and
/// turned by w about the vertical axis through the origin of moments, the robot slides down.
struct SlideProof {
  Eigen::Vector3d direction = Eigen::Vector3d::Zero();  ///< u
  double turn = 0.0;                                    ///< w, 1/m
  double margin = 0.0;                                  ///< u_z - the sums of the bounds, > 0 for a proof
  double largest = 0.0;  ///< largest y . a_l of generators without a bound; 0 up to rounding for a proof
};

/// Margin that a proof must have, and rounding that its generators may show.
inline constexpr double kProofMargin = 1e-3;
inline constexpr double kProofRounding = 1e-12;

/// Computes the figures of a proof from the generators alone, without any solver.
SlideProof CheckedProof(const StanceForces& forces, const Eigen::Vector3d& direction, double turn);

/// Returns true if the figures prove that the stance cannot be held.
bool IsProof(const SlideProof& proof);

/// Horizontal positions of the centre of mass that a stance can hold.
struct EquilibriumPolygon {
  /// Corners in the world, m, counter-clockwise: each has forces that a linear program found, so that every inner point
  /// also has some. One or two corners if all positions coincide or are collinear; empty if there is none.
  std::vector<Eigen::Vector2d> corners;
  std::optional<SlideProof> slide;  ///< set if `corners` is empty and a proof was found
};

/// Distance from the mean contact point up to which positions are searched, in x and in y. A polygon without bound
/// (IsUnbounded) ends there. A robot whose centre of mass reaches further (StanceForces::com_reach_m) has its own
/// distance, so that a verdict never depends on it.
inline constexpr double kPolygonReach_m = 3.0;
/// Distance up to which the corners approximate the exact polygon from within.
inline constexpr double kPolygonAccuracy_m = 1e-4;

/// Computes the equilibrium polygon
///
///     P = { (-m_y, m_x) : sum lambda v = e_z, m = sum lambda (p x v), m_z = 0, lambda >= 0, normal forces in bounds }
///
/// by a linear program whose objective turns once around (LinearProgramSolver::Turn); then corners are removed that are
/// less than kPolygonAccuracy_m outside of the others. The height of the centre of mass does not matter. Thread-safe.
///
/// Source: Bretl, Lall, Testing Static Equilibrium for Legged Robots, IEEE T-RO 24(4), 2008.
EquilibriumPolygon ComputeEquilibriumPolygon(const StanceForces& forces);

/// Returns true if the forces hold the centre of mass at any distance in some direction: contacts without a bound press
/// against each other, as hands between opposite walls do, so that forces without a sum have any moment. Exactly:
///
///     there is lambda >= 0 on the generators without a bound with sum lambda v = 0, sum lambda = 1,
///     sum lambda (p x v)_z = 0 and (-m_y, m_x) != 0,    m = sum lambda (p x v)
///
/// False for a stance without an equilibrium polygon. Thread-safe.
bool IsUnbounded(const StanceForces& forces);

/// Distance up to which the corners approximate the exact polygon from within, if a push acts.
inline constexpr double kPushPolygonAccuracy_m = 1e-3;

/// Computes the polygon that remains while a horizontal force pushes the centre of mass c. `push`: that force in units
/// of the weight. The forces then have the sum F = e_z - push and the moments c x F, so that only the line through c
/// along F matters. The polygon contains the points where that line meets the horizontal plane through
/// StanceForces::origin_W():
///
///     c_xy + (c_z - origin_z) push
///
/// The corners approximate the exact polygon from within up to kPushPolygonAccuracy_m. Empty if nothing balances the
/// push. Thread-safe.
std::vector<Eigen::Vector2d> ComputePushPolygon(const StanceForces& forces, const Eigen::Vector2d& push);

/// Returns the polygon in which a stance at its targets demands the centre of mass, by every rule: the support polygon
/// on feet (StandsOnFeet), else the equilibrium polygon. Empty if nothing carries or nothing balances.
std::vector<Eigen::Vector2d> BalancePolygon(const Dataset& dataset, const Stance& stance);

}  // namespace legopt
