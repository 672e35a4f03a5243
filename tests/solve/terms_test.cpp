// Every term of every program against central differences, by enumeration, on the LegOpt robot and on a synthetic one.

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "legopt/problem/initial_guess.h"
#include "legopt/problem/waypoint_program.h"
#include "tests/problem/synthetic_dataset.h"
#include "tests/problem/test_data.h"

namespace legopt {
namespace {

constexpr double kStep = 1e-6;
constexpr double kTolerance = 2e-6;  // rounding 1e-16 / step on values up to 20, plus h^2 times the third derivative
constexpr double kNoise_rad = 0.15;  // keeps clear of ties between parallel faces

/// Contacts are comparable when the same pairs are seen in the same order.
bool SamePairs(const std::vector<Contact>& a, const std::vector<Contact>& b) {
  if (a.size() != b.size()) return false;
  for (size_t i = 0; i < a.size(); ++i) {
    if (a[i].pair_id != b[i].pair_id) return false;
  }
  return true;
}

/// A contact whose nearest features change within the step has no derivative there.
bool SmoothContact(const Contact& centre, const Contact& moved) {
  constexpr double kFeatureJump = 1e-4;
  return (centre.normal_W - moved.normal_W).norm() < kFeatureJump &&
         (centre.point_a_W - moved.point_a_W).norm() < kFeatureJump;
}

class TermDerivatives {
 public:
  TermDerivatives(const Dataset& dataset, const Stance& stance, double range_m)
      : dataset_(dataset),
        query_(dataset.collision_model()),
        program_(WaypointProgram::Posture(dataset, query_, stance, {.margin_m = 5e-4, .range_m = range_m})) {}

  WaypointProgram& program() { return *program_; }
  int contacts_compared() const { return contacts_compared_; }

  void CheckAt(const Eigen::VectorXd& x) {
    const auto& terms = program_->terms();
    program_->SetPoint(x);
    centre_ = program_->state(0).contacts();
    for (size_t k = 0; k < terms.size(); ++k) {
      program_->SetPoint(x);
      LinearModel model;
      terms[k]->Linearize(model);
      std::vector<double> value;
      terms[k]->Evaluate(value);
      ASSERT_EQ(value.size(), static_cast<size_t>(model.rows())) << terms[k]->shape().name;
      for (int i = 0; i < model.rows(); ++i) EXPECT_EQ(model.value(i), value[static_cast<size_t>(i)]);
      CheckColumns(*terms[k], model, x);
    }
  }

 private:
  void CheckColumns(Term& term, const LinearModel& model, const Eigen::VectorXd& x) {
    const bool collision = term.shape().name == "collision";
    Eigen::VectorXd moved(x.size());
    for (int j = 0; j < program_->tangent_size(); ++j) {
      std::vector<double> side[2];
      std::vector<Contact> contacts[2];
      for (int s = 0; s < 2; ++s) {
        Eigen::VectorXd dx = Eigen::VectorXd::Zero(program_->tangent_size());
        dx[j] = s == 0 ? kStep : -kStep;
        legopt::Retract(dataset_.robot(), x, dx, moved);
        program_->SetPoint(moved);
        term.Evaluate(side[s]);
        contacts[s] = program_->state(0).contacts();
      }
      if (collision && (!SamePairs(centre_, contacts[0]) || !SamePairs(centre_, contacts[1]))) continue;
      for (int i = 0; i < model.rows(); ++i) {
        const auto r = static_cast<size_t>(i);
        if (collision && (!SmoothContact(centre_[r], contacts[0][r]) || !SmoothContact(centre_[r], contacts[1][r]))) {
          continue;
        }
        contacts_compared_ += collision ? 1 : 0;
        const double difference = (side[0][r] - side[1][r]) / (2 * kStep);
        EXPECT_NEAR(model.row(0, i)[j], difference, kTolerance * std::max(1.0, std::abs(difference)))
            << term.shape().name << " row " << i << " variable " << j;
      }
    }
  }

