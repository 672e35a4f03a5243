// Time budgets of kinematics. Forward kinematics and centre of mass: at most 3 us, target 1 us. All Jacobians, and
// torques with derivatives: at most 10 us, target 3 us.

#include <benchmark/benchmark.h>

#include "legopt/robot/kinematics.h"
#include "tests/folders.h"

namespace legopt {
namespace {

RobotModel Humanoid() { return RobotModel::FromUrdfFile(SourceFolder() + "/data/garage-small/robot.urdf"); }

Eigen::VectorXd SomeConfiguration(const RobotModel& model) {
  Eigen::VectorXd x = Eigen::VectorXd::LinSpaced(model.configuration_size(), -0.4, 0.6);
  x[model.num_dofs() + 3] = 1.0;
  return x;
}

void ForwardKinematicsAndCom(benchmark::State& state) {
  const RobotModel model = Humanoid();
  Kinematics kinematics(model);
  Eigen::VectorXd x = SomeConfiguration(model);
  for (auto _ : state) {
    x[0] += 1e-9;
    kinematics.Update(x);
    benchmark::DoNotOptimize(kinematics.com().data());
  }
}
BENCHMARK(ForwardKinematicsAndCom);

void AllDerivatives(benchmark::State& state) {
  const RobotModel model = Humanoid();
  Kinematics kinematics(model);
  kinematics.Update(SomeConfiguration(model));
  const int left = model.FindLink("l_foot");
  const int right = model.FindLink("r_foot");
  Eigen::MatrixXd point(3, model.tangent_size()), angular(3, model.tangent_size()), com(3, model.tangent_size());
  Eigen::MatrixXd torque(model.num_dofs(), model.tangent_size());
  Eigen::VectorXd tau(model.num_dofs());
  for (auto _ : state) {
    for (const int foot : {left, right}) {
      kinematics.PointJacobian(foot, kinematics.link_pose(foot).translation(), point);
      kinematics.AngularJacobian(foot, angular);
    }
    kinematics.ComJacobian(com);
    kinematics.GravityTorques(9.8, tau);
    kinematics.GravityTorqueJacobian(9.8, torque);
    benchmark::DoNotOptimize(torque.data());
    benchmark::ClobberMemory();
  }
}
BENCHMARK(AllDerivatives);

}  // namespace
}  // namespace legopt
