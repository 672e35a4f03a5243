#include "legopt/collision/exact_collision.h"

#include <gtest/gtest.h>

#include <map>

#include "legopt/collision/link_trimeshes.h"
#include "legopt/collision/trimesh_world.h"
#include "tests/collision/atlas_data.h"
#include "tests/collision/test_shapes.h"

namespace legopt::test {
namespace {

const Eigen::Vector3d kFootSize(0.26, 0.13, 0.06);

TriangleMesh Plane(bool facing_up) {
  TriangleMesh mesh;
  mesh.vertices = {{-2, -2, 0}, {2, -2, 0}, {2, 2, 0}, {-2, 2, 0}};
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  if (!facing_up) {
    for (auto& t : mesh.triangles) std::swap(t[1], t[2]);
  }
  return mesh;
}

/// Depth of a box whose underside is `sunk` below z = 0.
double BoxDepth(const TriangleMesh& other, double sunk, const Eigen::Vector3d& size = kFootSize) {
  TrimeshWorld world;
  const int a = world.Add(Tessellate(Spec(ShapeSpec::Kind::kBox, size)));
  const int b = world.Add(other);
  world.SetPose(a, At(0.013, 0.007, 0.5 * size.z() - sunk));
  return world.Depth(a, b);
}

// What ODE 0.16.2 was measured to report (docs/readings.md#contact-depth).
TEST(TrimeshDepth, MeasuredCasesOfTheReference) {
  EXPECT_LT(BoxDepth(Plane(true), -0.001), 0.0);
  for (const double sunk : {0.0005, 0.001, 0.002, 0.010, 0.020, 0.030, 0.050}) {
    EXPECT_NEAR(BoxDepth(Plane(true), sunk), sunk, 1e-6) << sunk;
  }
  EXPECT_NEAR(BoxDepth(Plane(false), 0.0005), 0.0595, 1e-6);
  const TriangleMesh big = Tessellate(Spec(ShapeSpec::Kind::kBox, {2, 2, 2}));
  EXPECT_LT(BoxDepth(big, 0.0), 0.0);  // wholly inside: free
  TriangleMesh floor = Tessellate(Spec(ShapeSpec::Kind::kBox, {2, 2, 2}, At(0, 0, -1)));
  EXPECT_NEAR(BoxDepth(floor, 0.010), 0.010, 1e-6);
}

/// A sheet of 2 x n x n triangles over [-0.5, 0.5]^2, facing up, with bumps of 2 to 10 mm that grow along (dx, dy).
TriangleMesh Sheet(int n, double dx, double dy) {
  TriangleMesh mesh;
  for (int i = 0; i <= n; ++i) {
    for (int j = 0; j <= n; ++j) {
      const double x = static_cast<double>(i) / n - 0.5, y = static_cast<double>(j) / n - 0.5;
      const double height = 0.002 + 0.008 * (0.5 + dx * x + dy * y);
      mesh.vertices.emplace_back(x, y, (i + j) % 2 == 0 ? height : -height);
    }
  }
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < n; ++j) {
      const int corner = i * (n + 1) + j, right = corner + n + 1;
      mesh.triangles.push_back({corner, right, right + 1});
      mesh.triangles.push_back({corner, right + 1, corner + 1});
    }
  }
  return mesh;
}

TEST(TrimeshDepth, TheOriginalLooksAt255ContactsTheStrictFigureAtAll) {
  constexpr double kMerging = 1.1e-5;  // ODE may keep the shallower of two contacts that it merges
  constexpr int kCells = 30;
  int cut_off = 0;
  for (const auto& [dx, dy] : {std::pair(1.0, 0.0), {-1.0, 0.0}, {0.0, 1.0}, {0.0, -1.0}}) {
    TrimeshWorld world;
    const int box = world.Add(Tessellate(Spec(ShapeSpec::Kind::kBox, {0.8, 0.8, 0.4})));
    world.SetPose(box, At(0.003, 0.002, 0.2));
    const TriangleMesh sheet = Sheet(kCells, dx, dy);
    const int whole = world.Add(sheet);
    double deepest = -1.0;
    for (size_t t = 0; t < sheet.triangles.size(); t += 2) {  // cell by cell there are never many contacts
      TriangleMesh cell = sheet;
      cell.triangles = {sheet.triangles[t], sheet.triangles[t + 1]};
      deepest = std::max(deepest, world.Depth(box, world.Add(cell)));
    }
    const TrimeshWorld::Depths depths = world.AllDepths(box, whole);
    EXPECT_EQ(depths.original_m, world.Depth(box, whole));
    EXPECT_NEAR(depths.all_m, deepest, kMerging);
    EXPECT_GE(depths.all_m, depths.original_m);
    cut_off += depths.original_m < deepest - 0.001 ? 1 : 0;
  }
  EXPECT_GE(cut_off, 1) << "no case has its deepest contact beyond the first 255";
}

