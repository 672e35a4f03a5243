#include "legopt/geometry/internal/mesh.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <limits>
#include <map>
#include <sstream>

#include "app/isolated_call.h"
#include "legopt/types/input_error.h"
#include "tests/geometry/test_shapes.h"
#include "tests/temporary_folder.h"

namespace legopt::test {
namespace {

class MeshFile : public ::testing::Test {
 protected:
  std::string Write(const std::string& name, const std::string& content) const {
    std::ofstream(folder_ / name, std::ios::binary) << content;
    return (folder_ / name).string();
  }

  static std::string BinaryStl(const std::vector<std::array<float, 9>>& triangles) {
    std::string bytes(80, ' ');
    const auto append = [&](const auto& value) { bytes.append(reinterpret_cast<const char*>(&value), sizeof(value)); };
    append(static_cast<std::uint32_t>(triangles.size()));
    for (const auto& t : triangles) {
      for (int i = 0; i < 3; ++i) append(0.0F);
      for (float c : t) append(c);
      append(static_cast<std::uint16_t>(0));
    }
    return bytes;
  }

  /// Returns the error that LoadMesh reports; empty if it does not throw.
  static std::string ErrorOf(const std::string& path, const Eigen::Vector3d& scale = Eigen::Vector3d::Ones()) {
    try {
      LoadMesh(path, scale, CallIsolated);
    } catch (const InputError& error) {
      EXPECT_EQ(error.fault().file, path);
      EXPECT_FALSE(error.fault().fix.empty());
      return error.what();
    }
    return "";
  }

  TemporaryFolder folder_;
};

const std::vector<std::array<float, 9>> kTetrahedron = {
    {0, 0, 0, 0, 1, 0, 1, 0, 0}, {0, 0, 0, 1, 0, 0, 0, 0, 1}, {0, 0, 0, 0, 0, 1, 0, 1, 0}, {1, 0, 0, 0, 1, 0, 0, 0, 1}};

double SignedVolume(const TriangleMesh& mesh) {
  double volume = 0.0;
  for (const auto& t : mesh.triangles) {
    const auto at = [&](size_t k) { return mesh.vertices[static_cast<size_t>(t[k])]; };
    volume += at(0).cross(at(1)).dot(at(2)) / 6.0;
  }
  return volume;
}

TEST_F(MeshFile, StlIsWeldedAndKeepsTriangleOrder) {
  const TriangleMesh mesh = LoadMesh(Write("tetra.stl", BinaryStl(kTetrahedron)));
  EXPECT_EQ(mesh.vertices.size(), 4U);
  ASSERT_EQ(mesh.triangles.size(), 4U);
  EXPECT_NEAR(SignedVolume(mesh), 1.0 / 6.0, 1e-12);
  EXPECT_EQ(mesh.vertices[static_cast<size_t>(mesh.triangles[3][0])], Eigen::Vector3d(1, 0, 0));
}

/// Returns a COLLADA file whose array of coordinates has this count attribute.
std::string TetrahedronDae(const std::string& count) {
  return R"(<?xml version="1.0"?><COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<asset><unit name="centimeter" meter="0.01"/><up_axis>Z_UP</up_axis></asset>
<library_geometries><geometry id="g"><mesh>
<source id="p"><float_array id="pa" )" +
         count + R"(>0 0 0 100 0 0 0 100 0 0 0 100</float_array>
<technique_common><accessor source="#pa" count="4" stride="3"><param name="X" type="float"/>
<param name="Y" type="float"/><param name="Z" type="float"/></accessor></technique_common></source>
<vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
<triangles count="4"><input semantic="VERTEX" source="#v" offset="0"/><p>0 2 1 0 1 3 0 3 2 1 2 3</p></triangles>
</mesh></geometry></library_geometries>
<library_visual_scenes><visual_scene id="s"><node id="n"><instance_geometry url="#g"/></node></visual_scene>
</library_visual_scenes><scene><instance_visual_scene url="#s"/></scene></COLLADA>)";
}

