// Policy: planes, height maps and the mesh formats of scenes give the solids that their description promises.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "legopt/dataset/scene_file.h"
#include "legopt/geometry/internal/mesh_repair.h"
#include "legopt/geometry/internal/scene_solids.h"
#include "tests/dataset/test_data.h"

namespace legopt {
namespace {

using test::MessageOf;
using test::WriteText;
using testing::HasSubstr;

class SceneShapesTest : public testing::Test {
 protected:
  Scene Read(const std::string& text) {
    WriteText(folder_.path() / "scene.yaml", text);
    return ReadSceneFile(folder_.path() / "scene.yaml");
  }
  std::string Message(const std::string& text) {
    return MessageOf([&] { Read(text); });
  }
  test::TemporaryFolder folder_;
};

Eigen::AlignedBox3d BoxOf(const Scene& scene) {
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3d& vertex : CollectSceneTriangles(scene).vertices) box.extend(vertex);
  return box;
}

TEST_F(SceneShapesTest, APlaneIsASlabBelowIt) {
  const Eigen::AlignedBox3d level = BoxOf(Read("objects:\n  - {name: ground, shape: plane, normal: [0, 0, 1]}\n"));
  EXPECT_EQ(level.min(), Eigen::Vector3d(-20, -20, -0.5));
  EXPECT_EQ(level.max(), Eigen::Vector3d(20, 20, 0));
  const Scene wall = Read(
      "objects:\n  - {name: w, shape: plane, normal: [2, 0, 0], position: [3, 0, 1], size: [4, 6], thickness: 0.2}\n");
  const Eigen::AlignedBox3d box = BoxOf(wall);
  EXPECT_NEAR(box.max().x(), 3.0, 1e-12);
  EXPECT_NEAR(box.min().x(), 2.8, 1e-12);
  EXPECT_THAT(Message("objects:\n  - {name: g, shape: plane, normal: [0, 0, 0]}\n"), HasSubstr("no direction"));
  EXPECT_THAT(Message("objects:\n  - {name: g, shape: plane, size: [1, 2, 3]}\n"), HasSubstr("2 lengths"));
  EXPECT_THAT(Message("objects:\n  - {name: g, shape: plane, thickness: 0}\n"), HasSubstr("greater than 0"));
}

TEST_F(SceneShapesTest, AHeightMapIsAClosedSolid) {
  WriteText(folder_.path() / "hill.pgm", "P2 3 3 4\n0 0 0\n0 4 0\n0 0 0\n");
  WriteText(folder_.path() / "hill.txt", "0 0 0\n0 2 0\n0 0 0\n");
  const Scene picture =
      Read("objects:\n  - {name: hill, shape: heightmap, file: hill.pgm, size: [10, 10, 2], position: [1, 2, 3]}\n");
  const Scene numbers = Read("objects:\n  - {name: hill, shape: heightmap, file: hill.txt, size: [10, 10]}\n");
  EXPECT_EQ(BoxOf(picture).min(), Eigen::Vector3d(-4, -3, 2.5));
  EXPECT_EQ(BoxOf(picture).max(), Eigen::Vector3d(6, 7, 5));
  EXPECT_EQ(BoxOf(numbers).max().z(), 2.0);
  EXPECT_TRUE(FindMeshFaults(CollectSceneTriangles(picture)).none());
  EXPECT_NEAR(EnclosedVolume(CollectSceneTriangles(picture)), EnclosedVolume(CollectSceneTriangles(numbers)), 1e-9);
  EXPECT_THAT(Message("objects:\n  - {name: g, shape: heightmap, file: no.png, size: [1, 1, 1]}\n"),
              HasSubstr("does not exist"));
  EXPECT_THAT(Message("objects:\n  - {name: g, shape: heightmap, file: hill.pgm, size: [1, 1]}\n"),
              HasSubstr("3 lengths"));
  EXPECT_THAT(Message("objects:\n  - {name: g, shape: heightmap, file: hill.obj, size: [1, 1, 1]}\n"),
              HasSubstr("not a height map"));
}

constexpr const char* kOffBox =
    "OFF\n8 6 0\n0 0 0\n1 0 0\n1 2 0\n0 2 0\n0 0 3\n1 0 3\n1 2 3\n0 2 3\n"
    "4 0 3 2 1\n4 4 5 6 7\n4 0 1 5 4\n4 1 2 6 5\n4 2 3 7 6\n4 3 0 4 7\n";

TEST_F(SceneShapesTest, OffIsAMesh) {
  WriteText(folder_.path() / "box.off", kOffBox);
  const TriangleMesh mesh = CollectSceneTriangles(ReadSceneFile(folder_.path() / "box.off"));
  EXPECT_TRUE(FindMeshFaults(mesh).none());
  EXPECT_NEAR(EnclosedVolume(mesh), 6.0, 1e-6);
}

/// A tetrahedron with corners at 0, x = 1, y = 2 and z = 3 of the file, its buffer in base64.
std::string Gltf(const std::string& uri) {
  return R"({"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
    "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
    "accessors": [{"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3", "min": [0, 0, 0], "max": [1, 2, 3]},
      {"bufferView": 1, "componentType": 5123, "count": 12, "type": "SCALAR"}],
    "bufferViews": [{"buffer": 0, "byteOffset": 0, "byteLength": 48}, {"buffer": 0, "byteOffset": 48, "byteLength": 24}],
    "buffers": [{"byteLength": 72, "uri": ")" +
         uri + "\"}]}";
}

constexpr const char* kTetrahedron =
    "data:application/octet-stream;base64,"
    "AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAAEAAAAAAAAAAAAAAAAAAAEBAAAACAAEAAAABAAMAAAADAAIAAQACAAMA";

TEST_F(SceneShapesTest, TheUpAxisOfGltfIsTurnedToZ) {
  WriteText(folder_.path() / "box.gltf", Gltf(kTetrahedron));
  const Scene scene = ReadSceneFile(folder_.path() / "box.gltf");
  EXPECT_NEAR(EnclosedVolume(CollectSceneTriangles(scene)), 1.0, 1e-6);
  EXPECT_TRUE(BoxOf(scene).min().isApprox(Eigen::Vector3d(0, -3, 0)));
  EXPECT_TRUE(BoxOf(scene).max().isApprox(Eigen::Vector3d(1, 0, 2)));
}

TEST_F(SceneShapesTest, GltfNamesNoFilesElsewhere) {
  for (const std::string uri : {"/etc/hostname", "../data.bin", "absent.bin"}) {
    WriteText(folder_.path() / "box.gltf", Gltf(uri));
    EXPECT_THAT(MessageOf([&] { CollectSceneTriangles(ReadSceneFile(folder_.path() / "box.gltf")); }), HasSubstr(uri));
  }
}

TEST_F(SceneShapesTest, AnStlThatEndsEarlyIsRefused) {
  const std::string facet =
      "facet normal 0 0 0\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\n";
  WriteText(folder_.path() / "cut.stl", "solid a\n" + facet + "facet normal 0 0 0\nouter loop\nver");
  EXPECT_THAT(MessageOf([&] { CollectSceneTriangles(ReadSceneFile(folder_.path() / "cut.stl")); }),
              HasSubstr("ends early"));
  WriteText(folder_.path() / "whole.stl", "solid a\n" + facet + "endsolid a\n");
  EXPECT_EQ(CollectSceneTriangles(ReadSceneFile(folder_.path() / "whole.stl")).triangles.size(), 1U);
}

}  // namespace
}  // namespace legopt
