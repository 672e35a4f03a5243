// The scene as a surface. Policy: distances of single triangles are compared with an exhaustive search over features,
// and the query with a test of every triangle.
#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <map>

#include "legopt/geometry/collision_query.h"
#include "legopt/geometry/internal/model_data.h"
#include "legopt/geometry/internal/scene_solids.h"
#include "legopt/geometry/internal/signed_distance.h"
#include "legopt/types/collision.h"
#include "legopt/types/input_error.h"
#include "legopt/types/task.h"
#include "tests/geometry/allocation_count.h"
#include "tests/geometry/atlas_data.h"
#include "tests/geometry/test_shapes.h"

namespace legopt::test {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;
using Triangle = std::array<Vector3d, 3>;

PairDistance DistanceOf(const PlacedShape& a, const PlacedShape& b) {
  PairDistance result;
  EXPECT_TRUE(SignedDistance(a.set(), b.set(), kBeyondAllDistances, result));
  return result;
}

PlacedShape Placed(const Triangle& t) { return {Hull({t[0], t[1], t[2]}), Isometry3d::Identity()}; }

Vector3d NearestOnSegment(const Vector3d& p, const Vector3d& a, const Vector3d& b) {
  return a + std::clamp((p - a).dot(b - a) / (b - a).squaredNorm(), 0.0, 1.0) * (b - a);
}

double PointToTriangle(const Vector3d& p, const Triangle& t) {
  const Vector3d n = (t[1] - t[0]).cross(t[2] - t[0]);
  double best = std::numeric_limits<double>::infinity();
  bool inside = true;
  for (size_t k = 0; k < 3; ++k) {
    const Vector3d& a = t[k];
    const Vector3d& b = t[(k + 1) % 3];
    best = std::min(best, (p - NearestOnSegment(p, a, b)).norm());
    inside = inside && n.dot((b - a).cross(p - a)) >= 0.0;
  }
  return inside ? std::abs(n.dot(p - t[0])) / n.norm() : best;
}

double SegmentToSegment(const Vector3d& a, const Vector3d& b, const Vector3d& c, const Vector3d& d) {
  const Vector3d u = b - a;
  const Vector3d v = d - c;
  const Vector3d w = a - c;
  const double det = u.dot(u) * v.dot(v) - u.dot(v) * u.dot(v);
  const double s = std::clamp((u.dot(v) * v.dot(w) - v.dot(v) * u.dot(w)) / det, 0.0, 1.0);
  const Vector3d on_cd = NearestOnSegment(a + s * u, c, d);
  const Vector3d on_ab = NearestOnSegment(on_cd, a, b);
  return (on_ab - NearestOnSegment(on_ab, c, d)).norm();
}

/// Returns the distance of two triangles that do not intersect.
double Apart(const Triangle& s, const Triangle& t) {
  double best = std::numeric_limits<double>::infinity();
  for (size_t i = 0; i < 3; ++i) {
    best = std::min({best, PointToTriangle(s[i], t), PointToTriangle(t[i], s)});
    for (size_t j = 0; j < 3; ++j) {
      best = std::min(best, SegmentToSegment(s[i], s[(i + 1) % 3], t[j], t[(j + 1) % 3]));
    }
  }
  return best;
}

/// Returns the shortest translation that separates hull and triangle: over facet normals, both sides of the triangle,
/// and all cross products of edges.
double Depth(const ConvexHull& hull, const Triangle& t, const SupportSet& a, const SupportSet& b) {
  double depth = std::numeric_limits<double>::infinity();
  const auto consider = [&](const Vector3d& direction) {
    if (direction.norm() < 1e-12) return;
    for (const Vector3d& n : {Vector3d(direction.normalized()), Vector3d(-direction.normalized())}) {
      depth = std::min(depth, n.dot(b.Farthest(n)) - n.dot(a.Farthest(-n)));
    }
  };
  consider((t[1] - t[0]).cross(t[2] - t[0]));
  for (const HalfSpace& facet : hull.facets) consider(facet.normal);
  for (const auto& corners : hull.triangles) {
    for (size_t i = 0; i < 3; ++i) {
      const Vector3d edge =
          hull.vertices[static_cast<size_t>(corners[(i + 1) % 3])] - hull.vertices[static_cast<size_t>(corners[i])];
      for (size_t j = 0; j < 3; ++j) consider(edge.cross(t[(j + 1) % 3] - t[j]));
    }
  }
  return depth;
}

TEST(TriangleDistance, IsExactAgainstHullsApartAndPenetrating) {
  Draw draw(71);
  int apart = 0;
  int overlapping = 0;
  for (int round = 0; round < 3000; ++round) {
    const ConvexHull hull = draw.RandomHull(5 + round % 40, {0.3, 0.2, 0.1});
    const double size = round % 3 == 0 ? 3.0 : 0.3;
    const Vector3d centre = draw.Vector(0.4);
    const Triangle t = {centre + draw.Vector(size), centre + draw.Vector(size), centre + draw.Vector(size)};
    const PlacedShape a(ConvexShape::FromHull(hull), Isometry3d::Identity());
    const PlacedShape b = Placed(t);
    const PairDistance d = DistanceOf(a, b);
    ASSERT_NEAR(d.normal.norm(), 1.0, 1e-12);
    if (d.distance_m <= 0.0) {
      ++overlapping;
      ASSERT_NEAR(-d.distance_m, Depth(hull, t, a.set(), b.set()), 3e-9) << round;
      // Moved along the normal by the depth, the two just touch.
      const PlacedShape moved(ConvexShape::FromHull(hull), Isometry3d(Eigen::Translation3d(-d.distance_m * d.normal)));
      ASSERT_NEAR(DistanceOf(moved, b).distance_m, 0.0, 1e-8) << round;
    } else {
      ++apart;
      double expected = std::numeric_limits<double>::infinity();
      for (const auto& corners : hull.triangles) {
        const auto at = [&](size_t k) { return hull.vertices[static_cast<size_t>(corners[k])]; };
        expected = std::min(expected, Apart({at(0), at(1), at(2)}, t));
      }
      ASSERT_NEAR(d.distance_m, expected, 3e-9) << round;
      ASSERT_LT(PointToTriangle(d.point_b, t), 1e-9) << round;
    }
  }
  EXPECT_GT(apart, 500);
  EXPECT_GT(overlapping, 300);
}

/// Returns a large triangle in the plane z = 0 whose normal points up or down.
Triangle Ground(bool up) {
  const Vector3d a(-5, -4, 0);
  const Vector3d b(6, -3, 0);
  const Vector3d c(-1, 7, 0);
  return up ? Triangle{a, b, c} : Triangle{a, c, b};
}

TEST(TriangleDistance, HasTwoSidesAndNoInside) {
  for (const bool up : {true, false}) {
    const PlacedShape ground = Placed(Ground(up));
    for (const double sign : {1.0, -1.0}) {
      const PairDistance apart = DistanceOf({Box(0.2, 0.2, 0.2), At(0, 0, 0.3 * sign)}, ground);
      EXPECT_NEAR(apart.distance_m, 0.2, 1e-12);
      EXPECT_LT((apart.normal - sign * Vector3d::UnitZ()).norm(), 1e-9);
      const PairDistance grazing = DistanceOf({Box(0.2, 0.2, 0.2), At(0, 0, 0.09 * sign)}, ground);
      EXPECT_NEAR(grazing.distance_m, -0.01, 1e-9);
      EXPECT_LT((grazing.normal - sign * Vector3d::UnitZ()).norm(), 1e-9) << "out on the side of the centre";
      EXPECT_NEAR(DistanceOf({Box(0.2, 0.2, 0.2), At(0, 0, 50.0 * sign)}, ground).distance_m, 49.9, 1e-9)
          << "nothing is behind it";
    }
  }
}

TEST(TriangleDistance, AFootBuriedBy50MillimetresIsPushedDown) {
  constexpr double kHeight = 0.0535;  // height of an Atlas foot: docs/explanation/paper.md#two-sided-triangles
  const PlacedShape foot(Box(0.26, 0.13, kHeight), At(0, 0, 0.5 * kHeight - 0.05));
  const PairDistance d = DistanceOf(foot, Placed(Ground(true)));
  EXPECT_NEAR(d.distance_m, -0.0035, 1e-9);
  EXPECT_LT((d.normal + Vector3d::UnitZ()).norm(), 1e-9);
}

TEST(TriangleDistance, TouchingAndCoplanarShapes) {
  const PlacedShape ground = Placed(Ground(true));
  for (const double offset : {0.0, 1e-12, -1e-12, 1e-10, -1e-10}) {
    EXPECT_NEAR(DistanceOf({Box(1, 1, 1), At(0, 0, 0.5 + offset)}, ground).distance_m, offset, 2e-9);
  }
  const PlacedShape sliver = Placed({Vector3d(0, 0, 0), Vector3d(1, 0, 0), Vector3d(2, 0, 0)});
  EXPECT_NEAR(DistanceOf({Box(1, 1, 1), At(1, 0, 0.8)}, sliver).distance_m, 0.3, 1e-12);
  EXPECT_NEAR(DistanceOf({Box(1, 1, 1), At(1, 0, 0.4)}, sliver).distance_m, -0.1, 1e-9);
}

/// Returns a robot of one box on a floating base.
RobotModel FlyingFoot(const Vector3d& size) {
  Link link;
  link.name = "foot";
  link.mass = 1.0;
  link.collision = {Spec(ShapeSpec::Kind::kBox, size)};
  return RobotModel("foot", {link}, {});
}

Scene FloorOf(const Vector3d& size) {
  return {{{"floor", Spec(ShapeSpec::Kind::kBox, size, At(0, 0, -0.5 * size.z()))}}};
}

std::vector<ProximityPair> ContactsAt(const RobotModel& robot, const Scene& scene, SceneRepresentation representation,
                                      double height, double margin) {
  Eigen::VectorXd x = ZeroPose(robot);
  x[robot.num_dofs() + 2] = height;
  Kinematics kinematics(robot);
  kinematics.Update(x);
  CollisionQuery query(CollisionModel::Build(robot, scene, ZeroPose(robot), {.scene = representation}));
  const auto contacts = query.Contacts(kinematics, margin);
  return {contacts.begin(), contacts.end()};
}

TEST(Surface, DirectionOfBuriedFootFollowsOrientation) {
  const RobotModel robot = FlyingFoot({0.26, 0.13, 0.0535});
  const Scene scene = FloorOf({4, 4, 1});
  const double buried = 0.5 * 0.0535 - 0.05;
  const auto solid = ContactsAt(robot, scene, SceneRepresentation::kSolid, buried, 0.0);
  ASSERT_EQ(solid.size(), 1U);
  EXPECT_NEAR(solid[0].distance_m, -0.05, 1e-9);
  EXPECT_NEAR(solid[0].normal_W.z(), 1.0, 1e-9);
  const auto surface = ContactsAt(robot, scene, SceneRepresentation::kSurface, buried, 0.0);
  ASSERT_EQ(surface.size(), 2U) << "both triangles of the floor's top";
  for (const ProximityPair& contact : surface) {
    EXPECT_NEAR(contact.distance_m, -0.0035, 1e-9);
    EXPECT_NEAR(contact.normal_W.z(), -1.0, 1e-9);
  }
  EXPECT_TRUE(ContactsAt(robot, scene, SceneRepresentation::kSurface, -0.5, 0.0).empty()) << "inside is free";
}

TEST(OrientedSurface, LiftsABuriedFoot) {
  const RobotModel robot = FlyingFoot({0.26, 0.13, 0.0535});
  const Scene scene = FloorOf({4, 4, 1});
  constexpr auto kOriented = SceneRepresentation::kOrientedSurface;
  for (const double depth : {0.002, 0.03, 0.05}) {  // out at the top is shorter, about as far, and farther
    const auto contacts = ContactsAt(robot, scene, kOriented, 0.5 * 0.0535 - depth, 0.0);
    ASSERT_EQ(contacts.size(), 2U) << "both triangles of the floor's top";
    for (const ProximityPair& contact : contacts) {
      EXPECT_NEAR(contact.distance_m, -depth, 1e-9);
      EXPECT_NEAR(contact.normal_W.z(), 1.0, 1e-9);
      EXPECT_NEAR((contact.point_a_W - contact.point_b_W).dot(contact.normal_W), contact.distance_m, 1e-12);
    }
  }
}

TEST(OrientedSurface, IsTheSurfaceToWhomDoesNotOverlapIt) {
  const RobotModel robot = FlyingFoot({0.26, 0.13, 0.0535});
  const Scene scene = FloorOf({4, 4, 1});
  for (const double height : {0.5 * 0.0535 + 0.01, -0.02 - 0.5 * 0.0535}) {  // front and back
    const auto two_sided = ContactsAt(robot, scene, SceneRepresentation::kSurface, height, 0.03);
    const auto oriented = ContactsAt(robot, scene, SceneRepresentation::kOrientedSurface, height, 0.03);
    ASSERT_EQ(oriented.size(), two_sided.size());
    ASSERT_FALSE(oriented.empty());
    for (std::size_t i = 0; i < oriented.size(); ++i) {
      EXPECT_EQ(oriented[i].distance_m, two_sided[i].distance_m);
      EXPECT_EQ(oriented[i].normal_W, two_sided[i].normal_W);
    }
  }
}

// The sole of a foot penetrates the riser of a step by 2 mm at its upper edge. The shortest way out is up, not back by
// half a foot.
TEST(OrientedSurface, ShortestExitPastAnEdgeIsKept) {
  const RobotModel robot = FlyingFoot({0.26, 0.13, 0.0535});
  Scene scene = FloorOf({4, 4, 1});
  scene.objects.push_back({"step", Spec(ShapeSpec::Kind::kBox, {1, 4, 0.2}, At(0.5, 0, 0.1))});
  const auto contacts =
      ContactsAt(robot, scene, SceneRepresentation::kOrientedSurface, 0.2 + 0.5 * 0.0535 - 0.002, 0.0);
  ASSERT_FALSE(contacts.empty());
  for (const ProximityPair& contact : contacts) EXPECT_NEAR(contact.distance_m, -0.002, 1e-9);
}

TEST(OrientedSurface, PlateIsLeftThroughTheFrontOfEachSide) {
  const RobotModel robot = FlyingFoot({0.26, 0.13, 0.0535});
  Scene plate = FloorOf({4, 4, 0.01});
  bool up = false, down = false;
  for (const ProximityPair& contact : ContactsAt(robot, plate, SceneRepresentation::kOrientedSurface, 0.005, 0.0)) {
    if (contact.normal_W.z() > 0.9) up = true;
    if (contact.normal_W.z() < -0.9) down = true;
  }
  EXPECT_TRUE(up);
  EXPECT_TRUE(down);
}

TEST(Surface, CoplanarNeighboursAreReportedOnceWhenApart) {
  const RobotModel robot = FlyingFoot({0.26, 0.13, 0.0535});
  const auto contacts = ContactsAt(robot, FloorOf({4, 4, 1}), SceneRepresentation::kSurface, 0.5 * 0.0535 + 0.01, 0.03);
  ASSERT_EQ(contacts.size(), 1U);
  EXPECT_NEAR(contacts[0].distance_m, 0.01, 1e-9);
}

TEST(Surface, APenetratedTriangleHidesNothing) {
  // The foot has sunk through the floor, whose triangle pushes it down, next to a wall that rises from the floor.
  const RobotModel robot = FlyingFoot({0.26, 0.13, 0.0535});
  Scene scene = FloorOf({4, 4, 1});
  scene.objects.push_back({"wall", Spec(ShapeSpec::Kind::kBox, {1, 4, 1}, At(0.64, 0, 0.5))});
  bool wall = false;
  for (const ProximityPair& c : ContactsAt(robot, scene, SceneRepresentation::kSurface, 0.5 * 0.0535 - 0.05, 0.03)) {
    wall = wall || (c.distance_m > 0.0 && c.normal_W.x() < -0.9);
  }
  EXPECT_TRUE(wall);
}

TEST(Surface, PrimitivesBecomeTrianglesAndTheRobotStaysTheSame) {
  const RobotModel robot = FlyingFoot({0.2, 0.2, 0.2});
  Scene scene = FloorOf({4, 4, 1});
  scene.objects.push_back({"ball", Spec(ShapeSpec::Kind::kSphere, {0.3, 0, 0}, At(1, 0, 1))});
  const auto model = CollisionModel::Build(robot, scene, ZeroPose(robot), {.scene = SceneRepresentation::kSurface});
  EXPECT_EQ(model->scene_representation(), SceneRepresentation::kSurface);
  EXPECT_EQ(model->num_scene_solids(), static_cast<int>(CollectSceneTriangles(scene).triangles.size()));
  EXPECT_GT(model->num_scene_solids(), 12 + 500);
  EXPECT_FALSE(model->SceneContains({0, 0, -0.5}));
  EXPECT_EQ(model->num_link_pieces(0), 1);
}

TEST(Surface, NamesAreReadBack) {
  const auto read = [](std::string_view text) {
    return ReadEnum<SceneRepresentation>(text, "suite.yaml", "collision", "representation of the scene");
  };
  for (const auto representation :
       {SceneRepresentation::kSolid, SceneRepresentation::kSurface, SceneRepresentation::kOrientedSurface}) {
    EXPECT_EQ(read(ToString(representation)), representation);
  }
  try {
    read("mesh");
    FAIL();
  } catch (const InputError& error) {
    EXPECT_STREQ(error.what(),
                 "suite.yaml: collision: unknown representation of the scene (got 'mesh'); use 'solid', 'surface' or "
                 "'surface_oriented'");
    EXPECT_EQ(error.fault().value, "mesh");
    EXPECT_EQ(error.fault().file, "suite.yaml");
  }
}

/// Returns all pairs of a link's pieces and a triangle nearer than the margin, computed without a broadphase.
std::map<std::pair<int, int>, double> TestAllTriangles(const CollisionModel& model, const Kinematics& kinematics,
                                                       double margin) {
  const CollisionModel::Impl& data = model.impl();
  std::map<std::pair<int, int>, double> found;
  for (int link = 0; link < model.num_links(); ++link) {
    const LinkShapes& shapes = data.links[static_cast<size_t>(link)];
    for (int piece = shapes.hulls.first; piece < shapes.hulls.end(); ++piece) {
      const PlacedShape placed(data.shapes[static_cast<size_t>(piece)], kinematics.link_pose(link));
      for (size_t t = 0; t < data.solid_sets.size(); ++t) {
        PairDistance d;
        if (SignedDistance(placed.set(), data.solid_sets[t], margin, d)) {
          found[{piece, static_cast<int>(t)}] = d.distance_m;
        }
      }
    }
  }
  return found;
}

class AtlasOnSurface : public ::testing::Test {
 protected:
  void SetUp() override {
    LEGOPT_REQUIRE_FILE(GarageFile());
    LEGOPT_REQUIRE_FILE(DataFolder() / "problemsposture.json");
    robot_ = std::make_unique<RobotModel>(Atlas());
    model_ =
        CollisionModel::Build(*robot_, Garage(), AtlasReference(*robot_), {.scene = SceneRepresentation::kSurface});
    for (const auto& stance : ReadStances(DataFolder() / "problemsposture.json")) {
      standing_.push_back(StandOn(*robot_, stance));
    }
  }

