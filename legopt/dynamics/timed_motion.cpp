#include "legopt/dynamics/timed_motion.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

#include "legopt/dataset/contact.h"
#include "legopt/types/invariant.h"

namespace legopt {
namespace {

bool SameContacts(const Stance& a, const Stance& b) {
  return std::ranges::equal(a.contacts, b.contacts, [](const ContactTarget& one, const ContactTarget& other) {
    return one.contact == other.contact && one.position == other.position &&
           one.rotation.coeffs() == other.rotation.coeffs() && one.friction == other.friction &&
           one.slide_m == other.slide_m && one.carries == other.carries;
  });
}

}  // namespace

TimedMotion::TimedMotion(const Dataset& dataset, MotionTiming timing, std::span<const Stance* const> stances,
                         std::span<const double> times, std::span<const Eigen::VectorXd> points)
    : timing_(std::move(timing)),
      spline_({times.begin(), times.end()}, points),
      kinematics_(dataset.robot()),
      dynamics_(dataset.robot()),
      forces_(dataset.robot(), dataset.gravity_m_s2()) {
  CheckInvariant(timing_.times_s.size() >= 2, "a timed motion has a time law");
  for (size_t w = 0; w < stances.size(); ++w) {
    waypoints_.push_back(MakePart(dataset, *stances[w]));
    if (w == 0) continue;
    planted_.push_back(PlantedContacts(dataset, *stances[w - 1], *stances[w]));
    segments_.push_back(MakePart(dataset, planted_.back()));
  }
}

TimedMotion::Part TimedMotion::MakePart(const Dataset& dataset, const Stance& contacts) {
  std::vector<TouchedSurface> surfaces = SurfacesOf(dataset, contacts);
  Part part{.names = {}, .surfaces = surfaces, .forces = StanceForces(surfaces)};
  for (const ContactTarget& target : contacts.contacts) {
    if (target.carries) part.names.push_back(target.contact);
  }
  return part;
}

std::vector<ContactForce> TimedMotion::PointsOf(const Part& part) {
  std::vector<ContactForce> points;
  for (const StanceForces::Point& point : part.forces.points()) {
    const auto index = static_cast<size_t>(point.surface);
    const TouchedSurface& surface = part.surfaces[index];
    points.push_back({.contact = part.names[index],
                      .link = point.link,
                      .position_W = point.position_W,
                      .force_N = Eigen::Vector3d::Zero(),
                      .normal_W = surface.axes_W.col(2),
                      .friction = surface.max_component ? std::nullopt : std::optional(surface.friction)});
  }
  return points;
}

TimedMotion::Progress TimedMotion::ProgressAt(double time_s) const {
  const std::vector<double>& times = timing_.times_s;
  if (time_s >= times.back()) return {.s = timing_.parameters.back()};
  const auto after = std::ranges::upper_bound(times, std::max(0.0, time_s));
  const auto k = static_cast<size_t>(std::distance(times.begin(), after)) - 1;
  const double begin = timing_.parameters[k], width = timing_.parameters[k + 1] - begin;
  const double u = (timing_.speed_squares[k + 1] - timing_.speed_squares[k]) / (2.0 * width);
  const double speed = std::sqrt(std::max(0.0, timing_.speed_squares[k])), elapsed_s = std::max(0.0, time_s) - times[k];
  return {.s = begin + std::clamp(elapsed_s * (speed + 0.5 * u * elapsed_s), 0.0, width),
          .speed = std::max(0.0, speed + u * elapsed_s),
          .acceleration = u};
}

MotionSample TimedMotion::At(double time_s) {
  const Progress progress = ProgressAt(time_s);
  spline_.Evaluate(progress.s, &point_);
  MotionSample sample;
  sample.time_s = std::clamp(time_s, 0.0, duration_s());
  sample.parameter = progress.s;
  sample.x = point_.x;
  sample.velocity = progress.speed * point_.velocity;
  sample.acceleration = progress.acceleration * point_.velocity + progress.speed * progress.speed * point_.bend;
  kinematics_.Update(point_.x);
  dynamics_.Compute(kinematics_, sample.velocity, sample.acceleration, &inertial_);
  const double whole = std::floor(progress.s);
  const bool at_waypoint = progress.s == whole;
  const Part& part = (at_waypoint ? waypoints_ : segments_)[static_cast<size_t>(whole)];
  RealizedForces realized = forces_.Compute(part.forces, kinematics_, inertial_,
                                            at_waypoint ? MotionTimer::kRestSlack : MotionTimer::kCurveSlack);
  sample.forces = PointsOf(part);
  for (size_t k = 0; k < sample.forces.size(); ++k) sample.forces[k].force_N = realized.forces_N[k];
  sample.torques = std::move(realized.torques);
  sample.imbalance = realized.imbalance;
  return sample;
}

double TimedMotion::TimeOf(double waypoint) const {
  const auto found = std::ranges::lower_bound(timing_.parameters, waypoint);
  return timing_.times_s[static_cast<size_t>(std::distance(timing_.parameters.begin(), found))];
}

std::vector<MotionPhase> TimedMotion::Phases() const {
  std::vector<MotionPhase> phases;
  for (size_t w = 0; w < planted_.size(); ++w) {
    const double end_s = TimeOf(static_cast<double>(w + 1));
    if (!phases.empty() && SameContacts(phases.back().contacts, planted_[w])) {
      phases.back().end_s = end_s;
    } else {
      phases.push_back({.begin_s = TimeOf(static_cast<double>(w)), .end_s = end_s, .contacts = planted_[w]});
    }
  }
  return phases;
}

std::vector<double> SampleTimes(double duration_s, double rate_hz, int most) {
  constexpr double kRounding = 1e-9;  // share of an interval
  double step_s = 1.0 / rate_hz;
  if (duration_s / step_s > most - 1) step_s = duration_s / (most - 1);
  std::vector<double> times = {0.0};
  for (int k = 1; k * step_s < duration_s - kRounding * step_s; ++k) times.push_back(k * step_s);
  times.push_back(duration_s);
  return times;
}

}  // namespace legopt
