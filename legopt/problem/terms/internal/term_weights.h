#pragma once

#include <cstdint>

/// Weights of the terms' evaluations (Term::weight_ns): means of Evaluate and Linearize over random points of the
/// humanoid's embedded problems on an AMD EPYC, in ns, rounded to two digits. `build/bench/term_bench` prints such
/// means; contact points and slides are estimates. The weights are constants: other robots and scenes have other times,
/// but the work of all methods on a problem is counted alike. The changelog names a new calibration.
namespace legopt::term_weights {

inline constexpr std::int64_t kTorqueCost_ns = 650;       ///< gravity torques
inline constexpr std::int64_t kContactPose_ns = 380;      ///< pose of a sole, palm or rail
inline constexpr std::int64_t kContactPoint_ns = 300;     ///< position of a point
inline constexpr std::int64_t kContactSlide_ns = 200;     ///< position along a rail
inline constexpr std::int64_t kCom_ns = 280;              ///< centre of mass and polygon of balance
inline constexpr std::int64_t kCollision_ns = 4500;       ///< collision query of one configuration
inline constexpr std::int64_t kFreeTorque_ns = 150;       ///< torques of joints that carry no contact
inline constexpr std::int64_t kLoadedTorque_ns = 14000;   ///< linear program of the least torque ratio
inline constexpr std::int64_t kLoadedPush_ns = 31000;     ///< linear programs of pushes
inline constexpr std::int64_t kPush_ns = 600;             ///< pushes by the polygon
inline constexpr std::int64_t kVelocityCost_ns = 250;     ///< distance of two waypoints
inline constexpr std::int64_t kSweptCollision_ns = 5000;  ///< collision queries between two waypoints

}  // namespace legopt::term_weights
