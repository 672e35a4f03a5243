// Policy: geometry from the cache has the bits of the computation; entries that are damaged, or of other inputs, are
// not used.
#include "legopt/geometry/internal/prepared_geometry.h"

#include <gtest/gtest.h>

#include <map>
#include <string>

#include "tests/geometry/test_shapes.h"

namespace legopt::test {
namespace {

class MapCache : public ByteCache {
 public:
  std::optional<std::string> Read(std::string_view key) const override {
    const auto found = entries_.find(std::string(key));
    return found == entries_.end() ? std::nullopt : std::optional(found->second);
  }
  void Write(std::string_view key, std::string_view bytes) const override {
    entries_[std::string(key)] = std::string(bytes);
    ++writes_;
  }
  int writes() const { return writes_; }
  void ShortenAll() const {
    for (auto& [key, bytes] : entries_) bytes.resize(bytes.size() - 3);
  }

 private:
  mutable std::map<std::string, std::string> entries_;
  mutable int writes_ = 0;
};

/// Two balls side by side, of about a thousand triangles.
TriangleMesh TwoBalls(double distance_m) {
  TriangleMesh mesh;
  for (const double side : {-0.5, 0.5}) {
    const Eigen::Isometry3d pose(Eigen::Translation3d(side * distance_m, 0.0, 0.0));
    const TriangleMesh ball = Tessellate(Spec(ShapeSpec::Kind::kSphere, {0.1, 0.0, 0.0}, pose));
    const int first = static_cast<int>(mesh.vertices.size());
    mesh.vertices.insert(mesh.vertices.end(), ball.vertices.begin(), ball.vertices.end());
    for (const auto& [a, b, c] : ball.triangles) mesh.triangles.push_back({first + a, first + b, first + c});
  }
  return mesh;
}

std::vector<Eigen::Vector3d> CornersOf(const std::vector<ConvexShape>& shapes) {
  std::vector<Eigen::Vector3d> corners;
  for (const ConvexShape& shape : shapes) {
    corners.insert(corners.end(), shape.hull().vertices.begin(), shape.hull().vertices.end());
  }
  return corners;
}

TEST(PreparedPieces, FromTheCacheHaveTheSameBits) {
  const MapCache cache;
  const TriangleMesh mesh = TwoBalls(0.5);
  ASSERT_GE(mesh.triangles.size(), 500U) << "smaller meshes are not kept";
  const ConvexHull hull = ComputeHull(mesh.vertices);
  const auto computed = PreparedPieces(mesh, hull, {}, nullptr);
  ASSERT_EQ(computed.size(), 2U);
  const auto first = PreparedPieces(mesh, hull, {}, &cache);
  EXPECT_EQ(cache.writes(), 1);
  const auto second = PreparedPieces(mesh, hull, {}, &cache);
  EXPECT_EQ(cache.writes(), 1);
  EXPECT_EQ(CornersOf(first), CornersOf(computed));
  EXPECT_EQ(CornersOf(second), CornersOf(computed));
}

TEST(PreparedPieces, OtherInputsAndDamagedEntriesAreComputed) {
  const MapCache cache;
  const TriangleMesh mesh = TwoBalls(0.5);
  const ConvexHull hull = ComputeHull(mesh.vertices);
  const auto pieces = PreparedPieces(mesh, hull, {}, &cache);
  PreparedPieces(TwoBalls(0.6), ComputeHull(TwoBalls(0.6).vertices), {}, &cache);
  PreparedPieces(mesh, hull, {.max_component_pieces = 1}, &cache);
  EXPECT_EQ(cache.writes(), 3);
  cache.ShortenAll();
  EXPECT_EQ(CornersOf(PreparedPieces(mesh, hull, {}, &cache)), CornersOf(pieces));
  EXPECT_EQ(cache.writes(), 4);
}

TEST(PreparedHull, FromTheCacheHasTheSameBits) {
  const MapCache cache;
  const TriangleMesh mesh = TwoBalls(0.5);
  ASSERT_GE(mesh.vertices.size(), 500U) << "smaller hulls are not kept";
  const ConvexHull computed = ComputeHull(mesh.vertices);
  for (int use = 0; use < 2; ++use) {
    const ConvexHull hull = PreparedHull(mesh.vertices, &cache);
    EXPECT_EQ(hull.vertices, computed.vertices);
    EXPECT_EQ(hull.triangles, computed.triangles);
    EXPECT_EQ(hull.volume_m3, computed.volume_m3);
  }
  EXPECT_EQ(cache.writes(), 1);
}

}  // namespace
}  // namespace legopt::test
