// Policy: whatever is skipped to save time, depths and overlaps of links equal those found with all vertices and all
// pairs of triangles.
#include "legopt/geometry/internal/link_trimeshes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <random>
#include <string>
#include <vector>

#include "tests/temporary_folder.h"

namespace legopt::test {
namespace {

// A jar, open on one side, as one closed mesh; and two blocks as one mesh, which are apart.
constexpr const char* kJar = R"(v -0.10 -0.10 -0.10
v 0.10 -0.10 -0.10
v 0.10 0.10 -0.10
v -0.10 0.10 -0.10
v -0.10 -0.10 0.10
v 0.10 -0.10 0.10
v 0.10 0.10 0.10
v -0.10 0.10 0.10
v -0.05 -0.05 -0.05
v 0.05 -0.05 -0.05
v 0.05 0.05 -0.05
v -0.05 0.05 -0.05
v -0.05 -0.05 0.10
v 0.05 -0.05 0.10
v 0.05 0.05 0.10
v -0.05 0.05 0.10
f 4 3 2 1
f 1 2 6 5
f 2 3 7 6
f 3 4 8 7
f 4 1 5 8
f 9 10 11 12
f 13 14 10 9
f 14 15 11 10
f 15 16 12 11
f 16 13 9 12
f 5 6 14 13
f 6 7 15 14
f 7 8 16 15
f 8 5 13 16
)";

std::string Block(double x, double half, int first) {
  std::string text;
  for (const double z : {-half, half}) {
    for (const auto& [dx, y] : {std::pair(-half, -half), {half, -half}, {half, half}, {-half, half}}) {
      text += "v " + std::to_string(x + dx) + " " + std::to_string(y) + " " + std::to_string(z) + "\n";
    }
  }
  constexpr int kFaces[6][4] = {{4, 3, 2, 1}, {1, 2, 6, 5}, {2, 3, 7, 6}, {3, 4, 8, 7}, {4, 1, 5, 8}, {5, 6, 7, 8}};
  for (const auto& face : kFaces) {
    text += "f";
    for (const int corner : face) text += " " + std::to_string(first + corner);
    text += "\n";
  }
  return text;
}

constexpr const char* kRobot = R"(<robot name="r">
<link name="jar"><inertial><mass value="1"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>
<collision><geometry><mesh filename="jar.obj"/></geometry></collision></link>
<link name="x"/><link name="y"/><link name="z"/>
<link name="blocks"><collision><geometry><mesh filename="blocks.obj"/></geometry></collision></link>
<joint name="jx" type="prismatic"><parent link="jar"/><child link="x"/><axis xyz="1 0 0"/>
<limit lower="-0.2" upper="0.2" effort="1" velocity="1"/></joint>
<joint name="jy" type="prismatic"><parent link="x"/><child link="y"/><axis xyz="0 1 0"/>
<limit lower="-0.2" upper="0.2" effort="1" velocity="1"/></joint>
<joint name="jz" type="prismatic"><parent link="y"/><child link="z"/><axis xyz="0 0 1"/>
<limit lower="-0.2" upper="0.2" effort="1" velocity="1"/></joint>
<joint name="turn" type="revolute"><parent link="z"/><child link="blocks"/><axis xyz="1 2 3"/>
<limit lower="-3" upper="3" effort="1" velocity="1"/></joint></robot>)";

TriangleCorners CornersOf(const TriangleMesh& mesh, size_t t, const Eigen::Isometry3d& pose) {
  TriangleCorners corners;
  for (size_t k = 0; k < 3; ++k) corners[k] = pose * mesh.vertices[static_cast<size_t>(mesh.triangles[t][k])];
  return corners;
}

double DepthOfAllTriangles(const TriangleMesh& a, const Eigen::Isometry3d& X_WA, const TriangleMesh& b,
                           const Eigen::Isometry3d& X_WB) {
  double deepest = -1.0;
  for (size_t i = 0; i < a.triangles.size(); ++i) {
    for (size_t j = 0; j < b.triangles.size(); ++j) {
      deepest = std::max(deepest, TriangleDepth(CornersOf(a, i, X_WA), CornersOf(b, j, X_WB)));
    }
  }
  return deepest;
}

double DepthOfAllVertices(const TriangleMesh& a, const Eigen::Isometry3d& X_WA, const TriangleMesh& b,
                          const Eigen::Isometry3d& X_WB) {
  const ClosedBodies bodies(b);
  double deepest = 0.0;
  for (const Eigen::Vector3d& vertex : a.vertices) {
    deepest = std::max(deepest, bodies.Depth(X_WB.inverse() * (X_WA * vertex)));
  }
  return deepest;
}

TEST(LinkTrimeshes, SkipNothingThatMatters) {
  const TemporaryFolder folder;
  std::ofstream(folder.path() / "jar.obj") << kJar;
  std::ofstream(folder.path() / "blocks.obj") << Block(-0.04, 0.008, 0) << Block(0.04, 0.012, 8);
  const RobotModel robot = RobotModel::FromUrdfText(kRobot, "test", folder.path().string());
  TrimeshWorld world;
  LinkTrimeshes meshes(robot, world);
  Kinematics kinematics(robot);
  std::mt19937_64 random(7);
  int crossing = 0, inside = 0, apart = 0;
  for (int i = 0; i < 2000; ++i) {
    Eigen::VectorXd x = robot.NeutralConfiguration();
    for (int dof = 0; dof < robot.num_dofs(); ++dof) {
      x[dof] = std::uniform_real_distribution(robot.lower_limits()[dof], robot.upper_limits()[dof])(random);
    }
    kinematics.UpdatePoses(x);
    for (const int link : {0, robot.FindLink("blocks")}) meshes.Place(kinematics, link);
    const auto& a = meshes.geometry(0, 0);
    const auto& b = meshes.geometry(robot.FindLink("blocks"), 0);
    const TriangleMesh &mesh_a = world.triangles(a.mesh), &mesh_b = world.triangles(b.mesh);
    const double crossing_m = DepthOfAllTriangles(mesh_a, a.pose, mesh_b, b.pose);
    const double inside_m = std::max(DepthOfAllVertices(mesh_a, a.pose, mesh_b, b.pose),
                                     DepthOfAllVertices(mesh_b, b.pose, mesh_a, a.pose));
    constexpr double kRounding = 1e-12;
    EXPECT_NEAR(meshes.ExactDepth(a, b), crossing_m, kRounding);
    EXPECT_NEAR(meshes.InsideDepth(a, b), inside_m, kRounding);
    for (const double depth_m : {0.0, 0.001, 0.006}) {
      EXPECT_EQ(meshes.Overlap(a, b, depth_m), std::max(crossing_m, inside_m) > depth_m + kRounding)
          << crossing_m << " " << inside_m << " " << depth_m;
    }
    crossing += crossing_m >= 0.0 ? 1 : 0;
    inside += crossing_m < 0.0 && inside_m > 0.0 ? 1 : 0;
    apart += crossing_m < 0.0 && inside_m == 0.0 ? 1 : 0;
  }
  EXPECT_GT(crossing, 100);
  EXPECT_GT(apart, 100);
  EXPECT_GT(inside, 20) << "a block inside the jar's wall";
}

}  // namespace
}  // namespace legopt::test
