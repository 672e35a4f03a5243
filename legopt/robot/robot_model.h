#pragma once

#include <Eigen/Dense>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

#include "legopt/types/read_guard.h"

namespace legopt {

/// One collision geometry of a URDF link or of a scene, in the frame of its owner.
struct ShapeSpec {
  /// Type of the shape.
  enum class Kind {
    kBox,       ///< size: full extents
    kSphere,    ///< size: radius
    kCylinder,  ///< size: radius and length
    kCapsule,   ///< size: radius and length
    kMesh       ///< mesh_file and scale
  };

  Kind kind = Kind::kBox;
  /// Metres. Box: full extents x, y, z. Sphere: radius in x. Cylinder and capsule: radius in x, length in z; the shape
  /// is centred, its axis is z, and a capsule's length excludes its caps. Unused for meshes.
  Eigen::Vector3d size = Eigen::Vector3d::Zero();
  std::string mesh_file;                                   ///< absolute path; meshes only
  Eigen::Vector3d scale = Eigen::Vector3d::Ones();         ///< factors for mesh vertices
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();  ///< shape frame in the owner's frame
};

/// One link of the kinematic tree.
struct Link {
  std::string name;
  double mass = 0.0;                              ///< kg; 0 if the link has no inertia
  Eigen::Vector3d com = Eigen::Vector3d::Zero();  ///< centre of mass in the link frame, m
  /// Rotational inertia about the centre of mass, axes of the link frame, kg m^2; symmetric. 0 if the link has none.
  Eigen::Matrix3d inertia = Eigen::Matrix3d::Zero();
  int parent_joint = -1;             ///< index into joints(); -1 for the base
  std::vector<ShapeSpec> collision;  ///< empty: the link cannot collide
};

/// Joint types of URDF that are supported.
enum class JointType {
  kRevolute,    ///< rotates between limits, rad
  kContinuous,  ///< rotates without limits, rad
  kPrismatic,   ///< translates between limits, m
  kFixed        ///< connects two links rigidly
};

/// Joint with X_parent_child(q) = origin * Motion(axis, q), where Motion is a rotation (rad) or a translation (m).
struct Joint {
  static constexpr double kNoLimit = std::numeric_limits<double>::infinity();

  std::string name;
  JointType type = JointType::kFixed;
  int parent_link = -1;  ///< index into links()
  int child_link = -1;   ///< index into links(); every link but the base is the child of one joint
  Eigen::Isometry3d origin = Eigen::Isometry3d::Identity();  ///< joint frame at q = 0 in the parent link's frame
  Eigen::Vector3d axis = Eigen::Vector3d::UnitX();           ///< unit vector in the joint frame
  int leader = -1;             ///< index of the joint that this one follows (URDF: mimic); -1: it moves independently
  double multiplier = 1.0;     ///< factor of the leader's value: q = multiplier * q_leader + offset
  double offset = 0.0;         ///< rad or m; 0 without a leader
  int dof = -1;                ///< degree of freedom, the leader's for a follower; -1 for fixed joints
  double lower = 0.0;          ///< rad or m; -infinity when unlimited
  double upper = 0.0;          ///< rad or m; +infinity when unlimited
  double effort = kNoLimit;    ///< largest |torque| or |force|, N m or N, > 0; kNoLimit if the file gives none
  double velocity = kNoLimit;  ///< largest |velocity|, rad/s or m/s, > 0; kNoLimit if the file gives none
};

/// Kinematic tree of a floating-base robot: links, joints and degrees of freedom in depth-first order, children in the
/// order in which the URDF file lists their joints (urdfdom itself sorts by name). Link 0 is the base.
///
/// A configuration is LegOpt's flat vector of size n + 7 for n actuated joints (configuration.h names its parts):
///
///     x = [q_0 .. q_{n-1}, p_x, p_y, p_z, q_w, q_x, q_y, q_z]
///
/// with p the base frame's origin in the world and the quaternion its orientation (readers normalise it). Its tangent
/// has n + 6 entries, dx = [dq, dp, dphi], all base parts along world axes: p' = p + dp, R' = Exp(dphi) R.
///
/// A joint that follows another one, q = m q_leader + o, has no degree of freedom of its own. The limits of a degree of
/// freedom are the intersection of the limits of all its joints.
///
/// Immutable, except for the two setters, and thread-safe.
class RobotModel {
 public:
  /// Reads a URDF. Mesh paths are relative to the file's folder; `package://NAME/rest` is searched upwards from there.
  /// urdfdom runs in the calling process; `guard` will run the mesh loaders of this robot. Throws InputError for a file
  /// that cannot be read, malformed XML, missing links, loops, several roots, unsupported joints (floating, planar),
  /// bad axes, limits or masses.
  static RobotModel FromUrdfFile(const std::string& path, const ReadGuard& guard = {});

  /// Reads a URDF from text, like FromUrdfFile. `source` names it in errors; relative mesh paths refer to
  /// `mesh_folder`.
  static RobotModel FromUrdfText(const std::string& xml, const std::string& source, const std::string& mesh_folder,
                                 const ReadGuard& guard = {});

