#include <gtest/gtest.h>
#include <ode/ode.h>

#include "legopt/geometry/internal/ode_world.h"
#include "legopt/geometry/internal/trimesh_world.h"
#include "tests/geometry/test_shapes.h"

namespace legopt::test {
namespace {

/// Solids and moving shapes with their support sets, in ODE.
class World {
 public:
  void AddSolid(ConvexShape shape) {
    placed_.push_back(std::make_unique<PlacedShape>(shape, Eigen::Isometry3d::Identity()));
    solid_sets_.push_back(placed_.back()->set());
    solids_.push_back(std::move(shape));
  }
  void AddMoving(ConvexShape shape, const Eigen::Isometry3d& pose) {
    placed_.push_back(std::make_unique<PlacedShape>(std::move(shape), pose));
    moving_.push_back(placed_.back()->set());
  }
  OdeConvexWorld Build() { return OdeConvexWorld(solids_, solid_sets_, moving_); }
  const SupportSet& solid_set(int i) const { return solid_sets_[static_cast<size_t>(i)]; }
  const SupportSet& moving_set(int i) const { return moving_[static_cast<size_t>(i)]; }
  const std::vector<ConvexShape>& solids() const { return solids_; }

 private:
  std::vector<std::unique_ptr<PlacedShape>> placed_;
  std::vector<ConvexShape> solids_;
  std::vector<SupportSet> solid_sets_;
  std::vector<SupportSet> moving_;
};

ConvexShape RandomShape(int kind, Draw& draw, const Eigen::Isometry3d& pose) {
  switch (kind) {
    case 0:
      return ConvexShape::FromPrimitive(Spec(ShapeSpec::Kind::kBox, {0.4, 0.5, 0.6}, pose));
    case 1:
      return ConvexShape::FromPrimitive(Spec(ShapeSpec::Kind::kSphere, {0.3, 0, 0}, pose));
    case 2:
      return ConvexShape::FromPrimitive(Spec(ShapeSpec::Kind::kCapsule, {0.2, 0, 0.5}, pose));
    case 3:
      return ConvexShape::FromPrimitive(Spec(ShapeSpec::Kind::kCylinder, {0.2, 0, 0.5}, pose));
    default: {
      std::vector<Eigen::Vector3d> points = draw.RandomHull(20, {0.3, 0.3, 0.3}).vertices;
      for (Eigen::Vector3d& p : points) p = pose * p;
      return Hull(points);
    }
  }
}

TEST(OdeConvexWorld, EveryPairingGivesTheExactSignedDistance) {
  constexpr int kKinds = 5;
  constexpr double kMargin = 0.5;
  Draw draw(21);
  World world;
  for (int kind = 0; kind < kKinds; ++kind) world.AddSolid(RandomShape(kind, draw, draw.Pose(0.4)));
  for (int kind = 0; kind < kKinds; ++kind) {
    for (int copy = 0; copy < 20; ++copy) {
      world.AddMoving(RandomShape(kind, draw, Eigen::Isometry3d::Identity()), draw.Pose(0.8));
    }
  }
  OdeConvexWorld ode = world.Build();
  int found = 0;
  for (int moving = 0; moving < kKinds * 20; ++moving) {
    for (int solid = 0; solid < kKinds; ++solid) {
      PairDistance direct;
      PairDistance through_ode;
      const bool near = SignedDistance(world.moving_set(moving), world.solid_set(solid), kMargin, direct);
      ASSERT_EQ(ode.CollideWithSolid(moving, solid, kMargin, through_ode), near) << moving << " " << solid;
      if (!near) continue;
      ++found;
      // ODE may pass the pair in either order; for cylinders the last digits then differ.
      EXPECT_NEAR(through_ode.distance_m, direct.distance_m, 1e-8) << moving << ' ' << solid;
      EXPECT_LT((through_ode.normal - direct.normal).norm(), 1e-4);
      EXPECT_LT((through_ode.point_a - direct.point_a).norm(), 1e-4);
      EXPECT_LT((through_ode.point_a - through_ode.point_b - through_ode.distance_m * through_ode.normal).norm(),
                1e-12);
    }
    PairDistance self;
    const int next = (moving + 1) % (kKinds * 20);
    EXPECT_EQ(ode.CollideMoving(moving, next, kMargin, self),
              SignedDistance(world.moving_set(moving), world.moving_set(next), kMargin, self));
  }
  EXPECT_GT(found, 100);
}

TEST(OdeConvexWorld, BroadphaseFindsAllOverlappingBoundsInOrder) {
  Draw draw(22);
  World world;
  for (int i = 0; i < 300; ++i) {
    const Eigen::Isometry3d pose = At(draw.Number(-30, 30), draw.Number(-20, 20), draw.Number(0, 10)) * draw.Pose(0.1);
    world.AddSolid(RandomShape(i % 5, draw, pose));
  }
  OdeConvexWorld ode = world.Build();
  std::vector<int> found;
  for (int round = 0; round < 100; ++round) {
    const Eigen::Vector3d centre(draw.Number(-40, 40), draw.Number(-30, 30), draw.Number(-2, 12));
    const Eigen::AlignedBox3d box(centre - Eigen::Vector3d::Constant(2.0), centre + Eigen::Vector3d::Constant(2.0));
    ode.CollectSolids(box, found);
    std::vector<int> expected;
    for (size_t i = 0; i < world.solids().size(); ++i) {
      if (world.solids()[i].bounds().intersects(box)) expected.push_back(static_cast<int>(i));
    }
    // ODE computes bounds of its own primitives. A grazing box may differ in the last bit, a real overlap may not.
    ASSERT_EQ(found, expected) << round;
  }
}

TEST(OdeConvexWorldDeathTest, MeetingATrimeshAborts) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  World world;
  world.AddSolid(Box(1, 1, 1));
  world.AddMoving(Hull({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}), At(0, 0, 0));
  OdeConvexWorld ode = world.Build();
  EXPECT_DEATH(
      {
        dGeomID convex = dCreateGeom(dFirstUserClass);
        dGeomID trimesh = dCreateTriMesh(nullptr, dGeomTriMeshDataCreate(), nullptr, nullptr, nullptr);
        dContactGeom contact;
        dCollide(convex, trimesh, 1, &contact, sizeof(contact));
      },
      "convex shape met a triangle mesh");
}

}  // namespace
}  // namespace legopt::test
