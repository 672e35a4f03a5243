#pragma once

#include <filesystem>

#include "legopt/dataset/dataset_file.h"

namespace legopt {

/// Returns true if `folder` contains problemsposture.json or problemsmotion.json.
bool IsLegOptFolder(const std::filesystem::path& folder);

/// Describes a bare LegOpt-style folder, without dataset.yaml. It contains problemsposture.json and/or
/// problemsmotion.json, exactly one `*.urdf` in the folder or below, and exactly one scene mesh directly in the folder.
///
/// All other values are those of the benchmark's Atlas (docs/explanation/paper.md#the-atlas): feet l_foot and r_foot,
/// contact frame offset 0.082351 m, gravity 9.797930195020351 m/s^2, knees 50 deg, hip and ankle pitch -25 deg,
/// l_arm_shx -1.3 and r_arm_shx 1.3 rad, self-collision reference back_lbz = back_ubx = 20 * 3.1415 / 180 rad. A robot
/// with other joint names needs a dataset.yaml. Throws InputError if a file is missing or ambiguous.
DatasetDescription DescribeLegOptFolder(const std::filesystem::path& folder);

/// Sets the constants of the benchmark's Atlas (see DescribeLegOptFolder): feet, contact frame offset, gravity, nominal
/// posture, self-collision reference.
void SetBenchmarkConstants(DatasetDescription* description);

}  // namespace legopt