TEST_F(MeshFile, ObjPlyAndDaeGiveTheSameTetrahedron) {
  const std::string obj = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";
  const std::string ply =
      "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
      "element face 4\nproperty list uchar int vertex_indices\nend_header\n"
      "0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n";
  for (const auto& [name, content] :
       std::map<std::string, std::string>{{"t.obj", obj}, {"t.ply", ply}, {"t.dae", TetrahedronDae("count=\"12\"")}}) {
    const TriangleMesh mesh = LoadMesh(Write(name, content));
    EXPECT_EQ(mesh.vertices.size(), 4U) << name;
    EXPECT_EQ(mesh.triangles.size(), 4U) << name;
    EXPECT_NEAR(SignedVolume(mesh), 1.0 / 6.0, 1e-6) << name;
    for (const Eigen::Vector3d& v : mesh.vertices) EXPECT_LT(v.norm(), 1.0 + 1e-6) << name;
  }
}

TEST_F(MeshFile, TextStlMayBeInCapitals) {
  std::string text = "SOLID A\n";
  for (const char* corners : {"0 0 0 0 1 0 1 0 0", "0 0 0 1 0 0 0 0 1", "0 0 0 0 0 1 0 1 0", "1 0 0 0 1 0 0 0 1"}) {
    std::istringstream words(corners);
    text += "FACET NORMAL 0 0 0\nOUTER LOOP\n";
    for (std::string x, y, z; words >> x >> y >> z;) text += "VERTEX " + x + " " + y + " " + z + "\n";
    text += "ENDLOOP\nENDFACET\n";
  }
  const TriangleMesh mesh = LoadMesh(Write("capitals.stl", text + "ENDSOLID A\n"));
  EXPECT_EQ(mesh.vertices.size(), 4U);
  EXPECT_NEAR(SignedVolume(mesh), 1.0 / 6.0, 1e-12);
}

// Assimp itself only reads lower-case keywords and would omit such facets.
TEST_F(MeshFile, CapitalsInAPartOfATextStlAreRead) {
  std::string text = "solid a\n";
  const auto add = [&text](const char* corners, bool capitals) {
    std::string facet = std::string("facet normal 0 0 0\nouter loop\n") + corners + "endloop\nendfacet\n";
    if (capitals)
      std::transform(facet.begin(), facet.end(), facet.begin(), [](unsigned char c) { return std::toupper(c); });
    text += facet;
  };
  add("vertex 0 0 0\nvertex 0 1 0\nvertex 1 0 0\n", false);
  add("vertex 0 0 0\nvertex 1 0 0\nvertex 0 0 1\n", true);
  EXPECT_EQ(LoadMesh(Write("mixed.stl", text + "endsolid a\n")).triangles.size(), 2U);
}

TEST_F(MeshFile, AHeaderWithTheWordsOfATextStlIsBinaryAllTheSame) {
  std::string stl = BinaryStl(kTetrahedron);
  const std::string words = "solid of 4 facets";
  stl.replace(0, words.size(), words);
  const TriangleMesh mesh = LoadMesh(Write("words.stl", stl));
  EXPECT_EQ(mesh.triangles.size(), 4U);
  EXPECT_NEAR(SignedVolume(mesh), 1.0 / 6.0, 1e-12);
  EXPECT_EQ(LoadMesh(Write("words-tail.stl", stl + "made by X")).triangles.size(), 4U);
}

TEST_F(MeshFile, AColladaUnitIsAPositiveNumber) {
  std::string dae = TetrahedronDae("count=\"12\"");
  const std::string unit = "meter=\"0.01\"";
  for (const char* meter : {"0,01", "-1", "0", "nan", "1e999", "x", ""}) {
    std::string other = dae;
    other.replace(other.find(unit), unit.size(), std::string("meter=\"") + meter + "\"");
    const std::string file = Write("unit.dae", other);
    EXPECT_THAT([&] { LoadMesh(file); }, testing::ThrowsMessage<InputError>(testing::HasSubstr("unit of length")))
        << meter;
  }
}

