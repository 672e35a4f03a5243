#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <vector>

#include "legopt/robot/kinematics.h"
#include "legopt/statics/collapse_motion.h"
#include "legopt/statics/internal/linear_program.h"
#include "legopt/statics/stance_forces.h"

namespace legopt {

/// Slack of the balance of forces (in units of the weight) and moments (weight times 1 m) in torques and pushes, which
/// corresponds to the judge's 1 mm for the centre of mass.
inline constexpr double kBalanceTolerance = 1e-3;

/// Largest torque ratio that is computed; more counts as this.
inline constexpr double kLargestTorqueRatio = 1e3;

/// Largest joint torque, as a share of its limit, of the joints that contacts load.
struct LoadedRatio {
  double ratio = 0.0;        ///< smallest possible value, as TorqueRatio; infinite without equilibrium
  Eigen::VectorXd gradient;  ///< n + 6: derivative of the ratio, with points fixed in the world; if it was requested
};

/// The smallest torques that hold a posture.
struct TorqueRatio {
  /// t*: max over joints of |tau_j| / limit_j, minimised over the contact forces; infinite if no forces balance the
  /// robot, 0 for a robot without effort limits.
  double ratio = 0.0;
  /// Lower bound of the ratio for all forces of up to 1,000 weights, from the multipliers alone (DualBound): proves
  /// that a joint must exceed its limit if it is above 1. Equal to the ratio up to rounding if contacts load that
  /// joint.
  double proven_ratio = 0.0;
  int dof = -1;                           ///< degree of freedom with that ratio; -1: none
  std::vector<Eigen::Vector3d> forces_N;  ///< forces at StanceForces::points(), in the world; empty without equilibrium
  Eigen::VectorXd torques;                ///< torques of these forces, n, N m or N; empty without equilibrium
  /// Degrees of freedom whose limits prove the ratio: those with a multiplier, or the one that no contact loads. Other
  /// joints may have the same share in these forces, but need not have it.
  std::vector<int> decisive_dofs;
};

/// Number of horizontal directions of pushes: 0, 45, .. 315 degrees from the x axis.
inline constexpr int kPushDirections = 8;

/// Limits of the forces that resist a push.
enum class PushLimits {
  kContacts,           ///< friction and the bounds of contact forces
  kContactsAndEfforts  ///< contacts and the effort limits of the joints
};

/// Largest push in each direction (PushDirection), N, >= 0; minus infinity where the posture cannot be held as it is.
using DirectedPushes = std::array<double, kPushDirections>;

/// The push that a posture resists least.
struct WeakestPush {
  double push_N = 0.0;       ///< largest resisted push in the weakest direction; infinite: enough in all directions
  Eigen::VectorXd gradient;  ///< n + 6: its derivative, N, with contact points fixed in the world; if requested
};

/// Returns direction k of them, unit.
Eigen::Vector3d PushDirection(int k);

/// Static equilibrium of a posture with given contacts. All programs demand, with moments about the centre of mass,
///
///     sum_k f_k = M g e_z,    sum_k (p_k - c) x f_k = 0,    f_k in the friction pyramid of its contact
///     tau_j = g_j(q) - sum_k [J_k(q)^T f_k]_j                 g: Kinematics::GravityTorques, J: Jacobian of point k
///
/// A workspace: not thread-safe. Source: docs/explanation/judge.md#physical-rule.
class StaticEquilibrium {
 public:
  /// `robot` must outlive this object. `gravity_m_s2` > 0.
  StaticEquilibrium(const RobotModel& robot, double gravity_m_s2);

  /// Returns s*: the smallest s for which all forces (weight) and moments (weight times 1 m) balance within +-s, with
  /// the centre of mass at `com_W`, m. 0: equilibrium. At most 1, the weight itself.
  double Imbalance(const StanceForces& forces, const Eigen::Vector3d& com_W);

  /// Computes the torque ratio with balance within kBalanceTolerance. `kinematics`: after Update().
  TorqueRatio ComputeTorqueRatio(const StanceForces& forces, const Kinematics& kinematics);

  /// Computes the torque ratio with other forces: of all forces that reach it, those with the least sum of lambda
  /// (StanceForces), so that contacts do not press against each other without need. For pictures: the judge's forces
  /// are any that reach the ratio.
  TorqueRatio ComputeLeastForces(const StanceForces& forces, const Kinematics& kinematics);

  /// Returns the motion by which a robot falls whose centre of mass is at `com_W`, m, from the multipliers of the
  /// program of Imbalance; empty if CollapseMargin does not confirm it, for example in equilibrium.
  std::optional<CollapseMotion> FindCollapse(const StanceForces& forces, const Eigen::Vector3d& com_W);

  /// Returns true if forces with balance within `tolerance` exist for which no loaded joint needs more than `ratio` of
  /// its limit. Takes a small part of the time of ComputeLoadedRatio, especially if little has changed since the last
  /// call.
  bool IsLoadedRatioBelow(const StanceForces& forces, const Kinematics& kinematics, double tolerance, double ratio);

  /// Computes the ratio of the joints that contacts load, with balance within `tolerance`. The gradient follows from
  /// the multipliers of the linear program; where its optimal basis changes, it is one of several. The search begins
  /// at the last call's basis, so that the last digits depend on the calls before.
  void ComputeLoadedRatio(const StanceForces& forces, const Kinematics& kinematics, double tolerance,
                          bool with_gradient, LoadedRatio* result);

