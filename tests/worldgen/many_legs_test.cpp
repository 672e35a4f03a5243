// Gaits and plans of robots with another number of legs than two, four and six.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "legopt/worldgen/internal/legged_planner.h"
#include "legopt/worldgen/internal/stance_sampler.h"
#include "tests/import/import_fixture.h"

namespace legopt::worldgen {
namespace {

using testing::HasSubstr;
using testing::SizeIs;

class ManyLegs : public test::RobotImport {
 protected:
  /// A robot with legs around its trunk, on level ground.
  std::shared_ptr<const ProbeModel> Robot(int legs) {
    test::Walker walker{.legs = {}, .foot = test::kBall};
    for (int leg = 0; leg < legs; ++leg) {
      const double angle = 2.0 * M_PI * (leg + 0.5) / legs;
      walker.legs.emplace_back("leg" + std::to_string(leg),
                               std::to_string(0.3 * std::cos(angle)) + " " + std::to_string(0.3 * std::sin(angle)));
    }
    Import(walker);
    const auto dataset = Dataset::Load(out_);
    return ProbeModel::Build(dataset, ProbeOptions::For(*dataset));
  }
};

SampledStances TwoStances(const std::shared_ptr<const ProbeModel>& model) {
  StanceSamplerOptions options;
  options.count = 2;
  return SampleStances(model, options, {});
}

std::vector<std::size_t> PhaseSizes(const Gait& gait) {
  std::vector<std::size_t> sizes;
  for (const std::vector<int>& phase : gait.phases) sizes.push_back(phase.size());
  return sizes;
}

TEST_F(ManyLegs, GaitsLeaveThreeFeetOnTheGround) {
  EXPECT_THAT(GaitsOf(*Robot(3)->reach), SizeIs(1)) << "three feet leave two";
  const std::vector<Gait> five = GaitsOf(*Robot(5)->reach), eight = GaitsOf(*Robot(8)->reach);
  EXPECT_EQ(PhaseSizes(five.front()), (std::vector<std::size_t>{2, 2, 1}));
  EXPECT_EQ(PhaseSizes(eight.front()), (std::vector<std::size_t>{4, 4}));
  for (const Gait& gait : {five.back(), eight.back()}) {
    EXPECT_EQ(gait.name, "walk");
    EXPECT_TRUE(gait.any_order);
  }
}

TEST_F(ManyLegs, AFiveLeggedRobotWalks) {
  const auto model = Robot(5);
  const SampledStances sampled = TwoStances(model);
  LeggedPlanner planner(model, std::make_shared<const GuideMap>(*model), {});
  // The goal is the start, moved.
  const Stance& start = sampled.stances.front();
  Stance goal = start;
  for (ContactTarget& target : goal.contacts) target.position.x() += target.position.x() > 0.0 ? -0.6 : 0.6;
  const auto plan = planner.Plan(start, goal);
  ASSERT_TRUE(plan.has_value()) << planner.MainRefusal();
  EXPECT_EQ(plan->stances.back(), goal);
  for (std::size_t s = 1; s < plan->stances.size(); s += 2) EXPECT_GE(plan->stances[s].contacts.size(), 3U);
}

TEST_F(ManyLegs, TheReasonWhyThreeLegsDoNotWalkIsNamed) {
  const auto model = Robot(3);
  const SampledStances sampled = TwoStances(model);
  LeggedPlanner planner(model, std::make_shared<const GuideMap>(*model), {});
  ASSERT_FALSE(planner.Plan(sampled.stances.front(), sampled.stances.back()).has_value());
  EXPECT_THAT(planner.MainRefusal(), HasSubstr("centre of mass"));
}

}  // namespace
}  // namespace legopt::worldgen
