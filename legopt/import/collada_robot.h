#pragma once

#include <Eigen/Geometry>
#include <filesystem>
#include <string>
#include <vector>

#include "legopt/collision/mesh.h"
#include "legopt/import/finding.h"
#include "legopt/robot/robot_model.h"

namespace legopt {

/// A triangle mesh of a link: vertices in metres in a frame of its own, whose pose in the link frame is `pose`.
struct ColladaGeometry {
  TriangleMesh mesh;                                       ///< vertices in m, in a frame of its own
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();  ///< of that frame in the link frame
};

/// As in RobotModel, with what a URDF states besides.
struct ColladaLink {
  std::string name;                                        ///< unique in the robot
  double mass = 0.0;                                       ///< kg; 0 when the file states none
  Eigen::Vector3d com = Eigen::Vector3d::Zero();           ///< link frame, m
  Eigen::Matrix3d inertia = Eigen::Matrix3d::Zero();       ///< about the centre of mass, link axes, kg m^2
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();  ///< of the link frame in the base frame, all joints zero
  std::vector<ColladaGeometry> geometries;                 ///< all of the link's; empty: it touches nothing
};

/// As in RobotModel (limits in rad or m), with what a URDF states besides.
struct ColladaJoint {
  Joint joint;            ///< kinematics and limits
  double effort = 0.0;    ///< N m or N
  double velocity = 0.0;  ///< rad/s or m/s
};

/// A robot in depth-first order; joints[k] leads to links[k + 1].
struct ColladaRobot {
  std::string name;                      ///< of the kinematics model
  std::vector<ColladaLink> links;        ///< depth first; links[0] is the base
  std::vector<ColladaJoint> joints;      ///< joints[k] leads to links[k + 1]
  std::vector<DatasetFinding> findings;  ///< what was decided while reading
};

/// Reads a robot from COLLADA 1.5 with kinematics, as `urdf_to_collada` and OpenRAVE write it.
///
/// * Tree: `library_kinematics_models`, links nested by `attachment_full`, children in the order of the document, which
///   is the order of degrees of freedom in LegOpt's solution vectors. Axes are in the joint frame.
/// * Limits: `limits` of the kinematic `axis_info`, else of the joint; degrees (metres for prismatic joints). A joint
///   without any is continuous; an inactive or locked one, or one whose limits are equal, is fixed.
/// * `speed` is the velocity limit. `acceleration` is the effort limit: that is what urdf_to_collada puts there.
/// * Meshes: all geometry of the link's node in the visual scene, and of nodes below it that are no links. They serve
///   as collision geometry, as in OpenRAVE.
/// * Masses: `library_physics_models`. A mass frame is a pose in the base frame with all joints zero, not in the link;
///   the rotation that urdf_to_collada writes is the transpose of the principal axes.
///
/// Throws InputError naming file and line: see ColladaDocument; no kinematics model or several, a closed loop, a joint
/// or mesh that does not exist, an axis without direction, limits in the wrong order, indices out of range.
ColladaRobot ReadColladaRobot(const std::filesystem::path& path);

}  // namespace legopt
