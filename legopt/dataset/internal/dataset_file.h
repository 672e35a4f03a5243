#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "legopt/dataset/contact.h"
#include "legopt/types/collision.h"
#include "legopt/types/task.h"

namespace legopt {

/// Content of a `dataset.yaml`: file names and constants, not yet resolved.
///
/// All keys of the file (paths are relative to the folder, use forward slashes and stay inside it):
///
///     format: legopt-dataset/2            # required
///     name: garage-small                  # required, shown in tables
///     robot: robot.urdf                   # required, URDF; its collision meshes must be in the folder
///     scene: scene.yaml                   # required, scene.yaml or one mesh (both: scene_file.h)
///     problems:                           # required, at least one task; LegOpt JSON (problem_definition.h)
///       posture: problems-posture.json
///       motion: problems-motion.json
///     contacts:                           # required, in the order of pages and files
///       l_foot:                           # the name that stances use
///         link: l_foot                    # required, a link with collision geometry
///         kind: sole                      # required: sole, point, palm or rail (contact_kind.h)
///         frame: {position: [0, 0, -0.08], rpy: [0, 0, 0]}  # optional: contact frame in the link, m and rad
///         points: [[0.1, 0.05, 0], ...]   # optional, m, in the contact frame; default: corners of the link's box
///         friction: 0.7                   # optional, in (0, 2], default as shown
///         max_normal_N: 2000              # optional, > 0, default no bound
///       l_grip:
///         link: l_hand
///         kind: rail
///         frame: {position: [0, 0.1, 0], rpy: [0, 0, 0]}    # its x axis is that of the bar
///         points: [[0.03, 0, 0], [-0.03, 0, 0]]             # required for rails: places of the force, on the x axis
///         radius_m: 0.02                  # optional, default 0: of the bar; for kind point: of the foot's ball
///         max_force_N: 200                # required for rails instead of friction, > 0
///         slide_m: 0.1                    # optional, default 0: distance from the target along the bar
///     support: [l_foot]                   # optional, only in format 2: contacts on which plans walk, of kind sole or
///                                         # point; default: all of these kinds
///     effort_limits: {knee: 220}          # optional, only in format 2, instead of the URDF's: joint: N m or N, > 0
///     velocity_limits: {knee: 12}         # optional, only in format 2: joint: rad/s or m/s, > 0
///     trunk: pelvis                       # optional, only in format 2: a link, default the root link (Trunk)
///     gravity_m_s2: 9.797930195020351     # optional, default as shown
///     nominal_posture:                    # optional, joint: rad (m for prismatic); joints not named are 0
///       l_leg_kny: 0.872664626
///     self_collision_reference:           # optional, joint: rad; link pairs touching here are never checked
///       back_lbz: 0.349055556
///     self_collision:                     # optional, instead of self_collision_reference, only in format 2
///       samples: 10000                    # optional: number of sampled postures and their seed; not in the hash
///       seed: 1
///       unchecked:                        # required: pairs of links that are not compared, and why (UncheckedReason)
///         - [pelvis, l_thigh, adjacent]
///     link_shapes: pieces                 # optional, only in format 2: hulls (default) or pieces (LinkRepresentation)
///     files:                              # required: every used file and the BLAKE2b-256 of its bytes
///       robot.urdf: 5c1e...               # (64 hex digits); `legopt dataset hash` writes them
///
/// Format 1 (`legopt-dataset/1`) has two keys instead of `contacts`. Both formats have the same content hash if they
/// mean the same.
///
///     feet: [l_foot, r_foot]              # required: a sole for each link, named like it
///     sole_offset_m: 0.082351             # required, >= 0: link frame above the contact frame along the normal
struct DatasetDescription {
  /// A pair of links by name that is not compared.
  struct LinkNames {
    std::string first, second;
    UncheckedReason reason = UncheckedReason::kAdjacent;
  };
  /// Link pairs found by sampling.
  struct SelfCollision {
    int samples = 0;                   ///< number of postures; 0: unknown
    std::int64_t seed = 0;             ///< seed of the postures
    std::vector<LinkNames> unchecked;  ///< no pair twice, in any order
  };

  std::string name;                                        ///< shown in tables
  std::string robot_file;                                  ///< URDF, relative to the folder
  std::string scene_file;                                  ///< scene.yaml or a mesh, relative to the folder
  EnumArray<Task, std::string> problem_files;              ///< empty: the dataset has no problems of this task
  std::vector<ContactDescription> contacts;                ///< not empty, names unique
  std::vector<std::string> support;                        ///< names of contacts; empty: all that support
  std::map<std::string, double> effort_limits;             ///< joint name -> N m or N, > 0
  std::map<std::string, double> velocity_limits;           ///< joint name -> rad/s or m/s, > 0
  std::string trunk;                                       ///< name of a link; empty: the root link
  double gravity_m_s2 = kBenchmarkGravity_m_s2;            ///< > 0
  std::map<std::string, double> nominal_posture;           ///< joint name -> rad, before clamping
  std::map<std::string, double> self_collision_reference;  ///< joint name -> rad
  std::optional<SelfCollision> self_collision;             ///< replaces self_collision_reference
  LinkRepresentation link_shapes = LinkRepresentation::kHulls;
  std::map<std::string, std::string> files;  ///< path -> expected hash; empty for a bare folder
  bool bare = false;                         ///< true: a LegOpt-style folder without dataset.yaml

  /// Returns the key that declares a contact, for errors: "feet" in format 1.
  std::string PathOf(const ContactDescription& contact) const;

  /// Gravitational acceleration of the benchmark: OpenRAVE's altitude and latitude formula for Tokyo.
  static constexpr double kBenchmarkGravity_m_s2 = 9.797930195020351;
};

/// File that distinguishes a dataset's folder from a bare one.
inline constexpr const char* kDatasetFileName = "dataset.yaml";
/// Values of the key `format`. Files are written in format 1 if it can express the contacts, else in format 2.
inline constexpr const char* kDatasetFormat1 = "legopt-dataset/1";
inline constexpr const char* kDatasetFormat2 = "legopt-dataset/2";

/// Reads `folder`/dataset.yaml. Throws InputError for a missing file, invalid YAML, an unknown or missing key, a value
/// of the wrong type or range, or a path that leaves the folder.
DatasetDescription ReadDatasetFile(const std::filesystem::path& folder);

/// Reads the description of a folder: dataset.yaml if there is one, else that of a LegOpt-style folder
/// (dataset_file.h).
DatasetDescription DescribeDataset(const std::filesystem::path& folder);

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
