#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "words/task.h"

namespace legopt {

/// What a `dataset.yaml` says: names of files and constants, nothing resolved yet.
///
/// The file, with all keys (paths are relative to the folder, with forward slashes, and stay inside it):
///
///     format: legopt-dataset/1            # required
///     name: garage-small                  # required, shown in tables
///     robot: robot.urdf                   # required, URDF; its collision meshes stand in the folder, too
///     scene: scene.yaml                   # required, scene.yaml (scene_file.h) or one mesh: .stl .obj .dae .ply
///     problems:                           # required, at least one task; LegOpt JSON (problem_file.h)
///       posture: problems-posture.json
///       motion: problems-motion.json
///     feet: [l_foot, r_foot]              # required, links with collision geometry
///     sole_offset_m: 0.082351             # required, >= 0: link frame above the sole target along the normal
///     gravity_m_s2: 9.797930195020351     # optional, default as shown
///     nominal_posture:                    # optional, joint: rad (m for prismatic); joints not named are 0
///       l_leg_kny: 0.872664626
///     self_collision_reference:           # optional, joint: rad; link pairs touching here are never checked
///       back_lbz: 0.349055556
///     files:                              # required: every used file and the BLAKE2b-256 of its bytes
///       robot.urdf: 5c1e...               # (64 hex digits); `legopt dataset hash` writes them
struct DatasetDescription {
  std::string name;                                        ///< of the dataset; shown in tables
  std::string robot_file;                                  ///< URDF, relative to the folder
  std::string scene_file;                                  ///< scene.yaml or a mesh, relative to the folder
  Per<Task, std::string> problem_files;                    ///< empty: none
  std::vector<std::string> feet;                           ///< names of the links that may stand
  double sole_offset_m = 0;                                ///< of a foot's link frame above its sole, >= 0
  double gravity_m_s2 = kBenchmarkGravity_m_s2;            ///< > 0
  std::map<std::string, double> nominal_posture;           ///< joint name -> rad, before clamping
  std::map<std::string, double> self_collision_reference;  ///< joint name -> rad
  std::map<std::string, std::string> files;                ///< path -> expected hash; empty for a bare folder
  bool bare = false;                                       ///< true: a LegOpt-style folder without dataset.yaml

  /// The benchmark's gravity: OpenRAVE's altitude and latitude formula for Tokyo.
  static constexpr double kBenchmarkGravity_m_s2 = 9.797930195020351;
};

/// What a folder must hold to be a dataset and not bare.
inline constexpr const char* kDatasetFileName = "dataset.yaml";
/// Value of its key `format` that this program reads and writes.
inline constexpr const char* kDatasetFormat = "legopt-dataset/1";

/// Reads `folder`/dataset.yaml. Throws InputError for a missing file, broken YAML, an unknown or missing key, a value
/// of the wrong kind or range, or a path that leaves the folder.
DatasetDescription ReadDatasetFile(const std::filesystem::path& folder);

/// What the folder says: its dataset.yaml when there is one, else the LegOpt-style folder (legopt_folder.h).
DatasetDescription DescribeDataset(const std::filesystem::path& folder);

}  // namespace legopt
