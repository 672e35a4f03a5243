#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "legopt/dataset/dataset.h"
#include "legopt/dataset/problem_definition.h"
#include "legopt/dynamics/motion_forces.h"
#include "legopt/dynamics/motion_timer.h"
#include "legopt/dynamics/path_spline.h"

namespace legopt {

/// Force of a contact on the robot, at one of its points.
struct ContactForce {
  std::string contact;
  int link = 0;                    ///< index into RobotModel::links()
  Eigen::Vector3d position_W;      ///< m
  Eigen::Vector3d force_N;         ///< force on the robot, in world axes
  Eigen::Vector3d normal_W;        ///< unit normal of the surface
  std::optional<double> friction;  ///< Coulomb coefficient; nullopt: a bar, whose forces have bounds
};

/// State of a robot at one instant of a motion.
struct MotionSample {
  double time_s = 0.0;
  double parameter = 0.0;            ///< s: waypoint w is at w
  Eigen::VectorXd x;                 ///< n + 7, configuration
  Eigen::VectorXd velocity;          ///< n + 6, dx/dt as a tangent: base rotation in world axes, rad/s and m/s
  Eigen::VectorXd acceleration;      ///< n + 6, derivative of velocity by time
  Eigen::VectorXd torques;           ///< n, N m or N
  std::vector<ContactForce> forces;  ///< contacts that carry, in the order of the stance; all their points
  double imbalance = 0.0;            ///< residual of the equations of motion of the base (RealizedForces)
};

/// Contacts between two instants at which contacts are made or broken.
struct MotionPhase {
  double begin_s = 0.0, end_s = 0.0;
  Stance contacts;  ///< contacts that stay in place throughout
};

/// A motion executed by its shortest time law: the state of the robot at any time. u = d^2s/dt^2 is constant between
/// points of the grid, so that limits hold at these points and may be exceeded a little between them.
///
/// A workspace: not thread-safe.
class TimedMotion {
 public:
  /// `timing`: of MotionTimer::Compute for the same stances, times and points; must have a duration above 0. The robot
  /// of `dataset` must outlive this object.
  TimedMotion(const Dataset& dataset, MotionTiming timing, std::span<const Stance* const> stances,
              std::span<const double> times, std::span<const Eigen::VectorXd> points);

  double duration_s() const { return timing_.times_s.back(); }
  const MotionTiming& timing() const { return timing_; }

  /// Computes the state at a time in [0, duration_s()]. The robot is at rest at the end.
  MotionSample At(double time_s);

  /// Returns the phases of the motion, in order. Each lasts from a waypoint to a later one; neighbours differ.
  std::vector<MotionPhase> Phases() const;

 private:
  /// Contacts of one part of a motion.
  struct Part {
    std::vector<std::string> names;        ///< contacts that carry
    std::vector<TouchedSurface> surfaces;  ///< their surfaces
    StanceForces forces;
  };
  /// Motion along the path.
  struct Progress {
    double s = 0.0, speed = 0.0, acceleration = 0.0;  ///< s, ds/dt, d^2s/dt^2
  };

  static Part MakePart(const Dataset& dataset, const Stance& contacts);
  /// Returns the forces at the points of a part, without their values.
  static std::vector<ContactForce> PointsOf(const Part& part);
  Progress ProgressAt(double time_s) const;
  double TimeOf(double waypoint) const;

  MotionTiming timing_;
  PathSpline spline_;
  std::vector<Stance> planted_;             ///< contacts of each segment
  std::vector<Part> waypoints_, segments_;  ///< segments_[w]: from waypoint w to the next
  Kinematics kinematics_;
  InverseDynamics dynamics_;
  MotionForces forces_;
  CurvePoint point_;
  InertialForces inertial_;
};

/// Returns times from 0 to the end: every 1 / `rate_hz`, and the end itself. At most `most` (at least 2): with more,
/// the interval is larger.
std::vector<double> SampleTimes(double duration_s, double rate_hz, int most);

}  // namespace legopt
