#include "legopt/dynamics/internal/body_mass.h"

namespace legopt {

std::vector<BodyMass> BodyMassesOf(const RobotModel& robot) {
  std::vector<BodyMass> bodies(static_cast<size_t>(robot.num_bodies()));
  const auto in_body = [&](size_t l) { return robot.link_in_body(static_cast<int>(l)); };
  const auto body_of = [&](size_t l) -> BodyMass& {
    return bodies[static_cast<size_t>(robot.link_body(static_cast<int>(l)))];
  };
  for (size_t l = 0; l < robot.links().size(); ++l) {
    BodyMass& body = body_of(l);
    body.mass += robot.links()[l].mass;
    body.com += robot.links()[l].mass * (in_body(l) * robot.links()[l].com);
  }
  for (BodyMass& body : bodies) {
    if (body.mass > 0.0) body.com /= body.mass;
  }
  for (size_t l = 0; l < robot.links().size(); ++l) {
    const Link& link = robot.links()[l];
    BodyMass& body = body_of(l);
    const Eigen::Matrix3d R = in_body(l).linear();
    const Eigen::Vector3d r = in_body(l) * link.com - body.com;
    body.inertia += R * link.inertia * R.transpose() +
                    link.mass * (r.squaredNorm() * Eigen::Matrix3d::Identity() - r * r.transpose());
  }
  return bodies;
}

}  // namespace legopt
