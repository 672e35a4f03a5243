#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "legopt/geometry/collision_model.h"
#include "legopt/geometry/internal/convex_shape.h"
#include "legopt/geometry/internal/mesh.h"
#include "legopt/geometry/internal/model_data.h"
#include "legopt/types/byte_cache.h"

namespace legopt {

/// Geometry that is computed once and kept in a ByteCache. Keys are hashes of all inputs; every value that is read is
/// checked, and gives the same bits as the computation. A null cache computes.

/// Returns ComputeHull(points).
ConvexHull PreparedHull(std::span<const Eigen::Vector3d> points, const ByteCache* cache);

/// Returns PiecesOfLinkMesh(mesh, hull, options).
std::vector<ConvexShape> PreparedPieces(const TriangleMesh& mesh, const ConvexHull& hull,
                                        const CollisionOptions& options, const ByteCache* cache);

/// Returns the key of the robot's part of a collision model: links, joints, meshes, reference posture, options. Loads
/// the meshes. Throws InputError.
std::string RobotModelKey(const RobotModel& robot, Eigen::Ref<const Eigen::VectorXd> reference_x,
                          const CollisionOptions& options);

/// Serializes links, shapes and pairs.
std::string EncodeRobotPart(const CollisionModel::Impl& impl);

/// Reads what EncodeRobotPart wrote into an empty `impl`. Returns false, and leaves it empty, for other bytes.
bool DecodeRobotPart(const std::string& bytes, size_t num_links, CollisionModel::Impl* impl);

}  // namespace legopt
