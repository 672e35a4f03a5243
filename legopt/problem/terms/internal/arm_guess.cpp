#include "legopt/problem/terms/internal/arm_guess.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "legopt/math/random_numbers.h"
#include "legopt/robot/kinematics.h"

namespace legopt {
namespace {

/// Searches the posture of one arm.
class ArmSearch {
 public:
  ArmSearch(const Dataset& dataset, const ContactTarget& target, Kinematics& kinematics)
      : dataset_(dataset),
        contact_(dataset.contact(target.contact)),
        kinematics_(kinematics),
        axis_(contact_.facts().free_rotation == FreeRotation::kAboutBar ? 0 : 2),
        position_W_(contact_.OriginTarget(target)),
        axis_W_(target.rotation.normalized().toRotationMatrix().col(axis_)),
        dofs_(ArmDofs(dataset, contact_)) {}

  /// Sets the arm's joints of x.
  void Search(std::mt19937_64& generator, Eigen::VectorXd& x) {
    constexpr int kAnywhere = 150, kNearby = 150;
    constexpr double kFirstWidth = 0.3, kLastWidth = 0.03;  // shares of the joints' ranges
    Eigen::VectorXd trial = x;
    double least = Error(x);
    for (int k = 0; k < kAnywhere + kNearby; ++k) {
      const double progress = static_cast<double>(k - kAnywhere) / kNearby;
      const double width = k < kAnywhere ? 1.0 : kFirstWidth * std::pow(kLastWidth / kFirstWidth, progress);
      for (const int dof : dofs_) {
        const double low = Low(dof), high = High(dof);
        const double middle = k < kAnywhere ? 0.5 * (low + high) : x[dof];
        const double drawn = middle + width * (high - low) * (UniformRandom(generator) - 0.5);
        trial[dof] = std::clamp(drawn, low, high);
      }
      const double error = Error(trial);
      if (!(error < least)) continue;
      least = error;
      x = trial;
    }
  }

 private:
  double Low(int dof) const { return std::max(dataset_.robot().lower_limits()[dof], -std::numbers::pi); }
  double High(int dof) const { return std::min(dataset_.robot().upper_limits()[dof], std::numbers::pi); }

  double Error(const Eigen::VectorXd& x) {
    constexpr double kLever_m = 0.3;
    kinematics_.UpdatePoses(x);
    const Eigen::Isometry3d X_WC = kinematics_.link_pose(contact_.link_index) * contact_.X_LC;
    // |a - b| = 2 sin(angle / 2) for unit vectors
    return (X_WC.translation() - position_W_).norm() + kLever_m * (X_WC.linear().col(axis_) - axis_W_).norm();
  }

  const Dataset& dataset_;
  const Contact& contact_;
  Kinematics& kinematics_;
  int axis_;
  Eigen::Vector3d position_W_, axis_W_;
  std::vector<int> dofs_;
};

}  // namespace

std::vector<int> ArmDofs(const Dataset& dataset, const Contact& contact) {
  const RobotModel& robot = dataset.robot();
  const std::vector<int>& trunk = robot.body_chain(robot.link_body(dataset.trunk().link));
  std::vector<int> dofs;
  for (const int body : robot.body_chain(robot.link_body(contact.link_index))) {
    if (std::ranges::find(trunk, body) != trunk.end()) continue;
    dofs.push_back(robot.joints()[static_cast<size_t>(robot.body_joint(body))].dof);
  }
  return dofs;
}

void BringHandsNear(const Dataset& dataset, const Stance& stance, Eigen::VectorXd& x) {
  Kinematics kinematics(dataset.robot());
  for (const ContactTarget& target : stance.contacts) {
    if (dataset.contact(target.contact).facts().supports) continue;
    std::mt19937_64 generator;  // NOLINT(cert-msc32-c,cert-msc51-cpp): the same numbers each time, on purpose
    ArmSearch(dataset, target, kinematics).Search(generator, x);
  }
}

}  // namespace legopt
