#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "legopt/import/internal/dataset_diagnostic.h"
#include "legopt/import/internal/source_layout.h"
#include "legopt/import/internal/standing_check.h"
#include "legopt/import/scene_repair.h"
#include "legopt/robot/internal/mesh_lookup.h"
#include "legopt/types/read_guard.h"

namespace legopt {

/// Options of an import. Missing ones are detected or have defaults, which the report lists.
struct ImportOptions {
  std::filesystem::path source;  ///< source folder, or a robot's file
  SourceChoices files;           ///< files that the user selected explicitly
  std::string name;              ///< name of the dataset; letters, digits, '-', '_'
  /// Links, or numbers in the list of ends that an import without them throws. Default: the links that the problems
  /// use, else those found (contact_finder.h).
  std::vector<std::string> contacts;
  /// Asks which of the robot's ends, lowest first, are contacts, if they are not clear; returns links or numbers in
  /// this list, or nothing. Null: an import that is not clear throws.
  std::function<std::vector<std::string>(const std::vector<std::string>& ends)> ask_contacts = {};
  std::string trunk;                              ///< link; default: found (trunk_choice.h)
  std::optional<double> sole_offset_m;            ///< default: depth of the feet's lowest point plus 1 mm
  std::map<std::string, double> nominal_posture;  ///< joint -> rad; default: see ImportDataset
  bool prove = true;                              ///< require that the robot stands (standing_proof.h)
  /// Sampled postures for self_collision_pairs.h; 0: the rule of the reference posture. Default: 10,000 for robots
  /// whose source has no constants, else the source's rule.
  std::optional<int> self_collision_samples;
  std::int64_t self_collision_seed = 1;  ///< seed of these postures
  bool collision_from_visual = false;    ///< links without collision geometry get their visual geometry
  std::optional<double> mesh_scale;      ///< factor for all meshes of the robot, > 0; default: 1
  MeshSearch meshes;                     ///< how the robot's mesh files are found
  SceneRepairOptions scene;              ///< changes to the scene; its guard is not used
  ReadGuard read_guard;                  ///< runs the parsers of robot and meshes

  /// Throws InputError with the flag that is out of range.
  void Validate() const;
};

/// Result of an import.
struct ImportReport {
  std::vector<DatasetDiagnostic> findings;  ///< ordered by check
  std::string content_hash;                 ///< empty if the files do not form a dataset
  std::vector<RebuiltObject> scene;         ///< objects of a scene that was rebuilt (scene_repair.h); else empty
  std::optional<StandingRobot> standing;    ///< nothing without a proof
};

/// Creates a dataset from robot, scene and problems in `folder`, which must exist and be empty, and checks it
/// (dataset_check.h). Does not change the source.
///
/// Robot: URDF with its collision meshes (copied_robot.h), or COLLADA with kinematics (collada_robot.h). Scene: copied;
/// meshes whose faults can be repaired without a new surface are rewritten, and all of them with options for the scene.
/// Problems: copied byte by byte; rewritten if their quaternions are x y z w. Constants: those of the source's
/// dataset.yaml if there is one; else, for a robot with the joints of the benchmark's Atlas, those of the benchmark;
/// else a nominal posture that is searched (nominal_posture.h) and the benchmark's gravity. At the end, one stance on
/// level ground and one on a slope of 10 degrees are solved and judged: a robot that cannot stand on the level is a
/// finding of severity error. A folder without problems gives a dataset without problems, for `legopt generate
/// problems`.
///
/// The dataset is complete even if the findings contain errors; the caller decides whether to keep it. Throws
/// InputError: see FindSources, the readers, and Dataset::Load; no feet; flags out of range.
ImportReport ImportDataset(const ImportOptions& options, const std::filesystem::path& folder);

}  // namespace legopt
