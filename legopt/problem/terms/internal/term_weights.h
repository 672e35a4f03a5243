#pragma once

#include <cstdint>

/// Weights of the terms' evaluations (Term::weight_ns): means of Evaluate and Linearize over random points of the
/// embedded problems, in ns of an AMD EPYC at 2.4 GHz, rounded to two digits. `build/bench/term_bench` prints them.
/// They are constants: work of different releases stays comparable unless the changelog names a new calibration.
namespace legopt::term_weights {

inline constexpr std::int64_t kTorqueCost_ns = 1000;       ///< gravity torques
inline constexpr std::int64_t kContactPose_ns = 300;       ///< pose of a sole, palm or rail
inline constexpr std::int64_t kContactPoint_ns = 300;      ///< position of a point
inline constexpr std::int64_t kContactSlide_ns = 300;      ///< position along a rail
inline constexpr std::int64_t kCom_ns = 300;               ///< centre of mass and polygon of balance
inline constexpr std::int64_t kCollision_ns = 30000;       ///< collision query of one configuration
inline constexpr std::int64_t kFreeTorque_ns = 1000;       ///< torques of joints that carry no contact
inline constexpr std::int64_t kLoadedTorque_ns = 30000;    ///< linear program of the least torque ratio
inline constexpr std::int64_t kLoadedPush_ns = 30000;      ///< linear programs of pushes
inline constexpr std::int64_t kPush_ns = 300;              ///< pushes by the polygon
inline constexpr std::int64_t kVelocityCost_ns = 300;      ///< distance of two waypoints
inline constexpr std::int64_t kSweptCollision_ns = 60000;  ///< collision queries between two waypoints

}  // namespace legopt::term_weights
