// Policy: convex shapes that overlap where the meshes are apart do not keep a solver from a posture that the judge
// accepts.
#include "legopt/geometry/internal/false_overlap.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <memory>
#include <numbers>
#include <random>

#include "legopt/geometry/collision_query.h"
#include "legopt/geometry/internal/model_data.h"
#include "tests/geometry/atlas_data.h"
#include "tests/geometry/test_shapes.h"
#include "tests/temporary_folder.h"

namespace legopt::test {
namespace {

std::vector<ConvexShape> Cube() {
  return {ConvexShape::FromPrimitive(Spec(ShapeSpec::Kind::kBox, {0.02, 0.02, 0.02}))};
}

/// Poses in which two cubes of Cube() overlap by these depths, m.
std::vector<PairPoses> Overlapping(const std::vector<double>& depths_m) {
  std::vector<PairPoses> poses;
  for (const double depth_m : depths_m) {
    PairPoses pose{Eigen::Isometry3d::Identity(), Eigen::Isometry3d::Identity()};
    pose.second.translation().x() = 0.02 - depth_m;
    poses.push_back(pose);
  }
  return poses;
}

TEST(FalseDepth, TellsPosturesApartFromOverlappingOnes) {
  const std::vector<ConvexShape> first = Cube(), second = Cube();
  const auto find = [&](const SortedPoses& poses) {
    return FindFalseDepth(poses, {first, second}, ApartBy::kTolerance);
  };
  // Shapes less than 1 mm apart count as overlapping, so that 3 mm of overlap is a false depth of 4 mm.
  const FalseDepth clear = find({Overlapping({0.001, 0.002, 0.003}), Overlapping({0.008, 0.009})});
  EXPECT_NEAR(clear.length_m, 0.004, 1e-9);
  EXPECT_DOUBLE_EQ(clear.score, 1.0);
  const FalseDepth mixed = find({Overlapping({0.001, 0.002, 0.006}), Overlapping({0.004, 0.005, 0.008})});
  EXPECT_NEAR(mixed.length_m, 0.003, 1e-9);
  EXPECT_NEAR(mixed.score, 2.0 / 3.0, 1e-12);
  const FalseDepth never_overlapping = find({Overlapping({0.001, 0.005}), {}});
  EXPECT_NEAR(never_overlapping.length_m, 0.006, 1e-9);
  const FalseDepth nothing = find({Overlapping({0.010}), Overlapping({0.008, 0.009})});
  EXPECT_EQ(nothing.score, 0.0);
  EXPECT_NEAR(nothing.length_m, 0.011, 1e-9);  // apart in all postures in which the meshes are
  const FalseDepth never_apart = find({{}, Overlapping({0.001, 0.005})});
  EXPECT_EQ(never_apart.length_m, 0.0);
}

TEST(FalseDepth, IsFoundByPair) {
  LinkPairRules rules;
  rules.decomposed = {{0, 2}, {1, 2}, {0, 3}, {2, 3}, {1, 4}};  // by (second, first)
  EXPECT_EQ(rules.FalseDepth_m({1, 2}), 0.0);
  rules.false_depths_m = {0.1, 0.2, 0.3, 0.4, 0.5};
  for (size_t i = 0; i < rules.decomposed.size(); ++i) {
    EXPECT_EQ(rules.FalseDepth_m(rules.decomposed[i]), rules.false_depths_m[i]);
  }
  for (const LinkPair& other : {LinkPair(0, 1), LinkPair(1, 3), LinkPair(0, 4), LinkPair(3, 5)}) {
    EXPECT_EQ(rules.FalseDepth_m(other), 0.0);
  }
}

TEST(FalseDepth, MostIsMoreThanHalf) {
  const std::vector<ConvexShape> first = Cube(), second = Cube();
  const auto most = [&](const std::vector<double>& depths_m) {
    return MostlyOverlap(Overlapping(depths_m), {first, second}, ApartBy::kTolerance);
  };
  EXPECT_FALSE(most({}));
  EXPECT_FALSE(most({0.002, -0.002}));
  EXPECT_TRUE(most({0.002, 0.002, -0.002}));
  EXPECT_TRUE(most({-0.0005}));  // nearer than 1 mm
  EXPECT_FALSE(MostlyOverlap(Overlapping({-0.0005}), {first, second}, ApartBy::kTouch));
}

/// Writes a cup without a lid, around the z axis: outer radius 30 mm, inner 25 mm, 60 mm high, bottom at z = -30 mm,
/// 5 mm thick.
void WriteCup(const std::filesystem::path& file) {
  constexpr int kSides = 24;
  constexpr double kProfile[][2] = {{0.030, -0.03}, {0.030, 0.03}, {0.025, 0.03}, {0.025, -0.025}};  // radius, z
  constexpr int kRings = 4;
  std::ofstream out(file);
  for (const auto& [radius, z] : kProfile) {
    for (int side = 0; side < kSides; ++side) {
      const double angle = 2.0 * std::numbers::pi * side / kSides;
      out << "v " << radius * std::cos(angle) << ' ' << radius * std::sin(angle) << ' ' << z << '\n';
    }
  }
  out << "v 0 0 -0.03\nv 0 0 -0.025\n";
  const auto corner = [](int ring, int side) { return ring * kSides + side % kSides + 1; };
  for (int side = 0; side < kSides; ++side) {
    for (int ring = 0; ring + 1 < kRings; ++ring) {
      out << "f " << corner(ring, side) << ' ' << corner(ring, side + 1) << ' ' << corner(ring + 1, side + 1) << '\n';
      out << "f " << corner(ring, side) << ' ' << corner(ring + 1, side + 1) << ' ' << corner(ring + 1, side) << '\n';
    }
    out << "f " << corner(0, side + 1) << ' ' << corner(0, side) << ' ' << kRings * kSides + 1 << '\n';
    out << "f " << corner(kRings - 1, side) << ' ' << corner(kRings - 1, side + 1) << ' ' << kRings * kSides + 2
        << '\n';
  }
}

/// cup - (joint) - link without geometry - (joint) - ball of 15 mm in the cup, which both joints turn in place.
RobotModel BallInCup(const std::filesystem::path& folder, const ReadGuard& guard = {}) {
  WriteCup(folder / "cup.obj");
  const auto link = [](const std::string& name, const std::string& geometry) {
    return "<link name='" + name +
           "'><inertial><mass value='1'/><inertia ixx='1' iyy='1' izz='1' ixy='0' ixz='0' iyz='0'/></inertial>" +
           (geometry.empty() ? "" : "<collision><geometry>" + geometry + "</geometry></collision>") + "</link>";
  };
  const auto joint = [](const std::string& parent, const std::string& child, const std::string& axis) {
    return "<joint name='" + child + "' type='revolute'><parent link='" + parent + "'/><child link='" + child +
           "'/><axis xyz='" + axis + "'/><limit lower='-1' upper='1' effort='1' velocity='1'/></joint>";
  };
  return RobotModel::FromUrdfText("<robot name='r'>" + link("cup", "<mesh filename='cup.obj'/>") + link("cross", "") +
                                      link("ball", "<sphere radius='0.015'/>") + joint("cup", "cross", "1 0 0") +
                                      joint("cross", "ball", "0 1 0") + "</robot>",
                                  (folder / "robot.urdf").string(), folder.string(), guard);
}

TEST(FalseDepth, PairsThatOverlapFalselyAreFound) {
  const TemporaryFolder folder;
  const RobotModel robot = BallInCup(folder.path());
  TrimeshWorld world;
  LinkTrimeshes meshes(robot, world);
  const std::vector<LinkPair> pair = {{0, 2}};
  for (const ApartBy apart : {ApartBy::kTouch, ApartBy::kTolerance}) {
    EXPECT_EQ(FindFalselyOverlapping(robot, meshes, pair, apart), pair);
    const std::vector<SortedPoses> poses = SamplePoses(robot, meshes, pair, apart);
    ASSERT_EQ(poses.size(), 1U);
    EXPECT_EQ(poses[0].apart.size(), 512U);
    EXPECT_TRUE(poses[0].overlapping.empty());
  }
}

/// A cache in memory.
class MemoryCache : public ByteCache {
 public:
  std::optional<std::string> Read(std::string_view key) const override {
    const auto found = entries_.find(std::string(key));
    return found == entries_.end() ? std::nullopt : std::optional(found->second);
  }
  void Write(std::string_view key, std::string_view bytes) const override { entries_[std::string(key)] = bytes; }
  size_t size() const { return entries_.size(); }

