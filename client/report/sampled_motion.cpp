#include "client/report/sampled_motion.h"

#include <cmath>

#include "legopt/types/input_error.h"
#include "legopt/types/number_text.h"

namespace legopt::client {

SampledMotion SampleMotion(const Dataset& dataset, const MotionPath& motion, double rate_hz, int most) {
  SampledMotion sampled{.fault = motion.fault, .timing = {}, .samples = {}, .phases = {}};
  if (!sampled.fault.empty()) return sampled;
  try {
    sampled.timing = MotionTimer(dataset).Compute(motion.stances, motion.path.times, motion.path.points);
  } catch (const InputError& error) {
    sampled.fault = error.fault().message + ": " + error.fault().field + " " + error.fault().value;
    return sampled;
  }
  if (sampled.timing.times_s.empty()) return sampled;
  TimedMotion timed(dataset, sampled.timing, motion.stances, motion.path.times, motion.path.points);
  for (const double time_s : SampleTimes(timed.duration_s(), rate_hz, most))
    sampled.samples.push_back(timed.At(time_s));
  sampled.phases = timed.Phases();
  return sampled;
}

std::string WhyNotSampled(const SampledMotion& motion) {
  if (!motion.samples.empty()) return "";
  if (!motion.fault.empty()) return motion.fault;
  if (motion.timing.shortest_s == 0.0) return "it is at rest: all its points are the same";
  constexpr int kDigits = 2;
  return "it is blocked at waypoint " + FormatFixed(motion.timing.blocked_at, kDigits) + ": " +
         motion.timing.blocked_by;
}

}  // namespace legopt::client