TEST_F(MeshFile, BytesBehindTheLastTriangleOfAnStlAreLeftOut) {
  const TriangleMesh mesh = LoadMesh(Write("tail.stl", BinaryStl(kTetrahedron) + "made by X"));
  EXPECT_EQ(mesh.triangles.size(), 4U);
  EXPECT_NEAR(SignedVolume(mesh), 1.0 / 6.0, 1e-12);
}

TEST_F(MeshFile, AnStlOfAnotherNumberOfTrianglesIsRefusedWithTheCause) {
  for (const int count : {3, 5, 1'000'000}) {
    std::string bytes = BinaryStl(kTetrahedron);
    for (int i = 0; i < 4; ++i) bytes[80 + static_cast<std::size_t>(i)] = static_cast<char>((count >> (8 * i)) & 0xFF);
    EXPECT_NE(ErrorOf(Write("count.stl", bytes)).find("number of triangles"), std::string::npos) << count;
  }
}

TEST_F(MeshFile, BinaryPlyWhoseDataBeginWithALineEndIsRefused) {
  const std::string header =
      "ply\nformat binary_little_endian 1.0\nelement vertex 1\nproperty uchar x\nproperty uchar y\nproperty uchar z\n"
      "end_header\n";
  EXPECT_NE(ErrorOf(Write("feed.ply", header + "\n12")).find("line end"), std::string::npos);
  EXPECT_NE(ErrorOf(Write("return.ply", header + "\r12")).find("line end"), std::string::npos);
}

TEST_F(MeshFile, ScaleAppliesAndMirroringKeepsOutsideOutside) {
  const std::string path = Write("tetra.stl", BinaryStl(kTetrahedron));
  EXPECT_NEAR(SignedVolume(LoadMesh(path, {2, 3, 4})), 24.0 / 6.0, 1e-12);
  const TriangleMesh mirrored = LoadMesh(path, {1, -1, 1});
  EXPECT_NEAR(SignedVolume(mirrored), 1.0 / 6.0, 1e-12);
  for (const Eigen::Vector3d& v : mirrored.vertices) EXPECT_LE(v.y(), 0.0);
}

TEST_F(MeshFile, BadFilesAreRefusedByName) {
  EXPECT_NE(ErrorOf((folder_ / "absent.stl").string()).find("does not exist"), std::string::npos);
  EXPECT_NE(ErrorOf(folder_.path().string()).find("does not exist or is not a file"), std::string::npos);
  EXPECT_NE(ErrorOf(Write("noise.stl", "this is no mesh")).find("cannot be read"), std::string::npos);
  EXPECT_NE(ErrorOf(Write("empty.stl", "")).find("cannot be read"), std::string::npos);
  EXPECT_NE(ErrorOf(Write("truncated.stl", BinaryStl(kTetrahedron).substr(0, 150))), "");
  EXPECT_NE(ErrorOf(Write("none.stl", BinaryStl({}))), "");
  EXPECT_NE(ErrorOf(Write("points.obj", "v 0 0 0\nv 1 0 0\n")), "");
  EXPECT_NE(ErrorOf(Write("mesh.xyz", BinaryStl(kTetrahedron))), "");
}

TEST_F(MeshFile, NumbersOfAnObjMayBeginWithAPoint) {
  const TriangleMesh mesh =
      LoadMesh(Write("a.obj", "# .5\nv .5 -.25 0\nv 1 +.5 .0\r\nv\t0 1 2.5\nvn .1 .2 .3\nf 1 2 3\n"));
  ASSERT_EQ(mesh.vertices.size(), 3U);
  EXPECT_EQ(mesh.vertices[0], Eigen::Vector3d(0.5, -0.25, 0));
  EXPECT_EQ(mesh.vertices[1], Eigen::Vector3d(1, 0.5, 0));
  EXPECT_EQ(mesh.vertices[2], Eigen::Vector3d(0, 1, 2.5));
}

