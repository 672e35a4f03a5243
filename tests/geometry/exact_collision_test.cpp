#include "legopt/geometry/internal/exact_collision.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <thread>
#include <vector>

#include "legopt/geometry/internal/link_trimeshes.h"
#include "legopt/geometry/internal/trimesh_world.h"
#include "tests/geometry/atlas_data.h"
#include "tests/geometry/test_shapes.h"

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

/// Returns the depth of a box whose underside is `sunk` below z = 0.
double BoxDepth(const TriangleMesh& other, double sunk, const Eigen::Vector3d& size = kFootSize) {
  TrimeshWorld world;
  const int a = world.Add(Tessellate(Spec(ShapeSpec::Kind::kBox, size)));
  const int b = world.Add(other);
  world.SetPose(a, At(0.013, 0.007, 0.5 * size.z() - sunk));
  return world.Depth(a, b);
}

// Depths measured with ODE 0.16.2 (docs/explanation/judge.md#contact-depth).
TEST(TrimeshDepth, MeasuredCasesOfTheReference) {
  EXPECT_LT(BoxDepth(Plane(true), -0.001), 0.0);
  for (const double sunk : {0.0005, 0.001, 0.002, 0.010, 0.020, 0.030, 0.050}) {
    EXPECT_NEAR(BoxDepth(Plane(true), sunk), sunk, 1e-6) << sunk;
  }
  EXPECT_NEAR(BoxDepth(Plane(false), 0.0005), 0.0595, 1e-6);
  const TriangleMesh big = Tessellate(Spec(ShapeSpec::Kind::kBox, {2, 2, 2}));
  EXPECT_LT(BoxDepth(big, 0.0), 0.0);  // entirely inside: free
  TriangleMesh floor = Tessellate(Spec(ShapeSpec::Kind::kBox, {2, 2, 2}, At(0, 0, -1)));
  EXPECT_NEAR(BoxDepth(floor, 0.010), 0.010, 1e-6);
}

/// Returns a sheet of 2 x n x n triangles over [-0.5, 0.5]^2, facing up, with bumps of 2 to 10 mm that grow along (dx,
/// dy).
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

