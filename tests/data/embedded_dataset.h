#pragma once

#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "legopt/dataset/dataset.h"
#include "legopt/geometry/collision_model.h"
#include "legopt/geometry/collision_query.h"
#include "legopt/geometry/scene.h"
#include "legopt/robot/kinematics.h"
#include "legopt/robot/robot_model.h"
#include "tests/folders.h"

namespace legopt {

/// Returns the dataset under test, which is loaded once per test program.
inline const std::shared_ptr<const Dataset>& EmbeddedDataset() {
  static const std::shared_ptr<const Dataset> dataset = Dataset::Load(SourceFolder() + "/data/garage-small");
  return dataset;
}

/// One rigid shape that can be placed anywhere in a scene to query its contacts.
class Probe {
 public:
  Probe(const ShapeSpec& shape, const Scene& scene)
      : robot_("probe", {Link{.name = "probe", .collision = {shape}}}, {}),
        kinematics_(robot_),
        query_(CollisionModel::Build(robot_, scene, Configuration(Eigen::Isometry3d::Identity()))) {}

  /// Returns all contacts nearer than `margin_m` with the shape's owner frame at `pose` in the world. The normals
  /// point from the scene to the probe. Valid until the next call.
  std::span<const ProximityPair> Contacts(const Eigen::Isometry3d& pose, double margin_m) {
    kinematics_.Update(Configuration(pose));
    return query_.Contacts(kinematics_, margin_m);
  }

 private:
  static Eigen::VectorXd Configuration(const Eigen::Isometry3d& pose) {
    const Eigen::Quaterniond rotation(pose.linear());
    Eigen::VectorXd x(7);
    x << pose.translation(), rotation.w(), rotation.x(), rotation.y(), rotation.z();
    return x;
  }

  RobotModel robot_;
  Kinematics kinematics_;
  CollisionQuery query_;
};

}  // namespace legopt
