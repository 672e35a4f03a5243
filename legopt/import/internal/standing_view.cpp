#include "legopt/import/internal/standing_view.h"

#include <iterator>
#include <utility>

#include "legopt/dataset/contact.h"
#include "legopt/geometry/collision_model.h"
#include "legopt/geometry/internal/convex_shape.h"
#include "legopt/robot/kinematics.h"

namespace legopt {
namespace {

constexpr std::size_t kMostTriangles = 1'000;

/// Returns the hull of a mesh of many triangles.
TriangleMesh Drawable(TriangleMesh mesh) {
  if (mesh.triangles.size() <= kMostTriangles) return mesh;
  ConvexHull hull = ComputeHull(mesh.vertices);
  return {.vertices = std::move(hull.vertices), .triangles = std::move(hull.triangles)};
}

std::vector<Eigen::Vector3d> CornersOf(const Contact& contact, const Eigen::Isometry3d& X_WL) {
  const Eigen::Isometry3d X_WC = X_WL * contact.X_LC;
  if (contact.facts().shape == ContactShape::kBall) return {X_WC.translation()};
  std::vector<Eigen::Vector2d> flat;
  for (const Eigen::Vector3d& point : contact.points_L) {
    flat.emplace_back((contact.X_LC.inverse(Eigen::Isometry) * point).head<2>());
  }
  std::vector<Eigen::Vector3d> corners;
  for (const Eigen::Vector2d& corner : ConvexHull2d(std::move(flat))) {
    corners.push_back(X_WC * Eigen::Vector3d(corner.x(), corner.y(), 0.0));
  }
  return corners;
}

}  // namespace

StandingView ViewOf(const Dataset& dataset, const Eigen::VectorXd& x) {
  Kinematics kinematics(dataset.robot());
  kinematics.Update(x);
  const auto& model = dataset.collision_model(SceneRepresentation::kSolid, PairSelection::kAll);
  StandingView view;
  for (int link = 0; link < std::ssize(dataset.robot().links()); ++link) {
    TriangleMesh mesh = Drawable(LinkSurfaces(*model, link));
    if (mesh.triangles.empty()) continue;
    for (Eigen::Vector3d& vertex : mesh.vertices) vertex = kinematics.link_pose(link) * vertex;
    view.links.push_back(std::move(mesh));
  }
  for (const Contact& contact : dataset.contacts()) {
    view.contacts.push_back(CornersOf(contact, kinematics.link_pose(contact.link_index)));
  }
  view.com = kinematics.com();
  return view;
}

}  // namespace legopt
