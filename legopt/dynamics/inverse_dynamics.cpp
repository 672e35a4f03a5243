#include "legopt/dynamics/inverse_dynamics.h"

#include "legopt/robot/configuration.h"

namespace legopt {

InverseDynamics::InverseDynamics(const RobotModel& robot)
    : robot_(&robot), bodies_(static_cast<size_t>(robot.num_bodies())), states_(bodies_.size()) {
  for (size_t b = 1; b < bodies_.size(); ++b) {
    Body& body = bodies_[b];
    body.joint = &robot.joints()[static_cast<size_t>(robot.body_joint(static_cast<int>(b)))];
    body.link = body.joint->child_link;
    body.parent = robot.body_parent(static_cast<int>(b));
  }
  const auto in_body = [&](size_t l) { return robot.link_in_body(static_cast<int>(l)); };
  const auto body_of = [&](size_t l) -> Body& {
    return bodies_[static_cast<size_t>(robot.link_body(static_cast<int>(l)))];
  };
  for (size_t l = 0; l < robot.links().size(); ++l) {
    Body& body = body_of(l);
    body.mass += robot.links()[l].mass;
    body.com += robot.links()[l].mass * (in_body(l) * robot.links()[l].com);
  }
  for (Body& body : bodies_) {
    if (body.mass > 0.0) body.com /= body.mass;
  }
  for (size_t l = 0; l < robot.links().size(); ++l) {
    const Link& link = robot.links()[l];
    Body& body = body_of(l);
    const Eigen::Matrix3d R = in_body(l).linear();
    const Eigen::Vector3d r = in_body(l) * link.com - body.com;
    body.inertia += R * link.inertia * R.transpose() +
                    link.mass * (r.squaredNorm() * Eigen::Matrix3d::Identity() - r * r.transpose());
  }
}

void InverseDynamics::Propagate(const Body& body, double speed, double acceleration, State* state) const {
  const State& parent = states_[static_cast<size_t>(body.parent)];
  const Eigen::Vector3d arm = state->origin_W - parent.origin_W;
  state->spin = parent.spin;
  state->spin_rate = parent.spin_rate;
  state->rate = parent.rate + parent.spin_rate.cross(arm) + parent.spin.cross(parent.spin.cross(arm));
  const Eigen::Vector3d turned = parent.spin.cross(speed * state->axis_W);
  if (body.joint->type == JointType::kPrismatic) {
    state->rate += 2.0 * turned + acceleration * state->axis_W;
  } else {
    state->spin += speed * state->axis_W;
    state->spin_rate += turned + acceleration * state->axis_W;
  }
}

void InverseDynamics::SetInertialForces(const Kinematics& kinematics, size_t b) {
  const Body& body = bodies_[b];
  State& state = states_[b];
  const Eigen::Matrix3d R = kinematics.link_pose(body.link).linear();
  const Eigen::Vector3d com = R * body.com;
  state.force = body.mass * (state.rate + state.spin_rate.cross(com) + state.spin.cross(state.spin.cross(com)));
  // The inertia in world axes times a vector, without forming it.
  const auto inertia_times = [&](const Eigen::Vector3d& w) -> Eigen::Vector3d {
    return R * (body.inertia * (R.transpose() * w));
  };
  state.moment = inertia_times(state.spin_rate) + state.spin.cross(inertia_times(state.spin)) + com.cross(state.force);
}

void InverseDynamics::Compute(const Kinematics& kinematics, Eigen::Ref<const Eigen::VectorXd> velocity,
                              Eigen::Ref<const Eigen::VectorXd> acceleration, InertialForces* forces) {
  const auto speed = TangentPartsOf(velocity), change = TangentPartsOf(acceleration);
  State& base = states_.front();
  base.origin_W = kinematics.link_pose(0).translation();
  base.spin = speed.base_rotation();
  base.spin_rate = change.base_rotation();
  base.rate = change.base_position();
  for (size_t b = 0; b < bodies_.size(); ++b) {
    const Body& body = bodies_[b];
    if (body.joint != nullptr) {
      const Eigen::Isometry3d& pose = kinematics.link_pose(body.link);
      states_[b].origin_W = pose.translation();
      states_[b].axis_W = pose.linear() * body.joint->axis;
      const double multiplier = body.joint->multiplier;
      Propagate(body, multiplier * velocity[body.joint->dof], multiplier * acceleration[body.joint->dof], &states_[b]);
    }
    SetInertialForces(kinematics, b);
  }
  forces->torques.setZero(robot_->num_dofs());
  for (size_t b = bodies_.size(); b-- > 1;) {
    const Body& body = bodies_[b];
    const State& state = states_[b];
    const Eigen::Vector3d& load = body.joint->type == JointType::kPrismatic ? state.force : state.moment;
    forces->torques[body.joint->dof] += body.joint->multiplier * state.axis_W.dot(load);
    State& parent = states_[static_cast<size_t>(body.parent)];
    parent.force += state.force;
    parent.moment += state.moment + (state.origin_W - parent.origin_W).cross(state.force);
  }
  forces->force_N = base.force;
  forces->moment_Nm = base.moment - (kinematics.com() - base.origin_W).cross(base.force);
}

}  // namespace legopt
