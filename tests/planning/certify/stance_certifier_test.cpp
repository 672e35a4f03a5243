// Certification of one stance: a posture that the judge accepts, or the name of the obstacle.

#include "legopt/planning/certify/internal/stance_certifier.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "legopt/dataset/problem_definition.h"
#include "legopt/judge/judge.h"
#include "tests/dataset/synthetic_dataset.h"
#include "tests/dataset/test_data.h"

namespace legopt::certify {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

/// The embedded humanoid, a floating-base robot, in the small garage.
class StanceSearch : public testing::Test {
 protected:
  StanceSearch()
      : dataset_(Dataset::Load(SourceFolder() + "/data/garage-small")),
        certifier_(dataset_),
        level_(dataset_->problem(Task::kPosture, 0).stances.front()) {}

  /// Returns the level stance with its second foot moved.
  Stance WithSecondFootMoved(const Eigen::Vector3d& by) const {
    Stance stance = level_;
    stance.contacts[1].position += by;
    return stance;
  }

  std::shared_ptr<const Dataset> dataset_;
  StanceCertifier certifier_;
  Stance level_;
};

TEST_F(StanceSearch, FindsAPostureThatTheJudgeAccepts) {
  const auto found = certifier_.Search(level_, 0, 20, {});
  ASSERT_TRUE(found);
  Judge judge(dataset_);
  const Evaluation evaluation =
      judge.Evaluate(Task::kPosture, ProblemDefinition{.id = 0, .stances = {level_}}, std::span(&found->x, 1));
  EXPECT_EQ(evaluation.literal, Verdict::kSuccess) << evaluation.detail;
  EXPECT_EQ(evaluation.strict, Verdict::kSuccess) << evaluation.detail;
  for (const double value : found->x) {
    EXPECT_NEAR(value / StanceCertifier::kResolution, std::round(value / StanceCertifier::kResolution), 1e-4);
  }
}

// Every initial guess is independent of earlier searches.
TEST_F(StanceSearch, DependsOnStanceAndNumbersOnly) {
  for (int number = 0; number < 6; ++number) {
    StanceCertifier fresh(dataset_);
    const auto expected = fresh.Search(level_, number, number + 1, {});
    const auto found = certifier_.Search(level_, number, number + 1, {});
    ASSERT_EQ(found.has_value(), expected.has_value()) << number;
    if (found) {
      EXPECT_EQ(found->x, expected->x) << number;
      EXPECT_EQ(found->start, number);
    }
  }
}

TEST_F(StanceSearch, GoesOnFromPosturesThatAreGiven) {
  const auto found = certifier_.Search(level_, 0, 20, {});
  ASSERT_TRUE(found);
  const Stance moved = WithSecondFootMoved({0.03, 0.0, 0.0});
  EXPECT_FALSE(certifier_.Accepts(moved, found->x));
  const auto next = certifier_.SearchFrom(moved, std::span(&found->x, 1), {});
  ASSERT_TRUE(next);
  EXPECT_TRUE(certifier_.Accepts(moved, next->x));
}

TEST_F(StanceSearch, FeetTooFarApartAreNamed) {
  const Stance stance = WithSecondFootMoved({0.0, -3.0, 0.0});
  EXPECT_FALSE(certifier_.Search(stance, 0, 20, {}));
  const Obstruction obstruction = certifier_.Explain(stance, 10, {});
  EXPECT_TRUE(obstruction.without.empty());
  EXPECT_EQ(obstruction.Describe(), "feet and joint limits");
  EXPECT_THAT(obstruction.nearest, HasSubstr("foot"));
}

TEST_F(StanceSearch, OneFootInTheOtherIsNamed) {
  Stance stance = level_;
  stance.contacts[1].position = stance.contacts[0].position;
  stance.contacts[1].rotation = stance.contacts[0].rotation;
  EXPECT_FALSE(certifier_.Search(stance, 0, 20, {}));
  const Obstruction obstruction = certifier_.Explain(stance, 20, {});
  EXPECT_THAT(obstruction.without, ElementsAre(ElementsAre(ConstraintGroup::kSelf)));
  EXPECT_EQ(obstruction.Describe(), "without self");
}

TEST_F(StanceSearch, FeetBelowTheGroundAreNamed) {
  Stance stance = level_;
  for (ContactTarget& target : stance.contacts) target.position.z() -= 0.03;
  EXPECT_FALSE(certifier_.Search(stance, 0, 20, {}));
  EXPECT_THAT(certifier_.Explain(stance, 20, {}).without, ElementsAre(ElementsAre(ConstraintGroup::kEnvironment)));
}

TEST_F(StanceSearch, EndsWhenItIsAskedTo) {
  const Stance stance = WithSecondFootMoved({0.0, -3.0, 0.0});
  int asked = 0;
  const auto stop = [&asked] { return ++asked > 3; };
  EXPECT_FALSE(certifier_.Search(stance, 0, 1'000'000, stop));
  EXPECT_LT(asked, 20);
}

/// On a robot whose hips only pitch, no posture brings the centre of mass over one foot.
TEST(StanceSearchOfAStiffRobot, MissingBalanceIsNamed) {
  const test::TemporaryFolder temporary;
  const test::SyntheticFolder folder(temporary.path() / "dataset");
  StanceCertifier certifier(Dataset::Load(folder.path()));
  const auto dataset = Dataset::Load(folder.path());
  const Stance& left = dataset->problem(Task::kMotion, 0).stances[1];
  EXPECT_FALSE(certifier.Search(left, 0, 50, {}));
  const Obstruction obstruction = certifier.Explain(left, 50, {});
  EXPECT_THAT(obstruction.without, ElementsAre(ElementsAre(ConstraintGroup::kBalance)));
  EXPECT_THAT(obstruction.nearest, HasSubstr("l_foot"));
}

TEST_F(StanceSearch, ProgramsLackWhatIsLeftOutAndNothingElse) {
  using enum ConstraintGroup;
  CollisionQuery query(dataset_->collision_model());
  const auto names = [&](ConstraintGroups left_out) {
    StanceProgram program(*dataset_, query, level_, {}, left_out);
    std::vector<std::string> result;
    for (const auto& term : program.terms()) result.push_back(term->shape().name);
    return result;
  };
  const auto all = names({});
  ASSERT_EQ(all.size(), 4U);
  EXPECT_EQ(names({kSelf}), all);
  EXPECT_EQ(names({kEnvironment}), all);
  EXPECT_THAT(names({kBalance}), ElementsAre(all[0], all[1], all[3]));
  EXPECT_THAT(names({kSelf, kEnvironment}), ElementsAre(all[0], all[1], all[2]));
}

// Rows of the omitted half are satisfied everywhere and have zero gradient; the others are unchanged.
TEST_F(StanceSearch, HalfOfTheCollisionsAreLeftOutRowByRow) {
  CollisionQuery query(dataset_->collision_model());
  Eigen::VectorXd x = Eigen::VectorXd::Zero(dataset_->robot().configuration_size());
  x.segment<3>(dataset_->robot().num_dofs()) = level_.contacts[0].position + Eigen::Vector3d(0.0, 0.0, 0.5);
  x[dataset_->robot().num_dofs() + 3] = 1.0;
  const auto model_of = [&](ConstraintGroups left_out) {
    StanceProgram program(*dataset_, query, level_, {}, left_out);
    program.SetPoint(x);
    LinearModel model;
    program.terms().back()->Linearize(model);
    return model;
  };
  const LinearModel whole = model_of({});
  const LinearModel scene = model_of({ConstraintGroup::kSelf});
  const LinearModel self = model_of({ConstraintGroup::kEnvironment});
  ASSERT_GT(whole.rows(), 0);
  int of_scene = 0;
  for (int i = 0; i < whole.rows(); ++i) {
    const bool in_scene = scene.value(i) == whole.value(i);
    of_scene += in_scene ? 1 : 0;
    const LinearModel& kept = in_scene ? scene : self;
    const LinearModel& left_out = in_scene ? self : scene;
    EXPECT_EQ(kept.value(i), whole.value(i)) << i;
    EXPECT_LT(left_out.value(i), 0.0) << i;
    for (int c = 0; c < whole.stride(); ++c) {
      EXPECT_EQ(kept.row(0, i)[c], whole.row(0, i)[c]);
      EXPECT_EQ(left_out.row(0, i)[c], 0.0);
    }
  }
  EXPECT_GT(of_scene, 0);
  EXPECT_LT(of_scene, whole.rows());
}

}  // namespace
}  // namespace legopt::certify
