#include "legopt/geometry/convex_surfaces.h"

#include "legopt/geometry/convex_shape.h"
#include "legopt/geometry/model_data.h"

namespace legopt {
namespace {

void Append(const std::vector<Eigen::Vector3d>& vertices, const std::vector<std::array<int, 3>>& triangles,
            TriangleMesh* mesh) {
  const int first = static_cast<int>(mesh->vertices.size());
  mesh->vertices.insert(mesh->vertices.end(), vertices.begin(), vertices.end());
  for (const auto& t : triangles) mesh->triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
}

ShapeSpec::Kind KindOf(ConvexShape::Kind kind) {
  switch (kind) {
    case ConvexShape::Kind::kSphere:
      return ShapeSpec::Kind::kSphere;
    case ConvexShape::Kind::kCapsule:
      return ShapeSpec::Kind::kCapsule;
    case ConvexShape::Kind::kCylinder:
      return ShapeSpec::Kind::kCylinder;
    default:
      return ShapeSpec::Kind::kBox;
  }
}

void AppendSurface(const ConvexShape& shape, TriangleMesh* mesh) {
  if (shape.kind() != ConvexShape::Kind::kHull) {
    ShapeSpec spec;
    spec.kind = KindOf(shape.kind());
    spec.size = shape.size();
    spec.pose = shape.pose();
    const TriangleMesh surface = Tessellate(spec);
    Append(surface.vertices, surface.triangles, mesh);
  } else if (!shape.hull().flat()) {
    Append(shape.hull().vertices, shape.hull().triangles, mesh);
  } else if (shape.hull().vertices.size() == 3) {
    Append(shape.hull().vertices, {{0, 1, 2}}, mesh);
  }
}

}  // namespace

TriangleMesh LinkSurfaces(const CollisionModel& model, int link) {
  const CollisionModel::Impl& data = model.impl();
  const LinkShapes& shapes = data.links[static_cast<size_t>(link)];
  const ShapeRun& run = shapes.Finest();
  TriangleMesh mesh;
  for (int i = run.first; i < run.end(); ++i) AppendSurface(data.shapes[static_cast<size_t>(i)], &mesh);
  return mesh;
}

TriangleMesh SceneSurfaces(const CollisionModel& model) {
  TriangleMesh mesh;
  for (const ConvexShape& solid : model.impl().solids) AppendSurface(solid, &mesh);
  return mesh;
}

}  // namespace legopt