TEST_F(MeshFile, WhatStandsInPlaceOfAFileIsNamed) {
  for (const char* suffix : {".stl", ".obj", ".dae", ".ply", ".off", ".glb", ".gltf"}) {
    const std::string name = std::string("a") + suffix;
    EXPECT_THAT(ErrorOf(Write(name, "version https://git-lfs.github.com/spec/v1\noid sha256:4d7a\nsize 12345\n")),
                testing::HasSubstr("git lfs pull"))
        << suffix;
    EXPECT_THAT(ErrorOf(Write(name, "/annex/objects/SHA256E-s1234--abcd.stl\n")), testing::HasSubstr("git annex get"))
        << suffix;
    EXPECT_THAT(ErrorOf(Write(name, "\n<!DOCTYPE html>\n<html></html>\n")), testing::HasSubstr("is a web page"))
        << suffix;
  }
}

TEST_F(MeshFile, TrianglesWithEqualCornersAreCounted) {
  const std::string path = Write("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 0\nf 1 2 3\nf 1 1 2\nf 1 2 4\n");
  for (const bool guarded : {false, true}) {
    const TriangleMesh mesh = LoadMesh(path, Eigen::Vector3d::Ones(), guarded ? ReadGuard(CallIsolated) : ReadGuard());
    EXPECT_EQ(mesh.triangles.size(), 1U);
    EXPECT_EQ(mesh.degenerate_triangles, 2);
  }
}

TEST_F(MeshFile, PolygonsAreCutIntoTriangles) {
  const std::string obj = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 2 0 0\nf 1 2 3 4\nf 2 5 3\n";
  const TriangleMesh mesh = LoadMesh(Write("square.obj", obj));
  EXPECT_EQ(mesh.vertices.size(), 5U);
  EXPECT_EQ(mesh.triangles.size(), 3U);
}

/// Without a count, Assimp reads the first coordinate of the array from invalid memory.
TEST_F(MeshFile, ReaderThatCrashesRefusesTheFile) {
  const std::string fault = ErrorOf(Write("crash.dae", TetrahedronDae("")));
  EXPECT_NE(fault.find("crash.dae: mesh cannot be read: its reader failed: it ended with "), std::string::npos)
      << fault;
}

/// Damaged files with the expected message. On these Assimp would take gigabytes, loop forever or write out of bounds.
TEST_F(MeshFile, DamageThatTheReaderWouldNotSurviveIsRefused) {
  const auto ply = [](const std::string& elements) {
    return "ply\nformat ascii 1.0\n" + elements + "end_header\n0 0 0\n";
  };
  const auto dae = [](const std::string& geometry) {
    return R"(<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1"><library_geometries>)" +
           geometry + "</library_geometries></COLLADA>";
  };
  struct Case {
    std::string name, content, said;
  };
  const std::vector<Case> cases = {
      {"many.ply", ply("element vertex 2000000000\nproperty float x\n"), "header line 3: the file is too short"},
      {"negative.ply", ply("element vertex -1\nproperty float x\n"), "header line 3: is no line of a PLY header"},
      {"twice.ply", ply("element vertex 1\nproperty float x\nelement vertex 1\n"), "header line 5: the element stands"},
      {"type.ply", ply("element vertex 1\nproperty floa x\n"), "header line 4: is no line of a PLY header"},
      {"early.ply", ply("property float x\n"), "header line 3: is no line of a PLY header"},
      {"garbage.ply", ply("element vertex 1\nggggggg\n"), "header line 4: is no line of a PLY header"},
      {"endless.ply", "ply\nformat ascii 1.0\ncomment\n", "end_header: the header has no end"},
      {"count.dae", dae("<float_array count=\"99999999\">0</float_array>"), "<float_array> in line 1, count"},
      {"negative.dae", dae("<triangles count=\"-3\"/>"), "<triangles> in line 1, count"},
      {"indices.dae", dae("<p>0 1 2]3</p>"), "<p> in line 1: is no list of numbers (got ']3')"},
      {"space.dae", dae("<p>0 1 \v 2</p>"), "<p> in line 1: is no list of numbers"},
      {"open.dae", "<COLLADA><library_geometries>", "not valid XML"},
  };
  for (const Case& c : cases) {
    const std::string path = Write(c.name, c.content);
    try {
      LoadMesh(path, Eigen::Vector3d::Ones(), CallIsolated);
      ADD_FAILURE() << c.name << " was read";
    } catch (const InputError& e) {
      EXPECT_NE(std::string(e.what()).find(path + ": "), std::string::npos) << e.what();
      EXPECT_NE(std::string(e.what()).find(c.said), std::string::npos) << e.what();
    }
  }
}

