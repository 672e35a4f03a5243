#include <gtest/gtest.h>

#include "legopt/types/input_error.h"
#include "legopt/worldgen/internal/footstep_planner.h"
#include "legopt/worldgen/internal/stance_sampler.h"
#include "tests/dataset/test_data.h"
#include "tests/worldgen/plain_dataset.h"

namespace legopt::worldgen {
namespace {

using Eigen::Vector3d;

class Planning : public testing::Test {
 protected:
  void SetUp() override {
    test::WritePlainDataset(folder_.path() / "plain", test::kTwoLevels);
    dataset_ = Dataset::Load(folder_.path() / "plain");
    model_ = ProbeModel::Build(dataset_, ProbeOptions::For(*dataset_));
  }

  Stance Standing(double x, double y, double z, double yaw) const {
    StanceProbe probe(model_);
    Stance stance;
    for (const int foot : {0, 1}) {
      const double side = foot == 0 ? 0.13 : -0.13;
      const Vector3d point(x - side * std::sin(yaw), y + side * std::cos(yaw), z);
      stance.contacts.push_back(probe.Place(foot, point, Vector3d::UnitZ(), yaw));
    }
    return stance;
  }

  test::TemporaryFolder folder_;
  std::shared_ptr<const Dataset> dataset_;
  std::shared_ptr<const ProbeModel> model_;
};

TEST_F(Planning, FeetHoldOnTheFlatOnly) {
  StanceProbe probe(model_);
  std::vector<ContactTarget> contacts;
  probe.Footholds(0, -2.0, 0.0, 0.7, contacts);
  ASSERT_EQ(contacts.size(), 1u);
  EXPECT_NEAR(contacts[0].position.z(), 0.0, 1e-9);
  EXPECT_NEAR(Yaw(contacts[0]), 0.7, 1e-9);
  probe.Footholds(0, -0.05, 0.0, 0.0, contacts);  // half on the first step
  EXPECT_TRUE(contacts.empty());
  probe.Footholds(0, -3.95, 0.0, 0.0, contacts);  // beyond the edge of the ground
  EXPECT_TRUE(contacts.empty());
  EXPECT_NEAR(probe.TrunkDistance(Standing(-2, 0, 0, 0), 0.3), 0.3, 1e-9);
}

TEST_F(Planning, StancesAreTheSameForAnyNumberOfThreads) {
  StanceSamplerOptions options;
  options.count = 6;
  const SampledStances one = SampleStances(model_, options, {});
  options.threads = 2;
  const SampledStances two = SampleStances(model_, options, {});
  EXPECT_EQ(one.stances, two.stances);
  EXPECT_EQ(one.tally.candidates, two.tally.candidates);
  PostureProver prover(dataset_);
  for (const Stance& stance : one.stances) {
    ASSERT_EQ(stance.contacts.size(), 2u);
    const Vector3d apart = stance.contacts[1].position - stance.contacts[0].position;
    EXPECT_LE(apart.head<2>().norm(), model_->options.reach_m);
    EXPECT_LE(std::abs(apart.z()), model_->options.step_m);
    EXPECT_TRUE(prover.Prove(stance, 0).accepted);
  }
}

TEST_F(Planning, PlanClimbsAndAlternates) {
  const auto guide = std::make_shared<const GuideMap>(*model_);
  FootstepPlanner planner(model_, guide, {});
  const Stance start = Standing(-2.0, 0.5, 0.0, 0.0);
  const Stance goal = Standing(3.0, -0.4, 0.6, 0.0);
  const auto plan = planner.Plan(start, goal);
  ASSERT_TRUE(plan.has_value());
  EXPECT_EQ(plan->stances.front(), start);
  EXPECT_EQ(plan->stances.back(), goal);
  EXPECT_EQ(static_cast<int>(plan->stances.size()), 2 * plan->steps + 1);
  EXPECT_GE(plan->bound, 1.0);
  EXPECT_GE(plan->cost, plan->steps);
  EXPECT_GE(plan->steps, 8);  // five metres with at most 0.7 m between the feet
  for (size_t s = 0; s < plan->stances.size(); ++s) {
    const Stance& stance = plan->stances[s];
    if (s % 2 == 0) {
      ASSERT_EQ(stance.contacts.size(), 2u);
      EXPECT_EQ(stance.contacts[0].contact, "l_foot");
      const Vector3d apart = stance.contacts[1].position - stance.contacts[0].position;
      EXPECT_LE(apart.head<2>().norm(), model_->options.reach_m + 1e-9);
    } else {
      ASSERT_EQ(stance.contacts.size(), 1u);
      EXPECT_EQ(stance.contacts[0].contact, s % 4 == 1 ? "l_foot" : "r_foot");
    }
  }
  // The planner's cache does not change its plans.
  const auto again = planner.Plan(start, goal);
  ASSERT_TRUE(again.has_value());
  EXPECT_EQ(again->stances, plan->stances);
  EXPECT_EQ(again->expansions, plan->expansions);
}

TEST_F(Planning, NoWayNoPlan) {
  test::WritePlainDataset(folder_.path() / "islands",
                          "objects:\n"
                          "  - {name: a, shape: box, size: [2, 2, 0.2], position: [-2, 0, -0.1]}\n"
                          "  - {name: b, shape: box, size: [2, 2, 0.2], position: [2, 0, -0.1]}\n");
  const auto islands = Dataset::Load(folder_.path() / "islands");
  const auto model = ProbeModel::Build(islands, ProbeOptions::For(*islands));
  FootstepPlanner planner(model, std::make_shared<const GuideMap>(*model), {});
  EXPECT_FALSE(planner.Plan(Standing(-2, 0, 0, 0), Standing(2, 0, 0, 0)).has_value());
  EXPECT_TRUE(planner.Plan(Standing(-2.3, 0, 0, 0), Standing(-1.7, 0, 0, 0)).has_value());
}

TEST_F(Planning, LowRubbleIsSteppedOver) {
  // A ridge of 0.14 m across the whole path, too steep for contacts; it fills a row of the map's squares.
  const auto ridge = [&](const std::string& name, double height_m) {
    test::WritePlainDataset(folder_.path() / name,
                            "objects:\n"
                            "  - {name: ground, shape: box, size: [6.2, 2, 0.6], position: [0, 0, -0.3]}\n"
                            "  - {name: ridge, shape: box, size: [0.198, 2, 0.198], rpy: [0, 0.7854, 0],"
                            " position: [0, 0, " +
                                std::to_string(height_m - 0.14) + "]}\n");
    const auto dataset = Dataset::Load(folder_.path() / name);
    const auto model = ProbeModel::Build(dataset, ProbeOptions::For(*dataset));
    FootstepPlanner planner(model, std::make_shared<const GuideMap>(*model), {});
    return planner.Plan(Standing(-1, 0, 0, 0), Standing(1, 0, 0, 0));
  };
  EXPECT_TRUE(ridge("low", 0.14).has_value());
  EXPECT_FALSE(ridge("high", 0.44).has_value()) << "higher than a step, it is a wall";
}

TEST_F(Planning, BadInputIsNamed) {
  ProbeOptions small = ProbeOptions::For(*dataset_);
  small.reach_m = 0.05;
  EXPECT_NE(test::MessageOf([&] { small.Validate(*dataset_); }).find("feet overlap"), std::string::npos);
  ProbeOptions large = ProbeOptions::For(*dataset_);
  large.reach_m = 3.0;
  EXPECT_NE(test::MessageOf([&] { large.Validate(*dataset_); }).find("exceeds the robot's reach"), std::string::npos);
  test::WritePlainDataset(folder_.path() / "steep",
                          "objects:\n  - {name: a, shape: box, size: [4, 4, 0.2], rpy: [0.78, 0, 0]}\n");
  const auto steep = Dataset::Load(folder_.path() / "steep");
  EXPECT_NE(test::MessageOf([&] { ProbeModel::Build(steep, ProbeOptions::For(*steep)); }).find("no walkable ground"),
            std::string::npos);
}

TEST_F(Planning, RobotsWithoutTwoFeetAreRefused) {
  const auto plain = folder_.path() / "plain";
  std::string text = test::ReadText(plain / kDatasetFileName);
  const std::string feet = "feet: [l_foot, r_foot]";
  text.replace(text.find(feet), feet.size(), "feet: [l_foot]");
  test::WriteText(plain / kDatasetFileName, text);
  const auto hopper = Dataset::Load(plain);
  EXPECT_NE(
      test::MessageOf([&] { ProbeModel::Build(hopper, ProbeOptions::For(*hopper)); }).find("two feet (got '1 feet')"),
      std::string::npos);
}

}  // namespace
}  // namespace legopt::worldgen
