#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "legopt/types/task.h"

namespace legopt {

/// Content of a `dataset.yaml`: file names and constants, not yet resolved.
///
/// All keys of the file (paths are relative to the folder, use forward slashes and stay inside it):
///
///     format: legopt-dataset/1            # required
///     name: garage-small                  # required, shown in tables
///     robot: robot.urdf                   # required, URDF; its collision meshes must be in the folder
///     scene: scene.yaml                   # required, scene.yaml (scene_file.h) or one mesh: .stl .obj .dae .ply
///     problems:                           # required, at least one task; LegOpt JSON (problem_file.h)
///       posture: problems-posture.json
///       motion: problems-motion.json
///     feet: [l_foot, r_foot]              # required, links with collision geometry
///     sole_offset_m: 0.082351             # required, >= 0: link frame above the contact frame along the normal
///     gravity_m_s2: 9.797930195020351     # optional, default as shown
///     nominal_posture:                    # optional, joint: rad (m for prismatic); joints not named are 0
///       l_leg_kny: 0.872664626
///     self_collision_reference:           # optional, joint: rad; link pairs touching here are never checked
///       back_lbz: 0.349055556
///     files:                              # required: every used file and the BLAKE2b-256 of its bytes
///       robot.urdf: 5c1e...               # (64 hex digits); `legopt dataset hash` writes them
struct DatasetDescription {
  std::string name;                                        ///< shown in tables
  std::string robot_file;                                  ///< URDF, relative to the folder
  std::string scene_file;                                  ///< scene.yaml or a mesh, relative to the folder
  EnumArray<Task, std::string> problem_files;              ///< empty: the dataset has no problems of this task
  std::vector<std::string> feet;                           ///< names of the links that may support the robot
  double sole_offset_m = 0;                                ///< height of a foot's link frame above its contact frame,
                                                           ///< >= 0
  double gravity_m_s2 = kBenchmarkGravity_m_s2;            ///< > 0
  std::map<std::string, double> nominal_posture;           ///< joint name -> rad, before clamping
  std::map<std::string, double> self_collision_reference;  ///< joint name -> rad
  std::map<std::string, std::string> files;                ///< path -> expected hash; empty for a bare folder
  bool bare = false;                                       ///< true: a LegOpt-style folder without dataset.yaml

  /// Gravitational acceleration of the benchmark: OpenRAVE's altitude and latitude formula for Tokyo.
  static constexpr double kBenchmarkGravity_m_s2 = 9.797930195020351;
};

/// File that distinguishes a dataset's folder from a bare one.
inline constexpr const char* kDatasetFileName = "dataset.yaml";
/// Value of the key `format` that this program reads and writes.
inline constexpr const char* kDatasetFormat = "legopt-dataset/1";

/// Reads `folder`/dataset.yaml. Throws InputError for a missing file, invalid YAML, an unknown or missing key, a value
/// of the wrong type or range, or a path that leaves the folder.
DatasetDescription ReadDatasetFile(const std::filesystem::path& folder);

/// Reads the description of a folder: dataset.yaml if there is one, else that of a LegOpt-style folder
/// (legopt_folder.h).
DatasetDescription DescribeDataset(const std::filesystem::path& folder);

}  // namespace legopt