TEST_F(MeshFile, NonFiniteNumbersAreRefused) {
  auto triangles = kTetrahedron;
  triangles[2][4] = std::numeric_limits<float>::quiet_NaN();
  EXPECT_NE(ErrorOf(Write("nan.stl", BinaryStl(triangles))).find("finite"), std::string::npos);
  triangles[2][4] = std::numeric_limits<float>::infinity();
  EXPECT_NE(ErrorOf(Write("inf.stl", BinaryStl(triangles))).find("finite"), std::string::npos);
  const std::string good = Write("tetra.stl", BinaryStl(kTetrahedron));
  EXPECT_NE(ErrorOf(good, {1, 0, 1}).find("scale"), std::string::npos);
  EXPECT_NE(ErrorOf(good, {1, std::numeric_limits<double>::infinity(), 1}).find("scale"), std::string::npos);
}

TEST_F(MeshFile, LoadingPrintsNothing) {
  const std::string bad = Write("noise.stl", "this is no mesh");
  const std::string good = Write("tetra.stl", BinaryStl(kTetrahedron));
  ::testing::internal::CaptureStdout();
  ::testing::internal::CaptureStderr();
  EXPECT_THROW(LoadMesh(bad, Eigen::Vector3d::Ones(), CallIsolated), InputError);
  EXPECT_THROW(LoadMesh(bad), InputError);
  LoadMesh(good);
  LoadMesh(good, Eigen::Vector3d::Ones(), CallIsolated);
  EXPECT_EQ(::testing::internal::GetCapturedStdout(), "");
  EXPECT_EQ(::testing::internal::GetCapturedStderr(), "");
}

// The guard runs the reader once per file, and its failure is reported as the file's error.
TEST_F(MeshFile, IsReadUnderTheGuardThatItIsGiven) {
  const std::string path = Write("tetra.stl", BinaryStl(kTetrahedron));
  ShapeSpec shape;
  shape.kind = ShapeSpec::Kind::kMesh;
  shape.mesh_file = path;
  int calls = 0;
  const ReadGuard counting = [&calls](const std::function<std::string()>& read, const ReadLimits& limits) {
    ++calls;
    EXPECT_GE(limits.cpu_s, 5);
    EXPECT_GE(limits.memory_bytes, std::int64_t{1} << 29);
    return read();
  };
  const TriangleMesh plain = LoadMesh(path);
  const TriangleMesh counted = Tessellate(shape, counting);
  const TriangleMesh isolated = Tessellate(shape, CallIsolated);
  EXPECT_EQ(calls, 1);
  for (const TriangleMesh& mesh : {counted, isolated}) {
    EXPECT_EQ(mesh.vertices, plain.vertices);
    EXPECT_EQ(mesh.triangles, plain.triangles);
  }
  const auto refusal = [&](const ReadGuard& guard) -> std::string {
    try {
      LoadMesh(path, Eigen::Vector3d::Ones(), guard);
    } catch (const InputError& error) {
      return error.what();
    }
    return "";
  };
  using Read = std::function<std::string()>;
  EXPECT_NE(refusal([](const Read&, const ReadLimits&) -> std::string {
              throw GuardedReadError("it is tired");
            }).find("tetra.stl: mesh cannot be read: its reader failed: it is tired"),
            std::string::npos);
  EXPECT_NE(refusal([](const Read& read, const ReadLimits&) { return read() + "x"; }).find("makes sense"),
            std::string::npos);
  EXPECT_NE(refusal([](const Read&, const ReadLimits&) { return std::string(); }).find("makes sense"),
            std::string::npos);
}