  const Dataset& dataset_;
  CollisionQuery query_;
  std::unique_ptr<WaypointProgram> program_;
  std::vector<Contact> centre_;
  int contacts_compared_ = 0;
};

void CheckDataset(const Dataset& dataset, int num_problems, double range_m, int min_contacts) {
  std::mt19937_64 generator(11);
  std::mt19937 noise(5);
  std::normal_distribution<double> normal;
  int compared = 0;
  for (int p = 0; p < num_problems; ++p) {
    const Stance& stance = dataset.problems(Task::kPosture)[static_cast<size_t>(p)].stances[0];
    TermDerivatives check(dataset, stance, range_m);
    for (const Initialization start : {Initialization::kGood, Initialization::kInCollision}) {
      Eigen::VectorXd x = InitialGuess(dataset, stance, start);
      PerturbJoints(dataset.robot(), generator, kNoise_rad, x);
      Eigen::VectorXd dx = Eigen::VectorXd::Zero(dataset.robot().tangent_size());
      for (int i = 0; i < 6; ++i) dx[dataset.robot().num_dofs() + i] = 0.05 * normal(noise);
      Eigen::VectorXd moved(x.size());
      legopt::Retract(dataset.robot(), x, dx, moved);
      check.CheckAt(moved);
    }
    compared += check.contacts_compared();
  }
  EXPECT_GE(compared, min_contacts) << "too few contacts to mean anything";
}

TEST(Terms, SyntheticRobotMeetsFiniteDifferences) {
  const test::TemporaryFolder temporary;
  const test::SyntheticFolder folder(temporary.path() / "dataset");
  CheckDataset(*Dataset::Load(folder.path()), 2, 0.5, 10);
}

TEST(Terms, AtlasMeetsFiniteDifferences) {
  LEGOPT_SKIP_WITHOUT_TEST_DATA();
  CheckDataset(*Dataset::Load(test::LegOptFolder()), 6, 0.05, 1000);
}

TEST(Terms, APostureInDoubleSupportHasFiveTerms) {
  const test::TemporaryFolder temporary;
  const test::SyntheticFolder folder(temporary.path() / "dataset");
  const auto dataset = Dataset::Load(folder.path());
  CollisionQuery query(dataset->collision_model());
  const auto program = WaypointProgram::Posture(*dataset, query, dataset->problems(Task::kPosture)[0].stances[0], {});
  EXPECT_EQ(program->terms().size(), 5u);  // reading 1
}

TEST(Terms, BoundsAreTheJointLimits) {
  const test::TemporaryFolder temporary;
  const test::SyntheticFolder folder(temporary.path() / "dataset");
  const auto dataset = Dataset::Load(folder.path());
  CollisionQuery query(dataset->collision_model());
  const auto program = WaypointProgram::Posture(*dataset, query, dataset->problems(Task::kPosture)[0].stances[0], {});
  const RobotModel& robot = dataset->robot();
  Eigen::VectorXd x = test::StandingUpright();
  x[test::kLeftHip] = 100.0;
  program->ProjectOnBounds(x);
  EXPECT_EQ(x[test::kLeftHip], robot.upper_limits()[test::kLeftHip]);
  Eigen::VectorXd lower(robot.tangent_size()), upper(robot.tangent_size());
  program->StepBounds(x, lower, upper);
  EXPECT_EQ(upper[test::kLeftHip], 0.0);
  EXPECT_EQ(upper[test::kLidar], std::numeric_limits<double>::infinity());
  EXPECT_EQ(upper[robot.num_dofs()], std::numeric_limits<double>::infinity());
  Eigen::VectorXd next(x.size());
  program->Retract(x, Eigen::VectorXd::Constant(robot.tangent_size(), 50.0), next);
  for (int i = 0; i < robot.num_dofs(); ++i) EXPECT_LE(next[i], robot.upper_limits()[i]);
}

}  // namespace
}  // namespace legopt
