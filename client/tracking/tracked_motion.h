#pragma once

#include <limits>

#include "legopt/dataset/dataset.h"
#include "legopt/dynamics/timed_motion.h"

namespace legopt::client {

/// Options of a simulation.
struct TrackingOptions {
  double slowdown = 1.0;          ///< factor of the motion's duration, >= 1; 1: the shortest time law
  double stiffness_1_s2 = 400.0;  ///< acceleration per error of a position, 1/s^2
  double damping_1_s = 40.0;      ///< acceleration per error of a velocity, 1/s
  double friction_share = 1.0;    ///< share of the friction coefficients that the controller uses
  double step_s = 1e-3;           ///< time step of the simulation
  int control_steps = 2;          ///< steps per computation of torques
  double rest_s = 1.0;            ///< time after the end in which the robot must keep its last posture
};

/// Outcome of a simulated motion.
struct TrackedMotion {
  bool falls = false;
  double fell_at_s = std::numeric_limits<double>::quiet_NaN();
  double fell_at_waypoint = std::numeric_limits<double>::quiet_NaN();  ///< parameter of the motion at that time
  double duration_s = 0.0;                                             ///< duration of the motion, with the slowdown
  double base_error_m = 0.0;                                           ///< largest distance of the base from its place
  double joint_error_rad = 0.0;                                        ///< largest deviation of a joint, rad or m
  double slip_m = 0.0;            ///< largest distance of a planted contact from its target
  double saturated_share = 0.0;   ///< share of the time in which a torque was cut
  double unbalanced_share = 0.0;  ///< share in which no admissible contact forces gave the wanted acceleration
};

/// Tracks a motion in a RigidBodyWorld by inverse dynamics: the wanted acceleration is that of the motion plus
/// stiffness times the position error plus damping times the velocity error, for joints and base alike. Torques and
/// contact forces that give this acceleration come from ForceDistribution, for the contacts that the motion has at that
/// time, or from MotionForces if torques exceed their limits then; what still exceeds them is cut. The robot falls if
/// its base is more than 0.2 m or 0.5 rad from its place.
///
/// Deterministic for one build of ODE. Throws InputError as RigidBodyWorld.
TrackedMotion Track(const Dataset& dataset, TimedMotion* motion, const TrackingOptions& options);

}  // namespace legopt::client
