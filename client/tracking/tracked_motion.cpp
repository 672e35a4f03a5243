#include "client/tracking/tracked_motion.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "client/tracking/force_distribution.h"
#include "client/tracking/rigid_body_world.h"
#include "legopt/dynamics/inverse_dynamics.h"
#include "legopt/dynamics/motion_forces.h"
#include "legopt/dynamics/motion_timer.h"
#include "legopt/robot/configuration.h"
#include "legopt/robot/kinematics.h"
#include "legopt/statics/stance_forces.h"

namespace legopt::client {
namespace {

constexpr double kFall_m = 0.2, kFall_rad = 0.5;
constexpr double kUnbalanced = 0.01;  // imbalance of ForceDistribution, in weights

/// Returns the difference of two configurations as a tangent, n + 6.
Eigen::VectorXd Difference(const Eigen::VectorXd& to, const Eigen::VectorXd& from) {
  const Eigen::Index n = to.size() - 7;
  Eigen::VectorXd difference(n + 6);
  difference.head(n + 3) = (to - from).head(n + 3);
  const Eigen::AngleAxisd turn(PartsOf(to).base_rotation() * PartsOf(from).base_rotation().inverse());
  difference.tail<3>() = turn.angle() * turn.axis();
  return difference;
}

class Tracker {
 public:
  Tracker(const Dataset& dataset, TimedMotion* motion, const TrackingOptions& options)
      : dataset_(dataset),
        motion_(*motion),
        options_(options),
        phases_(motion->Phases()),
        kinematics_(dataset.robot()),
        dynamics_(dataset.robot()),
        forces_(dataset.robot(), dataset.gravity_m_s2()),
        bounded_forces_(dataset.robot(), dataset.gravity_m_s2()),
        world_(dataset, motion->At(0.0).x),
        torques_(Eigen::VectorXd::Zero(dataset.robot().num_dofs())) {}

  TrackedMotion Run() {
    result_.duration_s = options_.slowdown * motion_.duration_s();
    const int steps = static_cast<int>(std::ceil((result_.duration_s + options_.rest_s) / options_.step_s));
    for (int step = 0; step < steps && !result_.falls; ++step) {
      const double time_s = step * options_.step_s;
      if (step % options_.control_steps == 0) Control(time_s);
      world_.Step(torques_, options_.step_s);
    }
    if (controls_ > 0) {
      result_.saturated_share = static_cast<double>(saturated_) / controls_;
      result_.unbalanced_share = static_cast<double>(unbalanced_) / controls_;
    }
    return result_;
  }

 private:
  /// State of the motion at a time of the simulation; at rest after its end.
  MotionSample WantedAt(double time_s) {
    const double s = time_s / options_.slowdown;
    MotionSample wanted = motion_.At(std::min(s, motion_.duration_s()));
    const double rate = s < motion_.duration_s() ? 1.0 / options_.slowdown : 0.0;
    wanted.velocity *= rate;
    wanted.acceleration *= rate * rate;
    return wanted;
  }

  void EnterPhase(double motion_s) {
    std::size_t phase = phase_.value_or(0);
    while (phase + 1 < phases_.size() && motion_s >= phases_[phase].end_s) ++phase;
    if (phase_ == phase) return;
    phase_ = phase;
    world_.Hold(phases_[phase].contacts);
    std::vector<TouchedSurface> surfaces = SurfacesOf(dataset_, phases_[phase].contacts, &kinematics_);
    for (TouchedSurface& surface : surfaces) surface.friction *= options_.friction_share;
    surfaces_.emplace(surfaces);
  }

  void Control(double time_s) {
    const MotionSample wanted = WantedAt(time_s);
    kinematics_.Update(world_.x());
    EnterPhase(wanted.time_s);
    const Eigen::VectorXd error = Difference(wanted.x, world_.x());
    Record(wanted, error, time_s);
    const Eigen::VectorXd acceleration = wanted.acceleration + options_.stiffness_1_s2 * error +
                                         options_.damping_1_s * (wanted.velocity - world_.velocity());
    dynamics_.Compute(kinematics_, world_.velocity(), acceleration, &inertial_);
    const Eigen::VectorXd& limits = dataset_.robot().effort_limits();
    const DistributedForces distributed = forces_.Compute(*surfaces_, kinematics_, inertial_);
    torques_ = distributed.torques;
    double imbalance = distributed.imbalance;
    if ((torques_.cwiseAbs() - limits).maxCoeff() > 0.0) {
      const RealizedForces bounded =
          bounded_forces_.Compute(*surfaces_, kinematics_, inertial_, MotionTimer::kCurveSlack);
      torques_ = bounded.torques;
      imbalance = bounded.imbalance;
    }
    ++controls_;
    if ((torques_.cwiseAbs() - limits).maxCoeff() > 0.0) ++saturated_;
    if (imbalance > kUnbalanced) ++unbalanced_;
    torques_ = torques_.cwiseMax(-limits).cwiseMin(limits).eval();
  }

  void Record(const MotionSample& wanted, const Eigen::VectorXd& error, double time_s) {
    const Eigen::Index n = dataset_.robot().num_dofs();
    const double base_m = error.segment<3>(n).norm(), tilt_rad = error.tail<3>().norm();
    if (!(base_m <= kFall_m && tilt_rad <= kFall_rad)) {  // also for NaN
      result_.falls = true;
      result_.fell_at_s = time_s;
      result_.fell_at_waypoint = wanted.parameter;
      return;
    }
    result_.base_error_m = std::max(result_.base_error_m, base_m);
    result_.joint_error_rad = std::max(result_.joint_error_rad, error.head(n).cwiseAbs().maxCoeff());
    for (const ContactTarget& target : phases_[*phase_].contacts.contacts) {
      const Contact& contact = dataset_.contact(target.contact);
      const Eigen::Vector3d place = kinematics_.link_pose(contact.link_index) * contact.X_LC.translation();
      result_.slip_m = std::max(result_.slip_m, (place - contact.OriginTarget(target)).norm());
    }
  }

  const Dataset& dataset_;
  TimedMotion& motion_;
  const TrackingOptions& options_;
  std::vector<MotionPhase> phases_;
  Kinematics kinematics_;
  InverseDynamics dynamics_;
  ForceDistribution forces_;
  MotionForces bounded_forces_;
  RigidBodyWorld world_;
  InertialForces inertial_;
  std::optional<std::size_t> phase_;
  std::optional<StanceForces> surfaces_;  ///< surfaces of the phase
  Eigen::VectorXd torques_;
  TrackedMotion result_;
  int controls_ = 0, saturated_ = 0, unbalanced_ = 0;
};

}  // namespace

TrackedMotion Track(const Dataset& dataset, TimedMotion* motion, const TrackingOptions& options) {
  return Tracker(dataset, motion, options).Run();
}

}  // namespace legopt::client