  /// Returns the largest force, N, that may push the centre of mass in each of kPushDirections while contacts
  /// and effort limits still balance it; negative if the posture cannot be held as it is. The judge uses this push, the
  /// smallest of ResistedPushes_N within contacts and efforts.
  double ResistedPush_N(const StanceForces& forces, const Kinematics& kinematics);

  /// Returns the largest resisted push in each direction, at most ten weights.
  DirectedPushes ResistedPushes_N(const StanceForces& forces, const Kinematics& kinematics, PushLimits limits);

  /// Computes the weakest push within contacts and efforts, for optimisation. If `enough_N` is resisted in all
  /// directions, it is infinite, which takes a small part of the time if little has changed since the last call. The
  /// gradient follows from the multipliers of the linear program; where its optimal basis or the weakest direction
  /// changes, it is one of several. Minus infinity if no push at all is resisted.
  void ComputeWeakestPush(const StanceForces& forces, const Kinematics& kinematics, double enough_N, bool with_gradient,
                          WeakestPush* result);

 private:
  /// Minimises the ratio of loaded joints over the forces; returns false without equilibrium. `resume`: begins at the
  /// last basis of `solver`, if that is feasible.
  bool MinimizeRatio(const StanceForces& forces, const Kinematics& kinematics, double tolerance, bool resume,
                     LinearProgramSolver& solver);
  /// Sets the program of forces for which no loaded joint needs more than `ratio` of its limit.
  void SetBoundedRatioRows(const StanceForces& forces, const Kinematics& kinematics, double tolerance, double ratio);
  /// Sets ratio, forces and torques of a result from the variables of a program; with it proven_ratio of joints that
  /// no contact loads.
  void SetForces(const StanceForces& forces, const Eigen::VectorXd& lambda, TorqueRatio* result) const;
  bool IsLimited(int dof) const;  ///< has a finite effort limit > 0
  bool IsLoaded(int dof) const;
  /// Sets the program of forces with balance and torque rows of a push, whose column follows the generators.
  void SetPushProgram(const StanceForces& forces, const Kinematics& kinematics, PushLimits limits);
  /// Sets column and bound of a push along a direction, in units of the weight. After SetPushProgram.
  void SetPushColumn(int direction);
  /// Returns the largest push that joints without contact forces resist, in units of the weight; minus infinity if
  /// gravity alone exceeds a limit of theirs.
  double UnloadedPush() const;
  /// Returns true if a push along the direction of SetPushColumn is resisted; unit: the weight.
  bool Resists(int direction, double push);
  /// Returns the largest push along the direction of SetPushColumn, in units of the weight; minus infinity if none is
  /// resisted. `resume`: the search begins at the last basis of `solver`.
  double LargestPush(LinearProgramSolver& solver, bool resume);
  /// Sets the gradient of the last LargestPush, which was `push`.
  void SetPushGradient(int direction, double push, const LinearProgramSolver& solver, const StanceForces& forces,
                       const Kinematics& kinematics, Eigen::VectorXd* gradient);
  /// Adds the rates of a program's optimum with multipliers `y` by the forces' torques, weighted by -weights_, and by
  /// their moments about the centre of mass.
  void AddForceRates(const StanceForces& forces, const Kinematics& kinematics, const Eigen::VectorXd& lambda,
                     const Eigen::VectorXd& y, Eigen::VectorXd* gradient);
  /// Torques of loaded joints as linear functions of the generators, in shares of their limits.
  void SetTorqueRows(const StanceForces& forces, const Kinematics& kinematics);
  /// Sets the program of forces (SetForceProgram); `columns` follow the generators, `torque_rows` the other rows.
  void SetBalanceRows(const StanceForces& forces, const Eigen::Vector3d& com_W, double tolerance,
                      Eigen::Index torque_rows, Eigen::Index columns);

  const RobotModel& robot_;
  double gravity_m_s2_;
  double weight_N_;
  std::vector<int> loaded_;  ///< degrees of freedom with a limit that contacts load
  Eigen::VectorXd gravity_torques_;
  Eigen::MatrixXd jacobian_, shares_;  ///< shares_: loaded x generators
  LinearProgram program_;
  Eigen::VectorXd cost_;
  Eigen::MatrixXd com_jacobian_, gravity_jacobian_;
  Eigen::VectorXd weights_;
  LinearProgramSolver solver_;
  LinearProgramSolver loaded_solver_, bounded_solver_;  ///< used by ComputeLoadedRatio and IsLoadedRatioBelow
  PushLimits push_limits_ = PushLimits::kContacts;
  Eigen::Index push_column_ = 0;
  double push_bound_ = 0.0;
  Eigen::VectorXd push_torques_;                                        ///< n: per push of one weight
  Eigen::VectorXd balanced_b_;                                          ///< right side without push, during Resists
  std::array<LinearProgramSolver, kPushDirections> resisting_solvers_;  ///< used by Resists
  /// Used by ComputeWeakestPush for directions that did not resist enough the last time.
  std::array<LinearProgramSolver, kPushDirections> largest_push_solvers_;
  std::array<bool, kPushDirections> is_weak_{};
};

}  // namespace legopt
