#pragma once

#include <string>
#include <vector>

#include "client/report/motion_path.h"
#include "legopt/dataset/dataset.h"
#include "legopt/dynamics/motion_timer.h"
#include "legopt/dynamics/timed_motion.h"

namespace legopt::client {

/// A motion executed by its shortest time law, or the reason why it cannot be.
struct SampledMotion {
  std::string fault;                  ///< reason why the solution has no timing; else empty
  MotionTiming timing;                ///< undefined with a fault
  std::vector<MotionSample> samples;  ///< empty if the motion cannot be executed, or is at rest
  std::vector<MotionPhase> phases;    ///< empty if `samples` is
};

/// Computes the shortest time law of a motion, and its states every 1 / `rate_hz` and at the end: at most `most`.
SampledMotion SampleMotion(const Dataset& dataset, const MotionPath& motion, double rate_hz, int most);

/// Returns the reason why a motion has no samples, e.g. "it is blocked at waypoint 3.25 by the torque of knee"; empty
/// if it has.
std::string WhyNotSampled(const SampledMotion& motion);

}  // namespace legopt::client