struct PrimitiveCase {
  ShapeSpec::Kind kind;
  Eigen::Vector3d size;
  double volume_m3;
};

TEST(Tessellate, PrimitivesAreClosedOutwardAndInscribed) {
  const double r = 0.3;
  const double l = 0.8;
  const std::vector<PrimitiveCase> cases = {
      {ShapeSpec::Kind::kBox, {1.0, 2.0, 3.0}, 6.0},
      {ShapeSpec::Kind::kSphere, {r, 0, 0}, 4.0 / 3.0 * M_PI * r * r * r},
      {ShapeSpec::Kind::kCylinder, {r, 0, l}, M_PI * r * r * l},
      {ShapeSpec::Kind::kCapsule, {r, 0, l}, M_PI * r * r * (l + 4.0 / 3.0 * r)},
  };
  const Eigen::Isometry3d pose = At(1, 2, 3) * Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, 2, 3).normalized());
  for (const PrimitiveCase& c : cases) {
    const ShapeSpec spec = Spec(c.kind, c.size, pose);
    const TriangleMesh mesh = Tessellate(spec);
    const ConvexShape exact = ConvexShape::FromPrimitive(spec);
    for (const Eigen::Vector3d& v : mesh.vertices) EXPECT_LE(exact.BoundaryDistance(v), 1e-12);
    std::map<std::pair<int, int>, int> edges;
    for (const auto& t : mesh.triangles) {
      for (size_t k = 0; k < 3; ++k) ++edges[{t[k], t[(k + 1) % 3]}];
    }
    for (const auto& [edge, count] : edges) {
      EXPECT_EQ(count, 1);
      EXPECT_EQ(edges.count({edge.second, edge.first}), 1U);
    }
    TriangleMesh centred = mesh;
    for (Eigen::Vector3d& v : centred.vertices) v -= pose.translation();
    EXPECT_GT(SignedVolume(centred), 0.96 * c.volume_m3);
    EXPECT_LT(SignedVolume(centred), (1.0 + 1e-12) * c.volume_m3);
  }
}

TEST(Tessellate, BadSizesAreRefused) {
  for (const double bad : {0.0, -1.0, std::numeric_limits<double>::quiet_NaN()}) {
    EXPECT_THROW(Tessellate(Spec(ShapeSpec::Kind::kBox, {1.0, bad, 1.0})), InputError);
    EXPECT_THROW(Tessellate(Spec(ShapeSpec::Kind::kSphere, {bad, 0.0, 0.0})), InputError);
    EXPECT_THROW(Tessellate(Spec(ShapeSpec::Kind::kCapsule, {0.1, 0.0, bad})), InputError);
  }
}

TEST_F(MeshFile, MeshesBeyondTheLimitsAreRefusedBeforeTheyAreRead) {
  const std::string huge = Write("huge.stl", "binary");
  std::filesystem::resize_file(huge, std::uintmax_t{2} << 30);  // sparse
  EXPECT_THAT(ErrorOf(huge), testing::AllOf(testing::HasSubstr("2048 MiB"), testing::HasSubstr("256 MiB")));
  constexpr std::uint32_t kTriangles = 2'000'001;
  std::string head(80, '\0');
  head.append(reinterpret_cast<const char*>(&kTriangles), sizeof(kTriangles));
  const std::string many = Write("many.stl", head);
  std::filesystem::resize_file(many, 84 + std::uintmax_t{50} * kTriangles);
  EXPECT_THAT(ErrorOf(many), testing::AllOf(testing::HasSubstr("2000001"), testing::HasSubstr("simplify")));
}

}  // namespace
}  // namespace legopt::test
