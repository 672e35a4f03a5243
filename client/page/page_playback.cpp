#include "client/page/page_playback.h"

#include <map>
#include <tuple>

#include "client/page/page_holding.h"
#include "client/report/motion_path.h"
#include "client/report/sampled_motion.h"
#include "legopt/robot/configuration.h"

namespace legopt::client {
namespace {

using Json = nlohmann::ordered_json;

// Units of rounding.
constexpr double kPlaceUnit = 1e-6, kTimeUnit_s = 1e-6, kRateUnit = 1e-4, kTorqueUnit = 1e-2,
                 kPlaybackForceUnit_N = 0.1;

/// Points where contact forces act, each listed once.
class PointTable {
 public:
  int IndexOf(const ContactForce& force) {
    const auto numbers = [](const Eigen::Vector3d& v) { return std::tuple(v.x(), v.y(), v.z()); };
    const Key key(force.contact, numbers(force.position_W), numbers(force.normal_W), force.friction.value_or(-1.0));
    const auto [found, is_new] = indices_.try_emplace(key, static_cast<int>(points_.size()));
    if (is_new) {
      points_.push_back({{"contact", force.contact},
                         {"at", RoundedVectorJson(kPlaceUnit, force.position_W)},
                         {"normal", RoundedVectorJson(kPlaceUnit, force.normal_W)},
                         {"friction", force.friction ? Json(*force.friction) : Json()}});
    }
    return found->second;
  }
  Json points() const { return points_; }

 private:
  using Numbers = std::tuple<double, double, double>;
  using Key = std::tuple<std::string, Numbers, Numbers, double>;
  std::map<Key, int> indices_;
  Json points_ = Json::array();
};

Json ForcesJson(const MotionSample& sample, PointTable* points) {
  Json forces = Json::array();
  for (const ContactForce& force : sample.forces) {
    Json entry = {points->IndexOf(force)};
    for (const double component : force.force_N) entry.push_back(RoundedTo(kPlaybackForceUnit_N, component));
    forces.push_back(std::move(entry));
  }
  return forces;
}

void AddSamples(const SampledMotion& motion, Json* json) {
  PointTable points;
  Json times = Json::array(), waypoints = Json::array(), x = Json::array(), velocities = Json::array();
  Json torques = Json::array(), forces = Json::array();
  for (const MotionSample& sample : motion.samples) {
    times.push_back(RoundedTo(kTimeUnit_s, sample.time_s));
    waypoints.push_back(RoundedTo(kPlaceUnit, sample.parameter));
    x.push_back(RoundedVectorJson(kPlaceUnit, sample.x));
    velocities.push_back(RoundedVectorJson(kRateUnit, TangentPartsOf(sample.velocity).joints()));
    torques.push_back(RoundedVectorJson(kTorqueUnit, sample.torques));
    forces.push_back(ForcesJson(sample, &points));
  }
  (*json)["times_s"] = std::move(times);
  (*json)["waypoints"] = std::move(waypoints);
  (*json)["x"] = std::move(x);
  (*json)["velocities"] = std::move(velocities);
  (*json)["torques"] = std::move(torques);
  (*json)["points"] = points.points();
  (*json)["forces"] = std::move(forces);
}

SampledMotion SampleJob(const Dataset& dataset, const PageJob& job, const PageMotion& motion) {
  if (motion.unsolved_from) {
    return {.fault = "the window from waypoint " + std::to_string(*motion.unsolved_from) + " on is not solved",
            .timing = {},
            .samples = {},
            .phases = {}};
  }
  const ProblemDefinition& problem = dataset.problem(job.task, job.problem);
  const MotionPath path = ReadMotionPath(job.task, problem, motion.waypoints, dataset.robot().configuration_size());
  return SampleMotion(dataset, path, kPlaybackRate_Hz, kMostPlaybackSamples);
}

}  // namespace

std::string PlaybackName(std::int64_t job_id) { return "playback-" + std::to_string(job_id); }

Json PlaybackJson(const Dataset& dataset, const PageJob& job, const PageMotion& motion) {
  const SampledMotion sampled = SampleJob(dataset, job, motion);
  if (const std::string reason = WhyNotSampled(sampled); !reason.empty()) {
    Json json = {{"duration_s", nullptr}, {"reason", reason}};
    if (sampled.fault.empty() && sampled.timing.blocked_at >= 0.0) {
      json["blocked_at"] = RoundedTo(kPlaceUnit, sampled.timing.blocked_at);
      json["blocked_by"] = sampled.timing.blocked_by;
    }
    return json;
  }
  const LimitShares& limits = sampled.timing.limits;
  Json json = {{"duration_s", RoundedTo(kTimeUnit_s, sampled.timing.shortest_s)},
               {"nearest",
                {{"velocity", RoundedTo(kRateUnit, limits.velocity)},
                 {"torque", RoundedTo(kRateUnit, limits.torque)},
                 {"contact", RoundedTo(kRateUnit, limits.contact)}}}};
  AddSamples(sampled, &json);
  return json;
}

}  // namespace legopt::client
