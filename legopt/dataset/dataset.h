#pragma once

#include <Eigen/Geometry>
#include <filesystem>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "legopt/dataset/contact.h"
#include "legopt/dataset/internal/dataset_file.h"
#include "legopt/dataset/problem_definition.h"
#include "legopt/geometry/collision_model.h"
#include "legopt/geometry/scene.h"
#include "legopt/robot/robot_model.h"
#include "legopt/types/task.h"

namespace legopt {

class Kinematics;

/// Computes the axis-aligned bounding box of a link's collision geometry, in the link frame, metres. Exact for
/// primitives (cylinders are not replaced by prisms); meshes are loaded under `guard`. Empty if the link has no
/// geometry. Throws InputError for a mesh that cannot be loaded.
Eigen::AlignedBox3d LinkBox(const Link& link, const ReadGuard& guard = {});

/// The body that the legs carry, where heights, reach and initial guesses of a robot are measured. The trunk's frame T
/// has its origin at that of the link; its axes are those of the base in the nominal posture, with the base upright.
/// Default: the base, with T = its frame.
struct Trunk {
  int link = 0;                                                  ///< index into RobotModel::links()
  Eigen::Isometry3d X_LT = Eigen::Isometry3d::Identity();        ///< frame T in the link frame, a rotation
  Eigen::Vector3d nominal_position_B = Eigen::Vector3d::Zero();  ///< origin of T in the nominal posture, m

  /// Returns the pose of a link relative to the trunk. `kinematics` has the robot's link poses.
  Eigen::Isometry3d PoseOf(int other, const Kinematics& kinematics) const;
};

/// A robot, a scene, benchmark constants and problems: all data that affects how a solution is judged.
///
/// Loaded from a folder with a `dataset.yaml` (format: dataset_file.h) or from a bare LegOpt-style folder
/// (dataset_file.h). Immutable after loading and thread-safe; share it as shared_ptr<const Dataset>.
class Dataset {
 public:
  /// Reads and checks the whole dataset, including every mesh, so that a corrupt mesh is reported here and not by a
  /// worker. `guard` runs third-party parsers on the robot and the meshes, now and for later users of robot() and
  /// scene().
  ///
  /// Throws InputError for a missing or malformed file, a content hash that differs from the manifest, an unknown key,
  /// link or joint (with the nearest valid name), a robot without mass, geometry more than 8,192 m from the origin
  /// (where single precision, as in mesh files, is coarser than the judge's 1 mm), a contact without geometry, an
  /// invalid stance, and duplicate problem ids.
  static std::shared_ptr<const Dataset> Load(const std::filesystem::path& folder, const ReadGuard& guard = {});

  /// Name from `dataset.yaml`; the folder's name for a bare folder. Not part of the content hash.
  const std::string& name() const { return description_.name; }
  /// Absolute path of the dataset's folder.
  const std::filesystem::path& folder() const { return folder_; }
  /// BLAKE2b-256 (64 lower-case hex digits) of the canonical manifest: the constants and, per used file, its relative
  /// path and the hash of its bytes, meshes included. Equal hashes mean equal problems; the dataset's name and the
  /// location of its folder are not included.
  const std::string& content_hash() const { return content_hash_; }

  /// Absolute path of the URDF.
  std::filesystem::path robot_file() const { return folder_ / description_.robot_file; }
  const RobotModel& robot() const { return robot_; }  ///< robot without loaded meshes; lives as long as the dataset
  const Scene& scene() const { return scene_; }       ///< meshes not loaded; lives as long as the dataset
  /// Box that contains the scene, in the world, m.
  const Eigen::AlignedBox3d& scene_bounds() const { return scene_bounds_; }
  /// Box that contains the robot in its nominal posture, base upright at the origin, m.
  const Eigen::AlignedBox3d& robot_bounds() const { return robot_bounds_; }
  /// Returns the collision model: obstacles of the scene, hulls of the links, checked link pairs. Built at the first
  /// call for each representation and selection (seconds for a large mesh), then shared; concurrent first calls build
  /// it once. Throws InputError for a corrupt mesh.
  const std::shared_ptr<const CollisionModel>& collision_model(SceneRepresentation scene = SceneRepresentation::kSolid,
                                                               PairSelection pairs = PairSelection::kReference) const;

