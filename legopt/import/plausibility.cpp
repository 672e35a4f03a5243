#include "legopt/import/plausibility.h"

#include <cmath>
#include <numbers>
#include <string>
#include <utility>

#include "legopt/robot/urdf_review.h"
#include "legopt/types/number_text.h"

namespace legopt {
namespace {

std::string Size(const Eigen::AlignedBox3d& box) {
  return FormatGeneral(box.sizes().x(), 4) + " x " + FormatGeneral(box.sizes().y(), 4) + " x " +
         FormatGeneral(box.sizes().z(), 4) + " m";
}

class PlausibilityCheck {
 public:
  explicit PlausibilityCheck(const Dataset& dataset) : dataset_(dataset) {}

  std::vector<DatasetDiagnostic> Run() {
    CheckSizes();
    CheckLimits();
    CheckMasses();
    const std::string file = dataset_.robot_file().string();
    for (UrdfDiagnostic& remark : ReviewUrdf(CheckUrdf(ReadUrdfFile(file), file))) {
      Warn("robot", remark.field, remark.value, remark.message, remark.fix);
    }
    return std::move(findings_);
  }

 private:
  void Warn(const std::string& check, const std::string& field, const std::string& value, const std::string& message,
            const std::string& fix) {
    findings_.push_back({DatasetDiagnostic::Severity::kWarning, check, "", field, value, message, fix});
  }

  void CheckSizes() {
    constexpr double kWideScene_m = 200.0, kLargeRobot_m = 10.0;
    if (dataset_.scene_bounds().sizes().maxCoeff() > kWideScene_m) {
      Warn("units", "scene", Size(dataset_.scene_bounds()), "is large for a legged robot; is it in millimetres?",
           "if so, scale it to metres (scale: 0.001 of a mesh in scene.yaml)");
    }
    if (dataset_.robot_bounds().sizes().maxCoeff() > kLargeRobot_m) {
      Warn("units", "robot", Size(dataset_.robot_bounds()), "is large for a robot; is it in millimetres?" + Furthest(),
           "if so, write metres in the URDF (scale=\"0.001 0.001 0.001\" of a mesh)");
    }
  }

  /// Returns the joint with the largest distance from its parent link.
  std::string Furthest() const {
    const Joint* furthest = nullptr;
    for (const Joint& joint : dataset_.robot().joints()) {
      if (furthest == nullptr || joint.origin.translation().norm() > furthest->origin.translation().norm()) {
        furthest = &joint;
      }
    }
    if (furthest == nullptr) return "";
    return " The joint '" + furthest->name + "' is " + FormatGeneral(furthest->origin.translation().norm(), 4) + " m" +
           " from the link before it";
  }

  void CheckLimits() {
    constexpr double kTurn_rad = 2.0 * std::numbers::pi + 0.1;
    std::string degrees, equal;
    for (const Joint& joint : dataset_.robot().joints()) {
      if (joint.type != JointType::kRevolute && joint.type != JointType::kPrismatic) continue;
      const std::string range =
          joint.name + " (" + FormatGeneral(joint.lower, 4) + " .. " + FormatGeneral(joint.upper, 4) + ")";
      const bool turns = joint.lower < -kTurn_rad || joint.upper > kTurn_rad;
      if (joint.type == JointType::kRevolute && turns) degrees += (degrees.empty() ? "" : ", ") + range;
      if (joint.lower == joint.upper) equal += (equal.empty() ? "" : ", ") + range;
    }
    if (!degrees.empty()) {
      Warn("units", degrees, "", "have limits of more than a turn; are they in degrees?",
           "limits are in radians: 90 degrees are 1.5708");
    }
    if (!equal.empty()) {
      Warn("robot", equal, "", "have a lower limit equal to the upper one, and cannot move",
           "give them a range, or type fixed");
    }
  }

  /// Checks masses per body: of links connected by fixed joints, one may carry the mass of all.
  void CheckMasses() {
    const RobotModel& robot = dataset_.robot();
    std::vector<double> mass(static_cast<size_t>(robot.num_bodies()), 0.0);
    std::vector<std::string> shaped(mass.size());
    for (int link = 0; link < std::ssize(robot.links()); ++link) {
      const auto body = static_cast<size_t>(robot.link_body(link));
      const Link& part = robot.links()[static_cast<size_t>(link)];
      mass[body] += part.mass;
      if (shaped[body].empty() && !part.collision.empty()) shaped[body] = part.name;
    }
    std::string without;
    for (size_t body = 0; body < mass.size(); ++body) {
      if (mass[body] == 0.0 && !shaped[body].empty()) without += (without.empty() ? "" : ", ") + shaped[body];
    }
    if (without.empty()) return;
    Warn("robot", without, "0 kg", "have shapes, but no mass: balance and torques are those of a lighter robot",
         "give them <inertial> elements");
  }

  const Dataset& dataset_;
  std::vector<DatasetDiagnostic> findings_;
};

}  // namespace

std::vector<DatasetDiagnostic> CheckPlausibility(const Dataset& dataset) { return PlausibilityCheck(dataset).Run(); }

}  // namespace legopt
