#include "legopt/geometry/internal/prepared_geometry.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

#include "legopt/geometry/internal/link_pieces.h"
#include "legopt/geometry/internal/mesh.h"
#include "legopt/geometry/internal/mesh_reader.h"
#include "legopt/math/blake2b.h"

namespace legopt {
namespace {

constexpr char kHull = 'H';
constexpr char kPieces = 'P';
constexpr char kRobot = 'R';
constexpr const char* kVersion = "legopt-geometry/4";  // changes with every computation whose result is kept

template <class Value>
std::string_view BytesOf(const Value* values, size_t count) {
  return {reinterpret_cast<const char*>(values), count * sizeof(Value)};
}

void AddHull(const ConvexHull& hull, ResultWriter* writer) {
  writer->Add(hull.vertices);
  writer->Add(hull.facets);
  writer->Add(hull.triangles);
  writer->Add(std::array<double, 1>{hull.volume_m3});
}

bool ReadHull(ResultReader* reader, ConvexHull* hull) {
  std::vector<double> volume;
  if (!reader->Read(hull->vertices) || !reader->Read(hull->facets) || !reader->Read(hull->triangles) ||
      !reader->Read(volume) || volume.size() != 1 || hull->vertices.empty()) {
    return false;
  }
  hull->volume_m3 = volume[0];
  const int count = static_cast<int>(hull->vertices.size());
  return std::ranges::all_of(hull->triangles, [count](const std::array<int, 3>& triangle) {
    return std::ranges::all_of(triangle, [count](int corner) { return corner >= 0 && corner < count; });
  });
}

/// A primitive, or the place of a hull.
struct Header {
  int kind = 0;
  std::array<double, 16> pose{};
  std::array<double, 3> size{};
};

bool ReadShape(ResultReader* reader, std::vector<ConvexShape>* shapes) {
  std::vector<Header> header;
  if (!reader->Read(header) || header.size() != 1) return false;
  const auto kind = static_cast<ConvexShape::Kind>(header[0].kind);
  if (kind == ConvexShape::Kind::kHull) {
    ConvexHull hull;
    if (!ReadHull(reader, &hull)) return false;
    shapes->push_back(ConvexShape::FromHull(std::move(hull)));
    return true;
  }
  ShapeSpec spec;
  switch (kind) {
    case ConvexShape::Kind::kBox:
      spec.kind = ShapeSpec::Kind::kBox;
      break;
    case ConvexShape::Kind::kSphere:
      spec.kind = ShapeSpec::Kind::kSphere;
      break;
    case ConvexShape::Kind::kCapsule:
      spec.kind = ShapeSpec::Kind::kCapsule;
      break;
    case ConvexShape::Kind::kCylinder:
      spec.kind = ShapeSpec::Kind::kCylinder;
      break;
    default:
      return false;
  }
  spec.pose.matrix() = Eigen::Map<const Eigen::Matrix4d>(header[0].pose.data());
  spec.size = Eigen::Map<const Eigen::Vector3d>(header[0].size.data());
  if (!(spec.size.minCoeff() >= 0.0) || !spec.size.allFinite() || !spec.pose.matrix().allFinite()) return false;
  shapes->push_back(ConvexShape::FromPrimitive(spec));
  return true;
}

/// Reads a number of shapes.
bool ReadShapes(ResultReader* reader, std::vector<ConvexShape>* shapes) {
  std::vector<std::uint64_t> count;
  if (!reader->Read(count) || count.size() != 1) return false;
  for (std::uint64_t i = 0; i < count[0]; ++i) {
    if (!ReadShape(reader, shapes)) return false;
  }
  return true;
}

void AddShapes(std::span<const ConvexShape> shapes, ResultWriter* writer) {
  writer->Add(std::array<std::uint64_t, 1>{shapes.size()});
  for (const ConvexShape& shape : shapes) {
    Header header;
    header.kind = static_cast<int>(shape.kind());
    std::copy_n(shape.pose().data(), header.pose.size(), header.pose.begin());
    std::copy_n(shape.size().data(), header.size.size(), header.size.begin());
    writer->Add(std::array<Header, 1>{header});
    if (shape.kind() == ConvexShape::Kind::kHull) AddHull(shape.hull(), writer);
  }
}

/// Adds a mesh by the hashes of its content.
void AddMesh(const TriangleMesh& mesh, ResultWriter* key) {
  key->Add(Blake2bHex(BytesOf(mesh.vertices.data(), mesh.vertices.size())));
  key->Add(Blake2bHex(BytesOf(mesh.triangles.data(), mesh.triangles.size())));
}

bool IsRun(const ShapeRun& run, size_t shapes) {
  return run.first >= 0 && run.count >= 0 && static_cast<size_t>(run.first) <= shapes &&
         static_cast<size_t>(run.count) <= shapes - static_cast<size_t>(run.first);
}

bool ArePairs(const std::vector<LinkPair>& pairs, size_t links) {
  return std::ranges::all_of(pairs, [links](const LinkPair& pair) {
    return pair.first >= 0 && pair.first < pair.second && static_cast<size_t>(pair.second) < links;
  });
}

bool AreFalseDepths(const LinkPairRules& rules) {
  return (rules.false_depths_m.empty() || rules.false_depths_m.size() == rules.decomposed.size()) &&
         std::ranges::all_of(rules.false_depths_m, [](double depth) { return std::isfinite(depth) && depth >= 0.0; });
}

bool DecodeInto(ResultReader* reader, size_t num_links, CollisionModel::Impl* impl) {
  if (!ReadShapes(reader, &impl->shapes)) return false;
  LinkPairRules& pairs = impl->pairs;
  std::vector<PairSelection> selection;
  if (!reader->Read(impl->links) || !reader->Read(pairs.status) || !reader->Read(pairs.detail) ||
      !reader->Read(pairs.decomposed) || !reader->Read(pairs.false_depths_m) || !reader->Read(selection) ||
      !reader->Read(pairs.pairs[PairSelection::kReference]) || !reader->Read(pairs.pairs[PairSelection::kAll]) ||
      !reader->at_end() || selection.size() != 1 || !IsEnumNumber<PairSelection>(EnumNumber(selection[0]))) {
    return false;
  }
  pairs.selection = selection[0];
  const size_t shapes = impl->shapes.size();
  const bool links = impl->links.size() == num_links && std::ranges::all_of(impl->links, [&](const LinkShapes& link) {
                       return IsRun(link.hulls, shapes) && IsRun(link.pieces, shapes) && IsRun(link.bodies, shapes) &&
                              IsRun(link.scene, shapes) && link.whole >= -1 && link.whole < static_cast<int>(shapes);
                     });
  return links && pairs.status.size() == num_links * num_links && pairs.detail.size() == num_links * num_links &&
         ArePairs(pairs.decomposed, num_links) && AreFalseDepths(pairs) &&
         ArePairs(pairs.pairs[PairSelection::kReference], num_links) &&
         ArePairs(pairs.pairs[PairSelection::kAll], num_links);
}

}  // namespace

ConvexHull PreparedHull(std::span<const Eigen::Vector3d> points, const ByteCache* cache) {
  constexpr size_t kFewPoints = 500;  // their hull takes less time than a file
  if (cache == nullptr || points.size() < kFewPoints) return ComputeHull(points);
  const std::string key =
      Blake2bHex(std::string(kVersion) + kHull + std::string(BytesOf(points.data(), points.size())));
  if (const std::optional<std::string> bytes = cache->Read(key); bytes && !bytes->empty() && bytes->front() == kHull) {
    ConvexHull hull;
    ResultReader reader(std::string_view(*bytes).substr(1));
    if (ReadHull(&reader, &hull) && reader.at_end()) return hull;
  }
  ConvexHull hull = ComputeHull(points);
  ResultWriter writer(kHull);
  AddHull(hull, &writer);
  cache->Write(key, writer.Take());
  return hull;
}

std::vector<ConvexShape> PreparedPieces(const TriangleMesh& mesh, const ConvexHull& hull,
                                        const CollisionOptions& options, const ByteCache* cache) {
  constexpr size_t kFewTriangles = 500;  // their pieces take less time than a file
  if (cache == nullptr || mesh.triangles.size() < kFewTriangles) return PiecesOfLinkMesh(mesh, hull, options);
  ResultWriter description(kPieces);
  description.Add(std::string(kVersion));
  AddMesh(mesh, &description);
  description.Add(std::array<double, 2>{options.scene_concavity_m, static_cast<double>(options.max_component_pieces)});
  const std::string key = Blake2bHex(description.Take());
  if (const std::optional<std::string> bytes = cache->Read(key);
      bytes && !bytes->empty() && bytes->front() == kPieces) {
    std::vector<ConvexShape> pieces;
    ResultReader reader(std::string_view(*bytes).substr(1));
    if (ReadShapes(&reader, &pieces) && reader.at_end()) return pieces;
  }
  std::vector<ConvexShape> pieces = PiecesOfLinkMesh(mesh, hull, options);
  ResultWriter writer(kPieces);
  AddShapes(pieces, &writer);
  cache->Write(key, writer.Take());
  return pieces;
}

std::string RobotModelKey(const RobotModel& robot, Eigen::Ref<const Eigen::VectorXd> reference_x,
                          const CollisionOptions& options) {
  ResultWriter key(kRobot);
  key.Add(std::string(kVersion));
  const auto number = [&](double value) { key.Add(std::array<double, 1>{value}); };
  for (const Joint& joint : robot.joints()) {
    for (const double value : {static_cast<double>(joint.type), static_cast<double>(joint.parent_link), joint.lower,
                               joint.upper, static_cast<double>(joint.leader), joint.multiplier, joint.offset}) {
      number(value);
    }
    key.Add(std::string(BytesOf(joint.origin.data(), 16)));
    key.Add(std::string(BytesOf(joint.axis.data(), 3)));
  }
  for (const Link& link : robot.links()) {
    number(static_cast<double>(link.collision.size()));
    for (const ShapeSpec& shape : link.collision) {
      number(static_cast<double>(shape.kind));
      key.Add(std::string(BytesOf(shape.size.data(), 3)));
      key.Add(std::string(BytesOf(shape.pose.data(), 16)));
      if (shape.kind != ShapeSpec::Kind::kMesh) continue;
      AddMesh(Tessellate(shape, robot.read_guard()), &key);
    }
  }
  // Listed pairs depend neither on the reference posture nor on the selection.
  if (!options.unchecked) {
    key.Add(std::string(BytesOf(reference_x.data(), static_cast<size_t>(reference_x.size()))));
    number(static_cast<double>(options.pairs));
  }
  for (const double value : {options.link_concavity_m, static_cast<double>(options.max_link_pieces),
                             options.scene_concavity_m, static_cast<double>(options.max_component_pieces),
                             static_cast<double>(options.links), options.unchecked ? 1.0 : 0.0}) {
    number(value);
  }
  if (options.unchecked) {
    for (const UncheckedPair& entry : *options.unchecked) {
      key.Add(std::array<int, 3>{entry.pair.first, entry.pair.second, static_cast<int>(entry.reason)});
    }
  }
  return Blake2bHex(key.Take());
}

std::string EncodeRobotPart(const CollisionModel::Impl& impl) {
  ResultWriter writer(kRobot);
  AddShapes(impl.shapes, &writer);
  writer.Add(impl.links);
  writer.Add(impl.pairs.status);
  writer.Add(impl.pairs.detail);
  writer.Add(impl.pairs.decomposed);
  writer.Add(impl.pairs.false_depths_m);
  writer.Add(std::array<PairSelection, 1>{impl.pairs.selection});
  writer.Add(impl.pairs.pairs[PairSelection::kReference]);
  writer.Add(impl.pairs.pairs[PairSelection::kAll]);
  return writer.Take();
}

bool DecodeRobotPart(const std::string& bytes, size_t num_links, CollisionModel::Impl* impl) {
  if (bytes.empty() || bytes.front() != kRobot) return false;
  ResultReader reader(std::string_view(bytes).substr(1));
  if (DecodeInto(&reader, num_links, impl)) return true;
  impl->shapes.clear();
  impl->links.clear();
  impl->pairs = {};
  return false;
}

}  // namespace legopt