 private:
  mutable std::map<std::string, std::string> entries_;
};

// Both selections have one entry, whatever the reference posture.
TEST(FalseDepth, IsKeptInTheCacheForBothSelections) {
  const TemporaryFolder folder;
  const auto cache = std::make_shared<const MemoryCache>();
  const auto unguarded = [](const std::function<std::string()>& read, const ReadLimits&) { return read(); };
  const RobotModel robot = BallInCup(folder.path(), ReadGuard(unguarded, cache));
  const RobotModel uncached = BallInCup(folder.path());
  const std::vector<UncheckedPair> never = {{{0, 2}, UncheckedReason::kNever}};
  for (const auto& unchecked : {std::vector<UncheckedPair>(), never}) {
    size_t entries = 0;
    Eigen::VectorXd reference_x = ZeroPose(robot);
    for (const PairSelection pairs : {PairSelection::kReference, PairSelection::kAll}) {
      const CollisionOptions options{.pairs = pairs, .unchecked = unchecked};
      const LinkPairRules kept = CollisionModel::Build(robot, {}, reference_x, options)->impl().pairs;
      const LinkPairRules computed = CollisionModel::Build(uncached, {}, reference_x, options)->impl().pairs;
      EXPECT_EQ(kept.status, computed.status);
      EXPECT_EQ(kept.checked(), computed.checked());
      EXPECT_EQ(kept.detail, computed.detail);
      EXPECT_EQ(kept.false_depths_m, computed.false_depths_m);
      reference_x[0] = 0.5;
      EXPECT_TRUE(entries == 0 || cache->size() == entries) << "prepared again for the other selection";
      entries = cache->size();
      EXPECT_GT(entries, 0U);
    }
  }
}

TEST(FalseDepth, LetsASolverUseABallInACup) {
  const TemporaryFolder folder;
  const RobotModel robot = BallInCup(folder.path());
  CollisionOptions options{.max_link_pieces = 1,
                           .pairs = PairSelection::kAll};  // hulls: none can show the cup's hollow
  const auto nearest = [&](double margin_m) {
    CollisionQuery query(CollisionModel::Build(robot, {}, ZeroPose(robot), options));
    Kinematics kinematics(robot);
    std::mt19937_64 random(2);
    double nearest_m = margin_m;
    for (int i = 0; i < 20; ++i) {
      kinematics.Update(i == 0 ? ZeroPose(robot) : SamplePosture(robot, random));
      for (const ProximityPair& contact : query.Contacts(kinematics, margin_m)) {
        nearest_m = std::min(nearest_m, contact.distance_m);
        EXPECT_LT(contact.distance_m, margin_m);
        EXPECT_TRUE((contact.point_a_W - contact.point_b_W).isApprox(contact.distance_m * contact.normal_W, 1e-6));
      }
    }
    return nearest_m;
  };
  EXPECT_LT(nearest(5e-4), -0.01);  // without a list of pairs: no posture without an overlap
  options.unchecked.emplace();
  EXPECT_EQ(nearest(5e-4), 5e-4);
  EXPECT_NEAR(nearest(2e-2), 1e-3, 1e-9);
  const auto model = CollisionModel::Build(robot, {}, ZeroPose(robot), options);
  EXPECT_EQ(model->pair_status(0, 2), CollisionModel::PairStatus::kChecked);
  EXPECT_GT(model->impl().pairs.FalseDepth_m({0, 2}), 0.01);
  EXPECT_EQ(model->impl().pairs.FalseDepth_m({0, 1}), 0.0);
}

}  // namespace
}  // namespace legopt::test
