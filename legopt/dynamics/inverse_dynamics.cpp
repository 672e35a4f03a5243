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
  const std::vector<BodyMass> masses = BodyMassesOf(robot);
  for (size_t b = 0; b < bodies_.size(); ++b) bodies_[b].properties = masses[b];
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
  const Eigen::Vector3d com = R * body.properties.com;
  state.force =
      body.properties.mass * (state.rate + state.spin_rate.cross(com) + state.spin.cross(state.spin.cross(com)));
  // The inertia in world axes times a vector, without forming it.
  const auto inertia_times = [&](const Eigen::Vector3d& w) -> Eigen::Vector3d {
    return R * (body.properties.inertia * (R.transpose() * w));
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