TEST(TrimeshDepth, FewContactsHaveOneDepth) {
  TrimeshWorld world;
  const int box = world.Add(Tessellate(Spec(ShapeSpec::Kind::kBox, kFootSize)));
  const int plane = world.Add(Plane(true));
  world.SetPose(box, At(0, 0, 0.5 * kFootSize.z() - 0.002));
  EXPECT_EQ(world.AllDepths(box, plane).original_m, world.AllDepths(box, plane).all_m);
  EXPECT_NEAR(world.AllDepths(box, plane).all_m, 0.002, 1e-6);
  world.SetPose(box, At(0, 0, 1));
  EXPECT_LT(world.AllDepths(box, plane).all_m, 0.0);
}

TEST(AtlasExact, ReferencePosePairsAndTheirDepths) {
  LEGOPT_REQUIRE_FILE(DataFolder() / "atlas/atlas.urdf");
  const RobotModel robot = Atlas();
  Kinematics kinematics(robot);
  kinematics.Update(AtlasReference(robot));
  TrimeshWorld world;
  LinkTrimeshes meshes(robot, world);
  meshes.Place(kinematics);
  const std::vector<std::tuple<std::string, std::string, double>> expected = {
      {"pelvis", "mtorso", 0.0275},  {"pelvis", "utorso", 0.0085},  {"pelvis", "l_lglut", 0.0233},
      {"pelvis", "l_uleg", 0.00045}, {"pelvis", "r_lglut", 0.0233}, {"pelvis", "r_uleg", 0.0008},
      {"l_uleg", "r_uleg", 0.0025}};
  for (const auto& [a, b, depth] : expected) {
    const double actual = meshes.Depth(meshes.geometry(robot.FindLink(a), 0), meshes.geometry(robot.FindLink(b), 0));
    EXPECT_NEAR(actual, depth, depth > 0.001 ? 6e-5 : 6e-6) << a << " " << b;
  }
}

TEST(AtlasExact, ReferencePoseItselfIsFreeOfCheckedCollisions) {
  LEGOPT_REQUIRE_FILE(DataFolder() / "atlas/atlas.urdf");
  const RobotModel robot = Atlas();
  const auto model = CollisionModel::Build(robot, {}, AtlasReference(robot));
  ExactCollision exact(robot, {}, model);
  Kinematics kinematics(robot);
  kinematics.Update(AtlasReference(robot));
  const ExactCollision::SelfDepths self = exact.SelfDepth(kinematics);
  EXPECT_EQ(self.strict_m, 0.0);
  EXPECT_EQ(self.strict_pair, LinkPair(-1, -1));
  EXPECT_EQ(exact.DeepestEnvironmentContacts(kinematics).literal.link, -1);
}

/// Boxes on prismatic joints: link i + 1 is a box centred at y = q_i. Even ones measure 0.2 m, odd ones 0.14 m, so that
/// no two faces of neighbours are coplanar (ODE reports edge lengths there).
RobotModel Slides(int count) {
  std::vector<Link> links(static_cast<size_t>(count) + 1);
  std::vector<Joint> joints(static_cast<size_t>(count));
  links[0].name = "base";
  links[0].mass = 1.0;
  for (int i = 0; i < count; ++i) {
    Link& link = links[static_cast<size_t>(i) + 1];
    link.name = "box" + std::to_string(i);
    link.mass = 1.0;
    link.parent_joint = i;
    link.collision = {Spec(ShapeSpec::Kind::kBox, Eigen::Vector3d::Constant(i % 2 == 0 ? 0.2 : 0.14))};
    Joint& joint = joints[static_cast<size_t>(i)];
    joint.name = "slide" + std::to_string(i);
    joint.type = JointType::kPrismatic;
    joint.parent_link = 0;
    joint.child_link = i + 1;
    joint.axis = Eigen::Vector3d::UnitY();
    joint.dof = i;
    joint.lower = -10.0;
    joint.upper = 10.0;
  }
  return RobotModel("slides", links, joints);
}

