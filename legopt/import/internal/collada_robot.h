#pragma once

#include <Eigen/Geometry>
#include <filesystem>
#include <string>
#include <vector>

#include "legopt/geometry/internal/mesh.h"
#include "legopt/import/internal/dataset_diagnostic.h"
#include "legopt/robot/robot_model.h"

namespace legopt {

/// A triangle mesh of a link with its pose.
struct ColladaGeometry {
  TriangleMesh mesh;                                       ///< vertices in m, in the mesh frame
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();  ///< mesh frame in the link frame
};

/// A link with the properties of a URDF.
struct ColladaLink {
  std::string name;
  double mass = 0.0;                                       ///< kg; 0 if the file has none
  Eigen::Vector3d com = Eigen::Vector3d::Zero();           ///< centre of mass in the link frame, m
  Eigen::Matrix3d inertia = Eigen::Matrix3d::Zero();       ///< about the centre of mass, link axes, kg m^2
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();  ///< link frame in the base frame, all joints zero
  std::vector<ColladaGeometry> geometries;                 ///< all geometry of the link; empty: it cannot collide
};

/// A joint (limits in rad or m) with the properties of a URDF.
struct ColladaJoint {
  Joint joint;
  double effort = 0.0;    ///< N m or N
  double velocity = 0.0;  ///< rad/s or m/s
};

/// A robot in depth-first order.
struct ColladaRobot {
  std::string name;                         ///< name of the kinematics model
  std::vector<ColladaLink> links;           ///< links[0] is the base
  std::vector<ColladaJoint> joints;         ///< joints[k] leads to links[k + 1]
  std::vector<DatasetDiagnostic> findings;  ///< decisions made while reading
};

/// Reads a robot from COLLADA 1.5 with kinematics, as written by `urdf_to_collada` and OpenRAVE.
///
/// * Tree: `library_kinematics_models`, links nested by `attachment_full`, children in the order of the document, which
///   is the order of degrees of freedom in LegOpt's solution vectors. Axes are in the joint frame.
/// * Limits: `limits` of the kinematic `axis_info`, else of the joint; degrees (metres for prismatic joints). A joint
///   without limits is continuous. A joint that is inactive or locked, or whose limits are equal, is fixed.
/// * `speed` is the velocity limit. `acceleration` is the effort limit, which urdf_to_collada writes there.
/// * Meshes: all geometry of the link's node in the visual scene, and of nodes below it that are not links. They are
///   used as collision geometry, as in OpenRAVE.
/// * Masses: `library_physics_models`. A mass frame is a pose in the base frame with all joints zero, not in the link
///   frame. The rotation that urdf_to_collada writes is the transpose of the principal axes.
///
/// Throws InputError with file and line: see ColladaDocument; no kinematics model or several, a closed loop, a joint or
/// mesh that does not exist, a zero axis, limits in the wrong order, indices out of range.
ColladaRobot ReadColladaRobot(const std::filesystem::path& path);

}  // namespace legopt