  /// Returns the problems of a task, or of the task that it shares them with, in file order; empty if there are none.
  const std::vector<ProblemDefinition>& problems(Task task) const { return problems_[DescriptionOf(task).problems]; }
  /// Returns a problem by id. Throws InputError with the list of valid ids.
  const ProblemDefinition& problem(Task task, int id) const;

  /// Gravitational acceleration for the cost, > 0. The LegOpt benchmark uses 9.797930195020351.
  double gravity_m_s2() const { return description_.gravity_m_s2; }
  /// Joint values of the initial guess, size n, within the limits.
  const Eigen::VectorXd& nominal_joints() const { return nominal_joints_; }
  /// Configuration (n + 7) with the base at the origin. Link pairs that touch in it are ignored in self-collision.
  const Eigen::VectorXd& self_collision_reference() const { return self_collision_reference_; }
  /// Pairs of links that are not compared, if dataset.yaml lists them; else the rule of the reference posture applies.
  const std::optional<std::vector<UncheckedPair>>& unchecked_pairs() const { return unchecked_pairs_; }
  /// Shapes of the links against the scene, for the solver.
  LinkRepresentation link_shapes() const { return description_.link_shapes; }
  /// Returns the options of collision_model().
  CollisionOptions collision_options(SceneRepresentation scene, PairSelection pairs) const;
  /// z of the lowest corner of the boxes of the links of all soles, of a point contact that of its ball, relative to
  /// the base origin, with nominal joints and an upright base, m (negative; Atlas: -0.873903).
  double nominal_sole_height_m() const { return nominal_sole_height_m_; }
  const Trunk& trunk() const { return trunk_; }  ///< origin of heights, reach and initial guesses
  /// Height of the trunk's origin above the lowest sole with nominal joints, m.
  double trunk_height_m() const { return trunk_.nominal_position_B.z() - nominal_sole_height_m_; }

  const std::vector<Contact>& contacts() const { return contacts_; }  ///< ordered as in dataset.yaml; not empty
  /// The contacts on which plans walk (dataset_file.h, `support`), in that order; not empty.
  const std::vector<Contact>& feet() const { return feet_; }
  /// Returns a contact by name. Throws InputError if the dataset has no such contact.
  const Contact& contact(const std::string& name) const;
  /// Returns the target of the *link frame* of the target's contact in the world (Contact::LinkTarget).
  Eigen::Isometry3d LinkTarget(const ContactTarget& target) const;

  Dataset(const Dataset&) = delete;
  Dataset& operator=(const Dataset&) = delete;

 private:
  Dataset(std::filesystem::path folder, DatasetDescription description, const ReadGuard& guard);
  void VerifyListedFiles() const;
  void ResolveContentHash();
  void CheckMass() const;
  void MeasureShapes();
  void ResolveContacts();
  void ResolveFeet();
  void ResolveLimits();
  void ResolvePostures();
  void ResolveTrunk(const Kinematics& nominal);
  void ResolveUncheckedPairs();
  int ResolveJoint(const std::string& name, const std::string& key) const;
  Eigen::VectorXd ResolveJoints(const std::map<std::string, double>& values, const std::string& key) const;
  /// Throws InputError for a friction or slide that the contact's kind does not have.
  static void CheckProperties(const Contact& contact, const ContactTarget& target, const TextSource& source);
  std::vector<ProblemDefinition> ReadProblems(Task task, const std::string& file) const;
  std::vector<std::string> ContactNames() const;
  std::string file_for_errors() const;
  std::string HashFix() const;

  std::filesystem::path folder_;
  DatasetDescription description_;
  RobotModel robot_;
  Scene scene_;
  std::string content_hash_;
  Eigen::AlignedBox3d scene_bounds_, robot_bounds_;
  std::vector<Eigen::AlignedBox3d> link_boxes_;  ///< per link, in its frame; empty for a link without geometry
  EnumArray<Task, std::vector<ProblemDefinition>> problems_;
  Eigen::VectorXd nominal_joints_;
  Eigen::VectorXd self_collision_reference_;
  std::optional<std::vector<UncheckedPair>> unchecked_pairs_;
  double nominal_sole_height_m_ = 0;
  Trunk trunk_;
  std::vector<Contact> contacts_;
  std::vector<Contact> feet_;

  struct LazyCollisionModel {
    std::once_flag once;
    std::shared_ptr<const CollisionModel> model;
  };
  mutable EnumArray<SceneRepresentation, EnumArray<PairSelection, LazyCollisionModel>> collision_models_;
};

}  // namespace legopt
