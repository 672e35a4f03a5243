#pragma once

#include <Eigen/Geometry>
#include <filesystem>
#include <memory>
#include <numbers>

#include "legopt/dataset/dataset.h"
#include "legopt/dataset/internal/dataset_file.h"
#include "legopt/types/read_guard.h"

namespace legopt {

/// Level ground and a ramp on which an imported robot must be able to stand: a dataset with the robot of the import in
/// a subfolder, which exists as long as this object.
class StandingStage {
 public:
  /// Slope of the ramp: 10 degrees.
  static constexpr double kSlope_rad = std::numbers::pi / 18.0;
  /// Name of the subfolder.
  static constexpr const char* kFolderName = ".standing";

  /// `folder`: contains the robot of `description`, whose meshes are hard-linked. Throws InputError like Dataset::Load.
  StandingStage(const DatasetDescription& description, const std::filesystem::path& folder, const ReadGuard& guard);

  const std::shared_ptr<const Dataset>& dataset() const { return dataset_; }

 private:
  /// Folder that is removed with this object.
  struct OwnFolder {
    explicit OwnFolder(std::filesystem::path folder);
    ~OwnFolder();
    OwnFolder(const OwnFolder&) = delete;
    OwnFolder& operator=(const OwnFolder&) = delete;
    std::filesystem::path path;
  };

  OwnFolder folder_;
  std::shared_ptr<const Dataset> dataset_;
};

/// Returns the frame in which the robot stands: x and y along the surface, z its normal. On the ramp, x is uphill.
Eigen::Isometry3d StandingFrame(bool on_ramp);

/// Returns the stance, in a frame of StandingFrame, in which every contact is below its place in the configuration `x`
/// (n + 7, base upright).
Stance StanceBelow(const Dataset& stage, const Eigen::VectorXd& x, const Eigen::Isometry3d& X_WF);

}  // namespace legopt
