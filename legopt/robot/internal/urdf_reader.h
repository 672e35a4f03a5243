#pragma once

#include <string>
#include <vector>

#include "legopt/robot/internal/mesh_lookup.h"
#include "legopt/robot/internal/urdf_check.h"
#include "legopt/robot/robot_model.h"

namespace legopt {

/// Links and joints as urdfdom reads them: mesh names as in the file, tree indices not set.
struct UrdfContent {
  std::vector<Link> links;    ///< ordered as CheckedUrdf::links
  std::vector<Joint> joints;  ///< ordered as CheckedUrdf::joints; fixed joints without axis and limits
};

/// Reads a checked URDF with urdfdom in the calling thread. CheckUrdf admits no text that urdfdom rejects or misreads;
/// as a second line of defence, throws InputError if urdfdom logs an error, throws, or omits a link, shape or joint.
/// Thread-safe.
UrdfContent ReadByUrdfdom(const CheckedUrdf& urdf);

/// Throws InputError unless the joints form a single tree of all links.
void CheckUrdfTree(const CheckedUrdf& urdf);

/// Sorts links and joints into the order of RobotModel and resolves mesh paths (RobotModel::FromUrdfFile).
///
/// Throws InputError for meshes that do not exist, zero joint axes, lower limits above upper ones, and values in
/// `content` that are not finite. `notes`, if not null, receives the meshes that were found by a fallback
/// (mesh_lookup.h). Meshes left out have no file name.
RobotModel BuildUrdfTree(const CheckedUrdf& urdf, const UrdfContent& content, const std::string& mesh_folder,
                         std::vector<UrdfDiagnostic>* notes = nullptr, const MeshSearch& meshes = {});

}  // namespace legopt
