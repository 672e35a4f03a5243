#pragma once

#include <Eigen/Geometry>
#include <filesystem>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "legopt/collision/collision_model.h"
#include "legopt/collision/scene.h"
#include "legopt/dataset/dataset_file.h"
#include "legopt/dataset/stance.h"
#include "legopt/robot/robot_model.h"
#include "words/task.h"

namespace legopt {

/// A robot, a scene and the problems posed to it: everything that decides what a solution is worth.
///
/// Loaded from a folder with a `dataset.yaml` (format: dataset_file.h) or from a bare LegOpt-style folder
/// (legopt_folder.h). Immutable after loading; share it as shared_ptr<const Dataset>. All const members may be called
/// from any thread.
class Dataset {
 public:
  /// A link that may stand. `box` is the link-frame AABB of its collision geometry (metres); the four corners at
  /// box.min().z() are the sole that spans the support polygon.
  struct Foot {
    std::string link;         ///< its name
    int link_index;           ///< index into RobotModel::links()
    Eigen::AlignedBox3d box;  ///< link frame, m; not empty
  };

  /// Reads and checks the whole dataset; every mesh is read once, so that a corrupt one is found here, not by a worker.
  /// `guard` runs the readers of other people's libraries on its robot and its meshes, now and for later users of
  /// robot() and scene().
  ///
  /// Throws InputError for a missing or malformed file, a content hash that differs from the manifest, an unknown key,
  /// link or joint (naming the nearest valid one), a robot without mass, geometry more than 8,192 m from the origin
  /// (beyond which single precision, as in mesh files, is coarser than the judge's 1 mm), a foot without geometry, a
  /// stance that is not well formed, and problem ids that occur twice.
  static std::shared_ptr<const Dataset> Load(const std::filesystem::path& folder, const ReadGuard& guard = {});

  /// From `dataset.yaml`; the folder's own name for a bare folder. Not part of the content hash.
  const std::string& name() const { return description_.name; }
  /// Absolute path of the folder it was loaded from.
  const std::filesystem::path& folder() const { return folder_; }
  /// BLAKE2b-256 (64 lower-case hex digits) of the canonical manifest: all constants above and, per used file, its
  /// path in the folder and the hash of its bytes, meshes included. Equal hashes mean equal problems; neither the
  /// dataset's name nor the place of its folder changes it.
  const std::string& content_hash() const { return content_hash_; }

  /// Absolute path of the URDF.
  std::filesystem::path robot_file() const { return folder_ / description_.robot_file; }
  const RobotModel& robot() const { return robot_; }  ///< as read, meshes not loaded; lives as long as the dataset
  const Scene& scene() const { return scene_; }       ///< as read, meshes not loaded; lives as long as the dataset
  /// A box that contains the scene, in the world, m.
  const Eigen::AlignedBox3d& scene_bounds() const { return scene_bounds_; }
  /// A box that contains the robot in its nominal posture, base upright at the origin, m.
  const Eigen::AlignedBox3d& robot_bounds() const { return robot_bounds_; }
  /// Obstacles of the scene, hulls of the links, checked link pairs. Built at the first call for each representation
  /// and selection (seconds for a large mesh), then shared; concurrent first calls build once. Throws InputError for a
  /// corrupt mesh.
  const std::shared_ptr<const CollisionModel>& collision_model(SceneRepresentation scene = SceneRepresentation::kSolid,
                                                               PairSelection pairs = PairSelection::kReference) const;

  /// Problems of a task, its own or those of the task that it shares them with, in file order; empty when the dataset
  /// has none.
  const std::vector<ProblemDefinition>& problems(Task task) const { return problems_[DescriptionOf(task).problems]; }
  /// Throws InputError naming the ids there are.
  const ProblemDefinition& problem(Task task, int id) const;

  /// Standard gravity of the cost, > 0. The LegOpt benchmark uses 9.797930195020351.
  double gravity_m_s2() const { return description_.gravity_m_s2; }
  /// Distance of a foot's link frame above its sole target along the surface normal (Atlas 0.082351).
  double sole_offset_m() const { return description_.sole_offset_m; }
  /// Joint values of the initial guess, n, within the limits.
  const Eigen::VectorXd& nominal_joints() const { return nominal_joints_; }
  /// Configuration (n + 7) whose touching link pairs are ignored in self-collision; base at the origin.
  const Eigen::VectorXd& self_collision_reference() const { return self_collision_reference_; }
  /// z of the lowest corner of all feet's boxes relative to the base origin, with nominal joints and an upright base
  /// (negative; Atlas -0.873903). Metres.
  double nominal_sole_height_m() const { return nominal_sole_height_m_; }

  const std::vector<Foot>& feet() const { return feet_; }  ///< in the order of dataset.yaml; not empty
  /// Foot by link name; throws InputError when the link is not a foot of this dataset.
  const Foot& foot(const std::string& link) const;
  /// Target of the foot's *link frame* in the world: position + sole_offset_m * n with n = third column of the
  /// rotation, rotation unchanged (normalised).
  Eigen::Isometry3d FootTarget(const Foothold& foothold) const;

  Dataset(const Dataset&) = delete;
  Dataset& operator=(const Dataset&) = delete;

 private:
  Dataset(std::filesystem::path folder, DatasetDescription description, const ReadGuard& guard);
  void VerifyListedFiles() const;
  void ResolveContentHash();
  void CheckMass() const;
  void MeasureShapes();
  void ResolveFeet();
  void ResolvePostures();
  Eigen::VectorXd ResolveJoints(const std::map<std::string, double>& values, const std::string& key) const;
  std::vector<ProblemDefinition> ReadProblems(Task task, const std::string& file) const;
  std::vector<std::string> FootNames() const;
  std::string file_for_errors() const;
  std::string HashFix() const;

  std::filesystem::path folder_;
  DatasetDescription description_;
  RobotModel robot_;
  Scene scene_;
  std::string content_hash_;
  Eigen::AlignedBox3d scene_bounds_, robot_bounds_;
  std::vector<Eigen::AlignedBox3d> link_boxes_;  ///< by link, in its frame; empty for a link without geometry
  Per<Task, std::vector<ProblemDefinition>> problems_;
  Eigen::VectorXd nominal_joints_;
  Eigen::VectorXd self_collision_reference_;
  double nominal_sole_height_m_ = 0;
  std::vector<Foot> feet_;

  struct LazyCollisionModel {
    std::once_flag once;
    std::shared_ptr<const CollisionModel> model;
  };
  mutable Per<SceneRepresentation, Per<PairSelection, LazyCollisionModel>> collision_models_;
};

}  // namespace legopt