// ODE's mesh colliders share one cache per process. Without mutual exclusion, depths are occasionally wrong in both
// threads.
TEST(TrimeshDepth, WorldsOfTwoThreadsAreIndependent) {
  constexpr int kRounds = 400;
  const auto depths = [](double slope) {
    TrimeshWorld world;
    const int box = world.Add(Tessellate(Spec(ShapeSpec::Kind::kBox, kFootSize)));
    const int sheet = world.Add(Sheet(12, slope, -slope));
    std::vector<double> found;
    for (int i = 0; i < kRounds; ++i) {
      world.SetPose(box, At(0.001 * (i % 50), 0.007, 0.5 * kFootSize.z() - 0.0002 * (i % 30)));
      found.push_back(world.Depth(box, sheet));
    }
    return found;
  };
  const std::vector<double> alone[] = {depths(0.0), depths(0.5)};
  std::vector<double> together[2];
  std::thread other([&] { together[1] = depths(0.5); });
  together[0] = depths(0.0);
  other.join();
  EXPECT_EQ(together[0], alone[0]);
  EXPECT_EQ(together[1], alone[1]);
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
    for (size_t t = 0; t < sheet.triangles.size(); t += 2) {  // cell by cell the contacts are few
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

// Compares both implementations of the rule where ODE has few contacts: its merging may reduce a depth by up to 0.01
// mm.
TEST(TrimeshDepth, ExactDepthsAreOdes) {
  constexpr double kMerging = 1.1e-5, kSinglePrecision = 1e-6;
  Draw draw(9);
  int crossing = 0, deeper = 0;
  for (int i = 0; i < 400; ++i) {
    TrimeshWorld world;
    const auto add = [&] {
      const ConvexHull hull = draw.RandomHull(12, {0.2, 0.15, 0.1});
      return world.Add({hull.vertices, hull.triangles});
    };
    const int a = add(), b = add();
    world.SetPose(b, draw.Pose(0.2));
    const double ode = world.Depth(a, b), exact = world.ExactDepth(a, b);
    EXPECT_NEAR(exact, world.ExactDepth(b, a), 1e-12);
    EXPECT_EQ(ode < 0.0, exact < 0.0);
    if (ode < 0.0) continue;
    ++crossing;
    EXPECT_GE(exact, ode - kSinglePrecision);
    deeper += exact > ode + kMerging ? 1 : 0;
  }
  EXPECT_GT(crossing, 100);
  EXPECT_LE(deeper, crossing / 50) << "of " << crossing << ": ODE drops contacts whose merged normals cancel";
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

/// Returns boxes on prismatic joints: link i + 1 is a box centred at y = q_i. Even ones measure 0.2 m, odd ones 0.14
/// m, so that no two faces of neighbours are coplanar (ODE reports edge lengths there).
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

/// A base box and a second box that `slide0` moves along y.
struct TwoBoxes {
  RobotModel robot = Slides(2);
  Eigen::VectorXd x = ZeroPose(robot);
  Kinematics kinematics{robot};

  TwoBoxes() { x.head(2) << -3.0, 3.0; }
  const Kinematics& At(double y0, double y1) {
    x.head(2) << y0, y1;
    kinematics.Update(x);
    return kinematics;
  }
};

TEST(Containment, OfALinkInASolidWhoseSurfaceItDoesNotMeet) {
  TwoBoxes boxes;
  Scene scene;
  scene.objects.push_back({"far", Spec(ShapeSpec::Kind::kBox, {1, 1, 1}, At(9, 0, 0))});
  scene.objects.push_back({"slab", Spec(ShapeSpec::Kind::kBox, {1, 1, 0.3}, At(0, -3.1, 0.01))});
  const auto model = CollisionModel::Build(boxes.robot, scene, boxes.x);
  ExactCollision exact(boxes.robot, scene, model);
  const Kinematics& buried = boxes.At(-3.0, 3.0);
  EXPECT_EQ(exact.EnvironmentDepth(buried), 0.0) << "no contact: surfaces do not cross";
  const ExactCollision::Containment deepest = exact.DeepestContainment(buried);
  EXPECT_NEAR(deepest.depth_m, 0.06, 1e-12);  // the lower corners, from the slab's underside
  EXPECT_EQ(deepest.link, 1);
  EXPECT_EQ(deepest.object, 1);
  EXPECT_EQ(deepest.other_link, -1);
  EXPECT_EQ(exact.DeepestContainment(boxes.At(-2.0, 3.0)).link, -1);
  // Half outside: only the corners inside contribute to the containment, and there are contacts as well.
  EXPECT_NEAR(exact.DeepestContainment(boxes.At(-2.62, 3.0)).depth_m, 0.06, 1e-12);
  EXPECT_GT(exact.EnvironmentDepth(boxes.kinematics), 1e-3);
}

TEST(Containment, OfASolidInALinkAndOfALinkInAnother) {
  TwoBoxes boxes;
  Scene scene;
  scene.objects.push_back({"pebble", Spec(ShapeSpec::Kind::kBox, {0.02, 0.02, 0.02}, At(0.03, 5.0, 0))});
  const auto model = CollisionModel::Build(boxes.robot, scene, boxes.x);
  ExactCollision exact(boxes.robot, scene, model);
  const ExactCollision::Containment pebble = exact.DeepestContainment(boxes.At(5.0, -5.0));
  EXPECT_NEAR(pebble.depth_m, 0.08, 1e-12);
  EXPECT_EQ(pebble.link, 1);
  EXPECT_EQ(pebble.object, 0);
  const ExactCollision::Containment nested = exact.DeepestContainment(boxes.At(1.0, 1.0));
  EXPECT_EQ(exact.SelfDepth(boxes.kinematics).strict_m, 0.0) << "no contact: surfaces do not cross";
  EXPECT_NEAR(nested.depth_m, 0.03, 1e-12);
  EXPECT_EQ(LinkPair(nested.link, nested.other_link), LinkPair(1, 2));
  EXPECT_EQ(nested.object, -1);
}

TEST(IgnoredContact, OfPairsThatTouchInTheReferencePose) {
  TwoBoxes boxes;
  Eigen::VectorXd reference = boxes.x;
  reference.head(2) << 0.0, 0.13;
  const auto model = CollisionModel::Build(boxes.robot, {}, reference);
  ASSERT_TRUE(model->checked_pairs().empty());
  ExactCollision exact(boxes.robot, {}, model);
  EXPECT_EQ(exact.SelfDepth(boxes.At(0.0, 0.14)).strict_m, 0.0);
  const ExactCollision::LinkContact contact = exact.DeepestIgnoredContact(boxes.kinematics);
  EXPECT_NEAR(contact.depth_m, 0.03, 1e-6);
  EXPECT_EQ(contact.pair, LinkPair(1, 2));
  EXPECT_EQ(exact.DeepestIgnoredContact(boxes.At(0.0, 0.5)).pair.first, -1);
}

TEST(LongestStep, IsThatOfTheFarthestPoint) {
  TwoBoxes boxes;
  const auto model = CollisionModel::Build(boxes.robot, {}, boxes.x);
  const ExactCollision exact(boxes.robot, {}, model);
  Kinematics from(boxes.robot);
  from.Update(boxes.x);
  EXPECT_EQ(exact.LongestStep(from, from).distance_m, 0.0);
  const ExactCollision::Step slide = exact.LongestStep(from, boxes.At(-3.0, 3.4));
  EXPECT_NEAR(slide.distance_m, 0.4, 1e-12);
  EXPECT_EQ(slide.link, 2);
  // A rotation of the base about z by 180 degrees moves the outermost corner of box 0, at (+-0.1, -3.1), to the other
  // side.
  boxes.x.head(2) << -3.0, 3.0;
  boxes.x.tail<4>() << 0.0, 0.0, 0.0, 1.0;
  boxes.kinematics.Update(boxes.x);
  const ExactCollision::Step turn = exact.LongestStep(from, boxes.kinematics);
  EXPECT_NEAR(turn.distance_m, 2.0 * std::hypot(0.1, 3.1), 1e-12);
  EXPECT_EQ(turn.link, 1);
}

/// Compares every figure of one configuration.
void ExpectSameFigures(ExactCollision& culled, ExactCollision& exhaustive, const Kinematics& kinematics) {
  const auto a = culled.DeepestEnvironmentContacts(kinematics), b = exhaustive.DeepestEnvironmentContacts(kinematics);
  EXPECT_EQ(a.literal.depth_m, b.literal.depth_m);
  EXPECT_EQ(a.strict.depth_m, b.strict.depth_m);
  EXPECT_EQ(a.strict.link, b.strict.link);
  const ExactCollision::SelfDepths c = culled.SelfDepth(kinematics), d = exhaustive.SelfDepth(kinematics);
  EXPECT_EQ(c.literal_m, d.literal_m);
  EXPECT_EQ(c.literal_pair, d.literal_pair);
  EXPECT_EQ(c.strict_m, d.strict_m);
  EXPECT_EQ(c.strict_pair, d.strict_pair);
  EXPECT_EQ(culled.DeepestIgnoredContact(kinematics).depth_m, exhaustive.DeepestIgnoredContact(kinematics).depth_m);
  EXPECT_EQ(culled.DeepestContainment(kinematics).depth_m, exhaustive.DeepestContainment(kinematics).depth_m);
}

// Random self-colliding postures, some of them deep in a solid, some near a sphere.
TEST(SelfDepth, CullingNeverChangesTheAnswer) {
  LEGOPT_REQUIRE_FILE(DataFolder() / "atlas/atlas.urdf");
  const RobotModel robot = Atlas();
  Scene scene;
  scene.objects.push_back({"slab", Spec(ShapeSpec::Kind::kBox, {3, 3, 3}, At(0, 0, -1.4))});
  scene.objects.push_back({"ball", Spec(ShapeSpec::Kind::kSphere, {0.3, 0, 0}, At(0.3, 0.6, 0.4))});
  const auto model = CollisionModel::Build(robot, scene, AtlasReference(robot));
  ExactCollision culled(robot, scene, model), exhaustive(robot, scene, model, Culling::kOff);
  Kinematics kinematics(robot);
  Draw draw(3);
  int colliding = 0;
  for (int i = 0; i < 60; ++i) {
    Eigen::VectorXd x = ZeroPose(robot);
    for (int dof = 0; dof < robot.num_dofs(); ++dof) {
      x[dof] = draw.Number(std::max(robot.lower_limits()[dof], -3.0), std::min(robot.upper_limits()[dof], 3.0));
    }
    x[robot.num_dofs() + 2] = draw.Number(-1.0, 1.0);
    kinematics.Update(x);
    ExpectSameFigures(culled, exhaustive, kinematics);
    colliding += culled.SelfDepth(kinematics).strict_m > 0.0 ? 1 : 0;
  }
  EXPECT_GT(colliding, 20);
}

TEST(EnvironmentDepth, CullingNeverChangesOdesAnswer) {
  LEGOPT_REQUIRE_FILE(GarageFile());
  LEGOPT_REQUIRE_FILE(DataFolder() / "problemsposture.json");
  const RobotModel robot = Atlas();
  const Scene scene = Garage();
  const auto model = CollisionModel::Build(robot, {}, AtlasReference(robot));
  ExactCollision exact(robot, scene, model), exhaustive(robot, scene, model, Culling::kOff);
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
      ExpectSameFigures(exact, exhaustive, kinematics);
      colliding += all > 0.0 ? 1 : 0;
    }
  }
  EXPECT_GT(colliding, 30);
}

}  // namespace
}  // namespace legopt::test
