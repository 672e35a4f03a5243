// A fixed structure for a varying number of rows, and derivatives through the retraction.

#include "legopt/solvers/internal/slotted_program.h"

#include <gtest/gtest.h>

#include "legopt/problem/terms/initial_guess.h"
#include "legopt/problem/terms/task_program.h"
#include "tests/dataset/synthetic_dataset.h"
#include "tests/dataset/test_data.h"

namespace legopt {
namespace {

using Eigen::VectorXd;

class Slots : public ::testing::Test {
 protected:
  Slots()
      : folder_(temporary_.path() / "dataset"),
        dataset_(Dataset::Load(folder_.path())),
        query_(dataset_->collision_model()),
        program_(MakeTaskProgram(Task::kPosture, *dataset_, query_, {&stance(), 1}, {})) {
    slotted_.Reset(*program_);
  }

  const Stance& stance() const { return dataset_->problem(Task::kPosture, 0).stances.front(); }
  VectorXd Start(Initialization initialization) const { return InitialGuess(*dataset_, stance(), initialization); }

  std::vector<double> ValuesAt(const VectorXd& dx, double& cost) {
    EXPECT_TRUE(slotted_.Evaluate(dx.data()));
    cost = slotted_.cost().constant();
    return slotted_.row_values();
  }

  test::TemporaryFolder temporary_;
  test::SyntheticFolder folder_;
  std::shared_ptr<const Dataset> dataset_;
  CollisionQuery query_;
  std::unique_ptr<WaypointProgram> program_;
  SlottedProgram slotted_;
};

TEST_F(Slots, DerivativesAreByTheStepFromTheBasePoint) {
  constexpr double kStep = 1e-6;
  constexpr double kTolerance = 2e-6;  // central differences, entries of order one
  // Far from contacts, whose normals jump, and rotated far enough that the retraction is nonlinear.
  slotted_.Rebase(Start(Initialization::kGood));
  const int n = slotted_.num_variables();
  VectorXd dx = VectorXd::Constant(n, 0.02);
  dx[test::kNeck] = 0.5 * (slotted_.lower()[test::kNeck] + slotted_.upper()[test::kNeck]);  // away from its limits
  dx.tail(3) << 0.5, -0.7, 0.4;
  ASSERT_TRUE(slotted_.Evaluate(dx.data()));
  const std::vector<double> jacobian = slotted_.jacobian();
  const auto gradient = slotted_.cost().gradient();
  for (int j = 0; j < n; ++j) {
    VectorXd ahead = dx, back = dx;
    ahead[j] += kStep;
    back[j] -= kStep;
    double cost_ahead = 0.0, cost_back = 0.0;
    const std::vector<double> above = ValuesAt(ahead, cost_ahead);
    const std::vector<double> below = ValuesAt(back, cost_back);
    EXPECT_NEAR(gradient[static_cast<size_t>(j)], (cost_ahead - cost_back) / (2 * kStep), 1e-4) << j;
    for (size_t i = 0; i < slotted_.rows().size(); ++i) {
      const SlottedProgram::Row& row = slotted_.rows()[i];
      EXPECT_NEAR(jacobian[row.begin + static_cast<size_t>(j)], (above[i] - below[i]) / (2 * kStep), kTolerance)
          << "row " << i << " variable " << j;
    }
  }
}

TEST_F(Slots, EveryViolationIsSeenWhicheverSlotsExist) {
  slotted_.Rebase(Start(Initialization::kGood));  // nothing near: no slots for contacts
  const size_t rows = slotted_.rows().size();
  VectorXd down = VectorXd::Zero(slotted_.num_variables());
  down[test::kSyntheticDofs + 2] = -0.3;
  ASSERT_TRUE(slotted_.Evaluate(down.data()));
  double worst = 0.0;
  for (size_t i = 0; i < rows; ++i) {
    const double v = slotted_.row_values()[i];
    worst = std::max(worst, slotted_.rows()[i].kind == TermKind::kEquality ? std::abs(v) : v);
  }
  EXPECT_EQ(worst, slotted_.value().max_violation);
  EXPECT_TRUE(slotted_.SharedSlotActive(1e-4));

  const VectorXd there = slotted_.x();
  EXPECT_TRUE(slotted_.Rebase(there));
  EXPECT_GT(slotted_.rows().size(), rows);
  ASSERT_TRUE(slotted_.Evaluate(VectorXd::Zero(slotted_.num_variables()).eval().data()));
  EXPECT_FALSE(slotted_.SharedSlotActive(1e-4));
  EXPECT_FALSE(slotted_.Rebase(there)) << "nothing new at the same point";
}

TEST_F(Slots, AbsentRowsRestWhereTheyLeave) {
  slotted_.Rebase(Start(Initialization::kInCollision));
  VectorXd up = VectorXd::Zero(slotted_.num_variables());
  up[test::kSyntheticDofs + 2] = 1.0;
  ASSERT_TRUE(slotted_.Evaluate(up.data()));
  const double absent = program_->terms().back()->AbsentRow();
  EXPECT_NEAR(absent, ProgramOptions{}.margin_m - ProgramOptions{}.range_m, 1e-12);
  EXPECT_EQ(slotted_.row_values().back(), absent);
}

}  // namespace
}  // namespace legopt