  Kinematics At(size_t problem, double lift) const {
    Eigen::VectorXd x = standing_[problem];
    x[robot_->num_dofs() + 2] += lift;
    Kinematics kinematics(*robot_);
    kinematics.Update(x);
    return kinematics;
  }

  std::unique_ptr<RobotModel> robot_;
  std::shared_ptr<const CollisionModel> model_;
  std::vector<Eigen::VectorXd> standing_;
};

TEST_F(AtlasOnSurface, NoTriangleIsMissed) {
  CollisionQuery query(model_);
  constexpr double kMargin = 0.03;
  int penetrating = 0;
  for (size_t problem = 0; problem < standing_.size(); problem += 8) {
    for (const double lift : {0.0, -0.05, -0.1}) {
      const Kinematics kinematics = At(problem, lift);
      const auto expected = TestAllTriangles(*model_, kinematics, kMargin);
      const int num_triangles = model_->num_scene_solids();
      std::map<std::pair<int, int>, double> reported;
      for (const ProximityPair& c : query.SceneContacts(kinematics, kMargin)) {
        const std::pair<int, int> pair(c.pair_id / num_triangles, c.pair_id % num_triangles);
        ASSERT_EQ(expected.count(pair), 1U);
        EXPECT_EQ(expected.at(pair), c.distance_m);
        reported[pair] = c.distance_m;
      }
      std::map<int, double> nearest[2];
      for (const auto& [pair, distance] : expected) {
        if (distance <= 0.0) {
          ++penetrating;
          EXPECT_EQ(reported.count(pair), 1U) << "penetrating contacts all stay";
        }
        nearest[0].try_emplace(pair.first, distance).first->second =
            std::min(nearest[0].try_emplace(pair.first, distance).first->second, distance);
      }
      for (const auto& [pair, distance] : reported) {
        nearest[1].try_emplace(pair.first, distance).first->second =
            std::min(nearest[1].try_emplace(pair.first, distance).first->second, distance);
      }
      EXPECT_EQ(nearest[0], nearest[1]) << "the nearest of each link stays";
    }
  }
  EXPECT_GT(penetrating, 20);
}

TEST_F(AtlasOnSurface, ContactsOfSomeLinksAreThoseOfAllLinks) {
  const auto solid = CollisionModel::Build(*robot_, Garage(), AtlasReference(*robot_));
  const std::vector<int> feet = {robot_->FindLink("l_foot"), robot_->FindLink("r_foot")};
  for (const auto& model : {model_, solid}) {
    CollisionQuery query(model);
    int compared = 0;
    for (size_t problem = 0; problem < standing_.size(); problem += 2) {
      const Kinematics kinematics = At(problem, 0.0);
      std::vector<ProximityPair> expected;
      for (const ProximityPair& c : query.Contacts(kinematics, 0.03)) {
        if (c.link_b == kScene && std::count(feet.begin(), feet.end(), c.link_a) > 0) expected.push_back(c);
      }
      const auto found = query.SceneContacts(kinematics, 0.03, feet);
      ASSERT_EQ(found.size(), expected.size());
      for (size_t i = 0; i < found.size(); ++i, ++compared) {
        EXPECT_EQ(found[i].pair_id, expected[i].pair_id);
        EXPECT_EQ(found[i].distance_m, expected[i].distance_m);
      }
      for (const ProximityPair& c : query.SceneContacts(kinematics, 0.03)) EXPECT_EQ(c.link_b, kScene);
    }
    EXPECT_GT(compared, 20);
  }
}

TEST_F(AtlasOnSurface, SelfContactsAreThoseOfTheSolidModel) {
  const auto solid = CollisionModel::Build(*robot_, Garage(), AtlasReference(*robot_));
  EXPECT_EQ(solid->checked_pairs(), model_->checked_pairs());
  EXPECT_EQ(solid->decomposed_pairs(), model_->decomposed_pairs());
  CollisionQuery queries[2] = {CollisionQuery(solid), CollisionQuery(model_)};
  const Kinematics kinematics = At(0, 0.0);
  std::vector<double> distances[2];
  for (size_t i = 0; i < 2; ++i) {
    for (const ProximityPair& c : queries[i].Contacts(kinematics, 0.05)) {
      if (c.link_b != kScene) distances[i].push_back(c.distance_m);
    }
  }
  EXPECT_FALSE(distances[0].empty());
  EXPECT_EQ(distances[0], distances[1]);
}

TEST_F(AtlasOnSurface, AllocatesNothingAfterWarmUp) {
  CollisionQuery query(model_);
  std::vector<Kinematics> postures;
  for (size_t problem = 0; problem < standing_.size(); ++problem) postures.push_back(At(problem, -0.05));
  for (const Kinematics& kinematics : postures) query.Contacts(kinematics, 0.03);
  const long before = AllocationCount();
  for (const Kinematics& kinematics : postures) query.Contacts(kinematics, 0.03);
  EXPECT_EQ(AllocationCount(), before);
}

}  // namespace
}  // namespace legopt::test
