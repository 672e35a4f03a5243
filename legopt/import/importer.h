#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "legopt/import/finding.h"
#include "legopt/import/source_layout.h"
#include "legopt/read_guard.h"

namespace legopt {

/// What to make a dataset from. Whatever is left out is found or decided, and the report says how.
struct ImportOptions {
  std::filesystem::path source;                   ///< folder
  SourceChoices files;                            ///< which files, where the user names some
  std::string name;                               ///< of the dataset; letters, digits, '-', '_'
  std::vector<std::string> feet;                  ///< default: the links that the problems name
  std::optional<double> sole_offset_m;            ///< default: lowest point of the feet, and 1 mm
  std::map<std::string, double> nominal_posture;  ///< joint -> rad; default: see ImportDataset
  bool fix_winding = false;                       ///< turn bodies of the scene that are inside out
  ReadGuard read_guard;                           ///< runs the readers of robot and meshes

  /// Throws InputError naming the flag that is out of range.
  void Validate() const;
};

/// What an import found out and decided.
struct ImportReport {
  std::vector<DatasetFinding> findings;  ///< in the order of the checks
  std::string content_hash;              ///< empty when the files cannot be a dataset
};

/// Makes a dataset from robot, scene and problems in `folder`, which exists and is empty, and checks it
/// (dataset_check.h). Nothing in the source is changed.
///
/// Robot: URDF with its collision meshes (robot_files.h), or COLLADA with kinematics (collada_robot.h). Scene: copied;
/// with `fix_winding` a mesh is written anew. Problems: copied byte by byte; written anew when their quaternions turn
/// out to be x y z w. Constants: those of the source's dataset.yaml if there is one; else, for a robot with the joints
/// of the benchmark's Atlas, those of the benchmark; else joints at 0 and the benchmark's gravity. A folder without
/// problems gives a dataset without problems, for `legopt generate problems`.
///
/// The dataset is complete, whatever was found; the caller decides what to do with one that has errors.
/// Throws InputError: see FindSources, the readers, and Dataset::Load; no feet; flags out of range.
ImportReport ImportDataset(const ImportOptions& options, const std::filesystem::path& folder);

}  // namespace legopt