  /// Builds the tree from links and joints in depth-first order; aborts if the order is wrong.
  RobotModel(std::string name, std::vector<Link> links, std::vector<Joint> joints);

  const std::string& name() const { return name_; }
  const std::vector<Link>& links() const { return links_; }     ///< depth first; the base is links()[0]
  const std::vector<Joint>& joints() const { return joints_; }  ///< joints()[k] leads to links()[k + 1]
  /// Guard that loads the robot's meshes.
  const ReadGuard& read_guard() const { return read_guard_; }

  /// n, the joints that move independently.
  int num_dofs() const { return static_cast<int>(dof_joints_.size()); }
  int configuration_size() const { return num_dofs() + 7; }   ///< n + 7
  int tangent_size() const { return num_dofs() + 6; }         ///< n + 6
  int base_position_index() const { return num_dofs(); }      ///< first of three, in configurations and tangents
  int base_rotation_index() const { return num_dofs() + 3; }  ///< first number of the quaternion or rotation vector

  /// Lower joint limits per degree of freedom, rad or m, -infinity if unlimited.
  const Eigen::VectorXd& lower_limits() const { return lower_; }
  const Eigen::VectorXd& upper_limits() const { return upper_; }  ///< upper joint limits, +infinity if unlimited
  /// Largest absolute torques (forces) per degree of freedom, N m or N, of the joint that moves independently; infinite
  /// if the file gives none.
  const Eigen::VectorXd& effort_limits() const { return effort_; }
  /// Largest absolute velocities per degree of freedom, rad/s or m/s, as effort_limits().
  const Eigen::VectorXd& velocity_limits() const { return velocity_; }

  /// Sets the effort limit of one degree of freedom, N m or N, > 0 or Joint::kNoLimit; only before the model is shared.
  void SetEffortLimit(int dof, double limit);
  /// Sets the velocity limit of one degree of freedom, rad/s or m/s, likewise.
  void SetVelocityLimit(int dof, double limit);

  /// Moves the joints of a configuration or tangent-sized vector into their limits; the base stays.
  void ClampJoints(Eigen::Ref<Eigen::VectorXd> x) const;
  /// Returns the configuration with joints at zero or the nearest limit and the base upright at the origin.
  Eigen::VectorXd NeutralConfiguration() const;

  /// Returns the index into joints() of a degree of freedom.
  int dof_joint(int dof) const { return dof_joints_[static_cast<size_t>(dof)]; }
  double total_mass() const { return total_mass_; }  ///< kg

  /// Returns the index of a link, or -1 if there is none with that name.
  int FindLink(std::string_view name) const;
  /// Returns the index of a joint, or -1 if there is none with that name.
  int FindJoint(std::string_view name) const;

  /// Returns the number of moving joints on the chain between two links.
  int MovingJointsBetween(int link_a, int link_b) const;

  /// Links connected by fixed joints form one body. Body 0 contains the base; body k > 0 is moved by the joint
  /// body_joint(k), so that a body's parent has a smaller index. Without followers, this is degree of freedom k - 1.
  int num_bodies() const { return static_cast<int>(moving_joints_.size()) + 1; }
  /// Returns the index into joints() of the joint that moves a body > 0.
  int body_joint(int body) const { return moving_joints_[static_cast<size_t>(body) - 1]; }
  bool has_followers() const { return moving_joints_.size() > dof_joints_.size(); }  ///< any joint follows another one
  /// Returns the index of a link's body.
  int link_body(int link) const { return link_body_[static_cast<size_t>(link)]; }
  /// Returns the index of the parent body; -1 for body 0.
  int body_parent(int body) const { return body_parent_[static_cast<size_t>(body)]; }
  /// Returns the bodies on the chain from the base to a body, from the base outwards, without body 0.
  const std::vector<int>& body_chain(int body) const { return body_chain_[static_cast<size_t>(body)]; }
  /// Returns the link frame in the frame of its body.
  const Eigen::Isometry3d& link_in_body(int link) const { return link_in_body_[static_cast<size_t>(link)]; }

 private:
  void CollectLimits();
  void BuildBodies();

  std::string name_;
  ReadGuard read_guard_;
  std::vector<Link> links_;
  std::vector<Joint> joints_;
  std::vector<int> dof_joints_;
  std::vector<int> moving_joints_;
  Eigen::VectorXd lower_, upper_, effort_, velocity_;
  double total_mass_ = 0.0;
  std::vector<int> link_body_;
  std::vector<int> body_parent_;
  std::vector<std::vector<int>> body_chain_;
  std::vector<Eigen::Isometry3d> link_in_body_;
};

/// Returns the joint names of all degrees of freedom, in the order of configurations.
std::vector<std::string> DofNames(const RobotModel& robot);

/// Returns "revolute", "continuous", "prismatic" or "fixed".
std::string_view ToString(JointType type);

/// Returns the unit of a joint's value: "m" for prismatic joints, else "rad".
std::string_view UnitOf(JointType type);

}  // namespace legopt
