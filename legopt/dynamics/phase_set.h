#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "legopt/dynamics/inverse_dynamics.h"
#include "legopt/dynamics/path_spline.h"
#include "legopt/robot/kinematics.h"
#include "legopt/statics/internal/linear_program.h"
#include "legopt/statics/stance_forces.h"

namespace legopt {

/// Kind of limit that bounds how fast a path can be traversed.
enum class TimeLimit : std::uint8_t {
  kVelocity,  ///< velocity limit of a joint
  kTorque,    ///< effort limit of a joint
  kContact,   ///< friction, unilaterality or force bounds of the contacts
  kNumerical  ///< a linear program was not solved
};

/// A limit with its owner.
struct LimitOwner {
  TimeLimit kind = TimeLimit::kContact;
  int index = -1;  ///< degree of freedom; for contacts the surface (StanceForces); -1: unknown
};

/// Half-plane a u + b x <= c of the phase plane.
struct PhaseEdge {
  double a = 0.0, b = 0.0;  ///< unit normal
  double c = 0.0;
  LimitOwner owner;
};

/// Admissible pairs (u, x) at one point of a path x(s), with s = s(t): x = (ds/dt)^2 and u = d^2s/dt^2, both in 1/s^2.
/// A convex polygon within 0 <= x.
struct PhaseSet {
  std::vector<Eigen::Vector2d> corners;  ///< counter-clockwise; empty: no time law passes this point
  std::vector<PhaseEdge> edges;          ///< edges[i] from corner i to the next
  LimitOwner blocked_by;                 ///< if empty: a limit that takes part in the proof, joints first

  bool empty() const { return corners.empty(); }
};

struct PhaseCorner;

/// Computes phase sets. With contact forces f_k = M g sum_e lambda_ke v_ke (StanceForces), (u, x) is admissible if
/// lambda >= 0 exists with
///
///     sum lambda v           = e_z + (Fa u + Fb x) / M g       within +-slack
///     sum lambda (p - c) x v = (Na u + Nb x) / M g             within +-slack, m
///     |g_j + ta_j u + tb_j x - [J^T f]_j| <= effort limit of joint j
///     x <= (velocity limit of joint j / |dq_j/ds|)^2
///
/// (Fa, Na, ta): InverseDynamics of acceleration dx/ds at rest; (Fb, Nb, tb): of velocity dx/ds and acceleration
/// d^2x/ds^2. A linear program whose objective turns finds the corners of their projection to the phase plane.
///
/// A workspace: not thread-safe. Sources: Bobrow, Dubowsky, Gibson, IJRR 4(3), 1985; Caron, Pham, Nakamura, ICRA 2015;
/// Bretl, Lall, IEEE T-RO 24(4), 2008.
class PhaseSetBuilder {
 public:
  /// Largest x that is computed, 1/s^2; paths at rest have no limit.
  static constexpr double kLargestSpeedSquare = 1e6;

  /// `robot` must outlive this object. `gravity_m_s2` >= 0. `effort_share` > 0: factor of the effort limits.
  PhaseSetBuilder(const RobotModel& robot, double gravity_m_s2, double effort_share = 1.0);

  /// Discards basis and scale of the last point. They shorten the search and change results by rounding only.
  void Restart() {
    has_basis_ = false;
    last_x_ = 0.0;
  }

  /// Computes the set at a point of a curve, with the contacts of `forces`.
  PhaseSet Compute(const StanceForces& forces, const CurvePoint& point, double slack);

 private:
  void Measure(const CurvePoint& point);
  void FindLoaded(const StanceForces& forces);
  LinearProgramStatus Constrain(const StanceForces& forces, double slack);
  /// Chooses largest_x_ such that the largest admissible x is of its order, and finds a feasible point.
  LinearProgramStatus Scale(const StanceForces& forces, double slack);
  /// Costs whose optimum is furthest in a direction of the phase plane.
  Eigen::VectorXd CostOf(const Eigen::Vector2d& direction) const;
  /// After Scale: the corners of the set, in units of largest_x_. Returns false if the search failed.
  bool FindCorners(const StanceForces& forces, std::vector<PhaseCorner>* corners);
  void MarkVelocityEdge(std::vector<PhaseCorner>* corners) const;
  void SetForces(const StanceForces& forces, double slack);
  void SetTorqueRows(const StanceForces& forces);
  LimitOwner OwnerOf(const StanceForces& forces, const Eigen::VectorXd& multipliers) const;

  const RobotModel& robot_;
  double gravity_m_s2_;
  double effort_share_;
  double unit_N_;            ///< M g, or M times 9.81 m/s^2 without gravity
  std::vector<int> loaded_;  ///< degrees of freedom with an effort limit that contacts load
  std::vector<int> free_;    ///< the others with a limit
  Kinematics kinematics_;
  InverseDynamics dynamics_;
  InertialForces start_, steady_;  ///< rates per u and per x
  Eigen::VectorXd gravity_torques_, at_rest_;
  Eigen::MatrixXd jacobian_, shares_;
  LinearProgram program_;
  double velocity_x_ = 0.0;  ///< largest x within velocity limits, at most kLargestSpeedSquare
  double largest_x_ = 0.0;   ///< unit of u and x in the programs, at most velocity_x_
  double last_x_ = 0.0;      ///< largest admissible x of the last point; 0: none
  int velocity_dof_ = -1;
  LinearProgramSolver solver_;
  bool has_basis_ = false;
};

}  // namespace legopt
