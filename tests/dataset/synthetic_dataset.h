#pragma once

#include <Eigen/Core>
#include <filesystem>

#include "legopt/dataset/dataset.h"

namespace legopt::test {

/// A small dataset of primitives and one mesh, so that tests need no external data.
///
/// Robot: a trunk on two straight legs of 0.5 m (hip and ankle pitch), flat feet at y = +-0.1 whose soles are 0.05 m
/// below the foot frames, two arms that swing sideways, a head on a prismatic joint, a continuous lidar. Joint order
/// l_hip l_ankle r_hip r_ankle l_shoulder r_shoulder neck lidar. Scene: ground with its top at z = 0, a column next to
/// the left arm, a mesh far away. sole_offset_m 0.051. Posture problems 0 and 7: both feet at x = 0; motion problem 0:
/// both feet, left foot, both feet.
class SyntheticFolder {
 public:
  explicit SyntheticFolder(const std::filesystem::path& folder);  ///< writes all files, including hashes
  const std::filesystem::path& path() const { return folder_; }

 private:
  std::filesystem::path folder_;
};

inline constexpr int kSyntheticDofs = 8;
inline constexpr int kBaseX = kSyntheticDofs;  ///< index of the base position in a state
inline constexpr int kBaseY = kSyntheticDofs + 1;
inline constexpr int kQuaternionW = kSyntheticDofs + 3;
inline constexpr int kLeftHip = 0, kLeftAnkle = 1, kRightHip = 2, kRightAnkle = 3;
inline constexpr int kLeftShoulder = 4, kRightShoulder = 5, kNeck = 6, kLidar = 7;
inline constexpr double kSyntheticLeg_m = 0.5;
inline constexpr double kSyntheticSoleOffset_m = 0.051;

/// Returns a configuration that solves posture problem 0: joints 0, soles 1 mm above the ground.
Eigen::VectorXd StandingUpright();

/// Returns StandingUpright with both legs leaning: feet stay on their targets, the trunk moves forward by 0.5
/// sin(angle).
Eigen::VectorXd Leaning(double angle_rad);

}  // namespace legopt::test
