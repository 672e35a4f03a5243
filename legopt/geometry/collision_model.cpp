#include "legopt/geometry/collision_model.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <numbers>
#include <string>
#include <utility>

#include "legopt/geometry/internal/convex_decomposition.h"
#include "legopt/geometry/internal/convex_shape.h"
#include "legopt/geometry/internal/link_trimeshes.h"
#include "legopt/geometry/internal/model_data.h"
#include "legopt/geometry/internal/prepared_geometry.h"
#include "legopt/geometry/internal/scene_solids.h"
#include "legopt/geometry/internal/trimesh_world.h"
#include "legopt/math/parallel.h"
#include "legopt/types/input_error.h"
#include "legopt/types/number_text.h"

namespace legopt {
namespace {

using Impl = CollisionModel::Impl;

void Check(bool good, const char* field, double value, const char* rule) {
  if (!good) throw InputError({"collision options", field, FormatFixed(value, 6), rule, "see CollisionOptions"});
}

void Validate(const CollisionOptions& options) {
  const auto positive = [](double value) { return std::isfinite(value) && value > 0.0; };
  constexpr int kMaxPieces = 64;
  Check(positive(options.link_concavity_m), "link_concavity_m", options.link_concavity_m, "must be positive");
  Check(positive(options.scene_concavity_m), "scene_concavity_m", options.scene_concavity_m, "must be positive");
  for (const auto& [name, value] : {std::pair("max_link_pieces", options.max_link_pieces),
                                    std::pair("max_component_pieces", options.max_component_pieces)}) {
    Check(value >= 1 && value <= kMaxPieces, name, value, "must lie in 1..64");
  }
}

/// Calls `action` and adds the link's name to any InputError.
template <class Action>
void WithLinkInErrors(const Link& link, Action action) {
  try {
    action();
  } catch (const InputError& error) {
    InputError::Fault fault = error.fault();
    fault.field = "link '" + link.name + "' collision" + (fault.field.empty() ? "" : ": " + fault.field);
    throw InputError(std::move(fault));
  }
}

/// Adds one hull around all pieces of a link that has several pieces, all hulls; returns its index.
int AddEnclosingHull(const LinkShapes& link, Impl& impl) {
  if (link.hulls.count == 1) return link.hulls.first;
  std::vector<Eigen::Vector3d> points;
  for (int p = link.hulls.first; p < link.hulls.end(); ++p) {
    const ConvexShape& piece = impl.shapes[static_cast<size_t>(p)];
    if (piece.kind() != ConvexShape::Kind::kHull) return -1;
    points.insert(points.end(), piece.points().begin(), piece.points().end());
  }
  if (points.empty()) return -1;
  impl.shapes.push_back(ConvexShape::FromHull(ComputeHull(points)));
  return static_cast<int>(impl.shapes.size()) - 1;
}

CollisionModel::Ball BallRound(const LinkShapes& link, const Impl& impl) {
  if (link.hulls.count == 0) return {};
  if (link.whole >= 0) {
    const ConvexShape& whole = impl.shapes[static_cast<size_t>(link.whole)];
    return {whole.centre(), whole.bounding_radius()};
  }
  Eigen::AlignedBox3d bounds;
  for (int p = link.hulls.first; p < link.hulls.end(); ++p) {
    bounds.extend(impl.shapes[static_cast<size_t>(p)].bounds());
  }
  return {bounds.center(), 0.5 * bounds.diagonal().norm()};
}

/// Adds one convex shape per geometry.
void AddHulls(const Link& link, const ReadGuard& guard, Impl& impl) {
  LinkShapes shapes;
  shapes.hulls.first = static_cast<int>(impl.shapes.size());
  for (ConvexShape& shape : HullsOf(link, guard)) impl.shapes.push_back(std::move(shape));
  shapes.hulls.count = static_cast<int>(impl.shapes.size()) - shapes.hulls.first;
  shapes.whole = AddEnclosingHull(shapes, impl);
  shapes.ball = BallRound(shapes, impl);
  impl.links.push_back(shapes);
}

/// Adds the finer shapes of a link, unless they exist already.
void AddDecomposition(int link, PairResolution detail, LinkPieces& pieces, Impl& impl) {
  const bool bodies = detail == PairResolution::kBodies;
  LinkShapes& shapes = impl.links[static_cast<size_t>(link)];
  ShapeRun& run = bodies ? shapes.bodies : shapes.pieces;
  if (run.count > 0) return;
  const std::vector<ConvexShape>& finer = bodies ? pieces.Bodies(link) : pieces.Pieces(link);
  run = {static_cast<int>(impl.shapes.size()), static_cast<int>(finer.size())};
  impl.shapes.insert(impl.shapes.end(), finer.begin(), finer.end());
}

/// A mesh of a link, and its pieces that are compared with scenes of solids.
struct SceneMesh {
  size_t link, geometry;
  TriangleMesh mesh;
  std::vector<ConvexShape> pieces;
};

const ConvexShape& HullOf(size_t link, size_t geometry, const Impl& impl) {
  return impl.shapes[static_cast<size_t>(impl.links[link].hulls.first) + geometry];
}

/// Returns the meshes of all links in order, with their pieces.
std::vector<SceneMesh> DecomposeForScenes(const RobotModel& robot, const CollisionOptions& options, const Impl& impl) {
  std::vector<SceneMesh> meshes;
  for (size_t i = 0; i < robot.links().size(); ++i) {
    const std::vector<ShapeSpec>& geometries = robot.links()[i].collision;
    for (size_t g = 0; g < geometries.size(); ++g) {
      if (geometries[g].kind == ShapeSpec::Kind::kMesh) {
        meshes.push_back({i, g, Tessellate(geometries[g], robot.read_guard()), {}});
      }
    }
  }
  ForEachIndex(NumProcessors(), meshes.size(), [&](int, size_t i) {
    SceneMesh& entry = meshes[i];
    entry.pieces = PreparedPieces(entry.mesh, HullOf(entry.link, entry.geometry, impl).hull(), options,
                                  robot.read_guard().cache().get());
    entry.mesh = {};
  });
  return meshes;
}

/// Adds the shapes of all links with a concave mesh that are compared with scenes of solids.
void AddSceneShapes(const RobotModel& robot, const CollisionOptions& options, Impl& impl) {
  const std::vector<SceneMesh> meshes = DecomposeForScenes(robot, options, impl);
  auto next = meshes.begin();
  for (size_t i = 0; i < robot.links().size(); ++i) {
    ShapeRun run{static_cast<int>(impl.shapes.size()), 0};
    bool concave = false;
    for (size_t g = 0; g < robot.links()[i].collision.size(); ++g) {
      std::vector<ConvexShape> pieces;
      if (next != meshes.end() && next->link == i && next->geometry == g) pieces = (next++)->pieces;
      concave = concave || pieces.size() > 1;
      if (pieces.empty()) pieces.push_back(HullOf(i, g, impl));
      impl.shapes.insert(impl.shapes.end(), pieces.begin(), pieces.end());
    }
    if (concave) {
      run.count = static_cast<int>(impl.shapes.size()) - run.first;
      impl.links[i].scene = run;
    } else {
      impl.shapes.erase(impl.shapes.begin() + run.first, impl.shapes.end());
    }
  }
}

void PrepareRobot(const RobotModel& robot, Eigen::Ref<const Eigen::VectorXd> reference_x,
                  const CollisionOptions& options, Impl& impl) {
  for (const Link& link : robot.links()) AddHulls(link, robot.read_guard(), impl);
  TrimeshWorld world;
  LinkTrimeshes meshes(robot, world);
  // Without a list of pairs, as in datasets made before there were lists, all triangles are used: bits stay equal.
  LinkPieces pieces(robot, {options.link_concavity_m, options.max_link_pieces},
                    options.unchecked ? DecompositionMethod::kSample : DecompositionMethod::kAllTriangles);
  impl.pairs = options.unchecked ? ClassifyListedPairs(robot, meshes, pieces, *options.unchecked)
                                 : ClassifyLinkPairs(robot, meshes, pieces, reference_x, options.pairs);
  for (const LinkPair& pair : impl.pairs.decomposed) {
    const PairResolution detail = impl.pairs.detail[impl.PairIndex(pair.first, pair.second)];
    for (int link : {pair.first, pair.second}) AddDecomposition(link, detail, pieces, impl);
  }
  if (options.links == LinkRepresentation::kPieces) AddSceneShapes(robot, options, impl);
}

/// Adds the robot, from the cache of its read guard if it is there.
void AddRobot(const RobotModel& robot, Eigen::Ref<const Eigen::VectorXd> reference_x, const CollisionOptions& options,
              Impl& impl) {
  if (const ByteCache* cache = robot.read_guard().cache().get()) {
    const std::string key = RobotModelKey(robot, reference_x, options);
    const std::optional<std::string> stored = cache->Read(key);
    if (!stored || !DecodeRobotPart(*stored, robot.links().size(), &impl)) {
      PrepareRobot(robot, reference_x, options, impl);
      cache->Write(key, EncodeRobotPart(impl));
    }
  } else {
    PrepareRobot(robot, reference_x, options, impl);
  }
  if (options.unchecked) SelectListedPairs(robot, *options.unchecked, options.pairs, &impl.pairs);
  for (const ConvexShape& shape : impl.shapes) impl.ranges.push_back(impl.link_points.Add(shape.points()));
}

void AddSolids(const Scene& scene, const CollisionOptions& options, Impl& impl) {
  impl.solids = BuildSceneSolids(scene, options);
  std::vector<PointArena::Range> ranges;
  for (const ConvexShape& solid : impl.solids) ranges.push_back(impl.solid_points.Add(solid.points()));
  impl.solid_sets.resize(impl.solids.size());
  for (size_t i = 0; i < impl.solids.size(); ++i) {
    impl.solid_points.View(ranges[i], impl.solid_sets[i]);
    PlaceSupportSet(impl.solids[i], Eigen::Isometry3d::Identity(), impl.solid_sets[i]);
    impl.solid_sets[i].lower = impl.solids[i].bounds().min();
    impl.solid_sets[i].upper = impl.solids[i].bounds().max();
  }
}

HalfSpace PlaneOf(const std::vector<Eigen::Vector3d>& corners) {
  constexpr double kSliver = 1e-9;  // relative to the squared sides: below this, rounding dominates the normal
  const Eigen::Vector3d ab = corners[1] - corners[0];
  const Eigen::Vector3d ac = corners[2] - corners[0];
  const Eigen::Vector3d cross = ab.cross(ac);
  const double norm = cross.norm();
  if (!(norm > kSliver * std::max(ab.squaredNorm(), ac.squaredNorm()))) return {Eigen::Vector3d::Zero(), 0.0};
  const Eigen::Vector3d normal = cross / norm;
  return {normal, -normal.dot(corners[0])};
}

void AddTriangles(const Scene& scene, Impl& impl) {
  const TriangleMesh mesh = CollectSceneTriangles(scene);
  impl.triangle_tree.emplace(mesh);
  std::vector<PointArena::Range> ranges;
  std::vector<Eigen::Vector3d> corners(3);
  for (const auto& triangle : mesh.triangles) {
    for (size_t k = 0; k < 3; ++k) corners[k] = mesh.vertices[static_cast<size_t>(triangle[k])];
    ranges.push_back(impl.solid_points.Add(corners));
    impl.triangle_planes.push_back(PlaneOf(corners));
    SupportSet& set = impl.solid_sets.emplace_back();
    set.centre = (corners[0] + corners[1] + corners[2]) / 3.0;
    set.lower = corners[0].cwiseMin(corners[1]).cwiseMin(corners[2]);
    set.upper = corners[0].cwiseMax(corners[1]).cwiseMax(corners[2]);
  }
  for (size_t i = 0; i < ranges.size(); ++i) impl.solid_points.View(ranges[i], impl.solid_sets[i]);
}

}  // namespace

std::vector<ConvexShape> HullsOf(const Link& link, const ReadGuard& guard) {
  std::vector<ConvexShape> shapes;
  WithLinkInErrors(link, [&] {
    for (const ShapeSpec& spec : link.collision) {
      const bool mesh = spec.kind == ShapeSpec::Kind::kMesh;
      shapes.push_back(mesh ? ConvexShape::FromHull(PreparedHull(Tessellate(spec, guard).vertices, guard.cache().get()))
                            : ConvexShape::FromPrimitive(spec));
    }
  });
  return shapes;
}

CollisionModel::CollisionModel(std::unique_ptr<const Impl> impl) : impl_(std::move(impl)) {}
CollisionModel::~CollisionModel() = default;

std::shared_ptr<const CollisionModel> CollisionModel::Build(const RobotModel& robot, const Scene& scene,
                                                            Eigen::Ref<const Eigen::VectorXd> reference_x,
                                                            const CollisionOptions& options) {
  Validate(options);
  if (reference_x.size() != robot.configuration_size() || !reference_x.allFinite()) {
    throw InputError({"self-collision reference", "configuration", std::to_string(reference_x.size()) + " numbers",
                      "must have n + 7 = " + std::to_string(robot.configuration_size()) + " finite numbers",
                      "list all joints, base position and quaternion"});
  }
  auto impl = std::make_unique<Impl>();
  AddRobot(robot, reference_x, options, *impl);
  impl->scene = options.scene;
  if (impl->surface()) {
    AddTriangles(scene, *impl);
  } else {
    AddSolids(scene, options, *impl);
  }
  return std::shared_ptr<const CollisionModel>(new CollisionModel(std::move(impl)));
}

int CollisionModel::num_links() const { return static_cast<int>(impl_->links.size()); }

const std::vector<LinkPair>& CollisionModel::checked_pairs() const { return impl_->pairs.checked(); }

const std::vector<LinkPair>& CollisionModel::pairs(PairSelection selection) const {
  return impl_->pairs.pairs[selection];
}

CollisionModel::PairStatus CollisionModel::pair_status(int a, int b) const {
  const int n = num_links();
  if (a < 0 || b < 0 || a >= n || b >= n || a == b) {
    std::fprintf(stderr, "pair_status: links %d and %d of %d\n", a, b, n);
    std::abort();
  }
  return impl_->pairs.status[impl_->PairIndex(a, b)];
}

const std::vector<LinkPair>& CollisionModel::decomposed_pairs() const { return impl_->pairs.decomposed; }

int CollisionModel::num_link_pieces(int link) const { return impl_->links.at(static_cast<size_t>(link)).hulls.count; }

const CollisionModel::Ball& CollisionModel::link_ball(int link) const {
  return impl_->links.at(static_cast<size_t>(link)).ball;
}

SceneRepresentation CollisionModel::scene_representation() const { return impl_->scene; }

int CollisionModel::num_scene_solids() const { return static_cast<int>(impl_->solid_sets.size()); }

bool CollisionModel::SceneContains(const Eigen::Vector3d& point_W, double depth_m) const {
  for (const ConvexShape& solid : impl_->solids) {
    if (solid.bounds().contains(point_W) && solid.BoundaryDistance(point_W) < -depth_m) return true;
  }
  return false;
}

double MaxDisplacement(const CollisionModel::Ball& ball, const Eigen::Isometry3d& a, const Eigen::Isometry3d& b) {
  const Eigen::Matrix3d turn = b.linear() - a.linear();  // Frobenius norm 2 sqrt(2) sin(angle / 2)
  const Eigen::Vector3d shift = turn * ball.centre + (b.translation() - a.translation());
  return shift.norm() + ball.radius * turn.norm() / std::numbers::sqrt2;
}

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