TEST(SelfDepth, LiteralRuleTakesTheLastCollidingPair) {
  const RobotModel robot = Slides(4);
  Eigen::VectorXd reference = ZeroPose(robot);
  reference.head(4) << -3.0, -1.0, 1.0, 3.0;
  const auto model = CollisionModel::Build(robot, {}, reference);
  ASSERT_EQ(model->checked_pairs().size(), 6U);
  ExactCollision exact(robot, {}, model);
  Kinematics kinematics(robot);
  Eigen::VectorXd x = reference;
  x[1] = -3.0 + 0.14;   // boxes 0 and 1 (links 1, 2): 30 mm
  x[3] = 1.0 + 0.1695;  // boxes 2 and 3 (links 3, 4): 0.5 mm
  kinematics.Update(x);
  const ExactCollision::SelfDepths both = exact.SelfDepth(kinematics);
  EXPECT_NEAR(both.strict_m, 0.030, 1e-6);
  EXPECT_EQ(both.strict_pair, LinkPair(1, 2));
  EXPECT_NEAR(both.literal_m, 0.0005, 1e-6);
  EXPECT_EQ(both.literal_pair, LinkPair(3, 4));
  x[3] = 3.0;
  kinematics.Update(x);
  const ExactCollision::SelfDepths one = exact.SelfDepth(kinematics);
  EXPECT_NEAR(one.literal_m, 0.030, 1e-6);
  EXPECT_EQ(one.literal_pair, LinkPair(1, 2));
}

TEST(EnvironmentDepth, NamesTheDeepestLinkAndObject) {
  const RobotModel robot = Slides(2);
  Eigen::VectorXd x = ZeroPose(robot);
  x.head(2) << -3.0, 3.0;
  Scene scene;
  scene.objects.push_back({"left", Spec(ShapeSpec::Kind::kBox, {1, 1, 1}, At(0, -3.58, 0))});
  scene.objects.push_back({"right", Spec(ShapeSpec::Kind::kBox, {1, 1, 1}, At(0, 3.53, 0))});
  const auto model = CollisionModel::Build(robot, scene, x);
  ExactCollision exact(robot, scene, model);
  Kinematics kinematics(robot);
  kinematics.Update(x);
  const auto deepest = exact.DeepestEnvironmentContacts(kinematics).literal;
  EXPECT_NEAR(deepest.depth_m, 0.04, 1e-6);
  EXPECT_EQ(deepest.link, 2);
  EXPECT_EQ(deepest.object, 1);
  EXPECT_EQ(exact.EnvironmentDepth(kinematics), deepest.depth_m);
  x.head(2) << -2.9, 2.9;
  kinematics.Update(x);
  EXPECT_EQ(exact.EnvironmentDepth(kinematics), 0.0);
}

TEST(EnvironmentDepth, CullingNeverChangesOdesAnswer) {
  LEGOPT_REQUIRE_FILE(GarageFile());
  LEGOPT_REQUIRE_FILE(DataFolder() / "problemsposture.json");
  const RobotModel robot = Atlas();
  const Scene scene = Garage();
  const auto model = CollisionModel::Build(robot, {}, AtlasReference(robot));
  ExactCollision exact(robot, scene, model);
  TrimeshWorld world;
  LinkTrimeshes meshes(robot, world);
  const int garage = world.Add(LoadMesh(GarageFile()));
  Kinematics kinematics(robot);
  int colliding = 0;
  for (const auto& stance : ReadStances(DataFolder() / "problemsposture.json")) {
    Eigen::VectorXd x = StandOn(robot, stance);
    for (const double lift : {0.0, -0.03}) {
      x[robot.num_dofs() + 2] += lift;
      kinematics.Update(x);
      meshes.Place(kinematics);
      double all = 0.0;
      for (int link = 0; link < static_cast<int>(robot.links().size()); ++link) {
        if (meshes.num_geometries(link) > 0) all = std::max(all, world.Depth(meshes.geometry(link, 0).mesh, garage));
      }
      EXPECT_EQ(exact.EnvironmentDepth(kinematics), all);
      colliding += all > 0.0 ? 1 : 0;
    }
  }
  EXPECT_GT(colliding, 30);
}

}  // namespace
}  // namespace legopt::test
