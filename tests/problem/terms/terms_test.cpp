// Every term of every program compared with central differences, by enumeration, on the LegOpt robot and on a
// synthetic one.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <map>
#include <memory>
#include <random>
#include <set>
#include <span>
#include <string>

#include "legopt/dataset/internal/dataset_content.h"
#include "legopt/problem/terms/initial_guess.h"
#include "legopt/problem/terms/internal/waypoint_terms.h"
#include "legopt/problem/terms/task_program.h"
#include "tests/dataset/synthetic_dataset.h"
#include "tests/dataset/test_data.h"
#include "tests/problem/terms/term_derivatives.h"

namespace legopt {
namespace {

constexpr double kNoise_rad = 0.15;  // avoids ties between parallel faces

/// A random waypoint near the initial guess of a stance.
class NoisyStart {
 public:
  explicit NoisyStart(const Dataset& dataset) : dataset_(dataset) {}

  Eigen::VectorXd operator()(const Stance& stance, Initialization start) {
    Eigen::VectorXd x = InitialGuess(dataset_, stance, start);
    PerturbJoints(dataset_.robot(), generator_, kNoise_rad, x);
    Eigen::VectorXd dx = Eigen::VectorXd::Zero(dataset_.robot().tangent_size());
    for (int i = 0; i < 6; ++i) dx[dataset_.robot().num_dofs() + i] = 0.05 * normal_(noise_);
    Eigen::VectorXd moved(x.size());
    legopt::Retract(x, dx, moved);
    return moved;
  }

 private:
  const Dataset& dataset_;
  std::mt19937_64 generator_{11};
  std::mt19937 noise_{5};
  std::normal_distribution<double> normal_;
};

void CheckPostures(const Dataset& dataset, int num_problems, double range_m, int min_contacts) {
  CollisionQuery query(dataset.collision_model());
  NoisyStart noisy(dataset);
  int compared = 0;
  for (int p = 0; p < num_problems; ++p) {
    const Stance& stance = dataset.problems(Task::kPosture)[static_cast<size_t>(p)].stances[0];
    const auto program =
        MakeTaskProgram(Task::kPosture, dataset, query, {&stance, 1}, {.margin_m = 5e-4, .range_m = range_m});
    TermDerivatives check(*program);
    for (const Initialization start : {Initialization::kGood, Initialization::kInCollision}) {
      check.CheckAt(noisy(stance, start));
    }
    compared += check.contacts_compared();
  }
  EXPECT_GE(compared, min_contacts) << "too few contacts to mean anything";
}

void CheckWindow(const Dataset& dataset, double range_m) {
  CollisionQuery query(dataset.collision_model());
  NoisyStart noisy(dataset);
  const std::vector<Stance>& all = dataset.problems(Task::kMotion)[0].stances;
  const std::span<const Stance> stances = std::span(all).first(2);
  const auto program = MakeTaskProgram(Task::kMotion, dataset, query, stances, {.margin_m = 5e-4, .range_m = range_m});
  const Eigen::Index size = program->point_size();
  Eigen::VectorXd x(program->num_waypoints() * size);
  for (int t = 0; t < program->num_waypoints(); ++t) {
    x.segment(t * size, size) =
        noisy(stances[static_cast<size_t>(StanceOfWaypoint(Task::kMotion, t))], Initialization::kInCollision);
  }
  TermDerivatives(*program).CheckAt(x);
}

TEST(Terms, SyntheticRobotMeetsFiniteDifferences) {
  const test::TemporaryFolder temporary;
  const test::SyntheticFolder folder(temporary.path() / "dataset");
  const auto dataset = Dataset::Load(folder.path());
  CheckPostures(*dataset, 2, 0.5, 10);
  CheckWindow(*dataset, 0.5);
}

TEST(Terms, PointContactsMeetFiniteDifferences) {
  const test::TemporaryFolder temporary;
  const test::SyntheticFolder folder(temporary.path() / "dataset");
  const auto yaml = folder.path() / "dataset.yaml";
  test::ReplaceInFile(yaml, "legopt-dataset/1", "legopt-dataset/2");
  test::ReplaceInFile(yaml, "feet: [l_foot, r_foot]\nsole_offset_m: 0.051\n",
                      "contacts:\n  l_foot: {link: l_foot, kind: point, frame: {position: [0.1, 0, -0.05]}, radius_m: "
                      "0.01}\n  r_foot: {link: r_foot, kind: sole, frame: {position: [0, 0, -0.051]}}\n");
  const auto dataset = Dataset::Load(folder.path());
  CheckPostures(*dataset, 2, 0.5, 10);
  CollisionQuery query(dataset->collision_model());
  const auto program =
      MakeTaskProgram(Task::kPosture, *dataset, query, dataset->problems(Task::kPosture)[0].stances, {});
  std::vector<double> rows;
  program->SetPoint(test::StandingUpright());
  program->terms()[1]->Evaluate(rows);
  EXPECT_EQ(program->terms()[1]->shape().name, "foot l_foot");
  EXPECT_EQ(rows.size(), 3U);
}

/// The synthetic robot with a palm on its left arm and a grip on its right one, and a problem that uses both.
std::shared_ptr<const Dataset> WithHands(const std::filesystem::path& folder, const std::string& load) {
  const auto yaml = folder / "dataset.yaml";
  test::ReplaceInFile(yaml, "legopt-dataset/1", "legopt-dataset/2");
  test::ReplaceInFile(
      yaml, "feet: [l_foot, r_foot]\nsole_offset_m: 0.051\n",
      "contacts:\n  l_foot: {link: l_foot, kind: sole, frame: {position: [0, 0, -0.051]}}\n  r_foot: {link: r_foot, "
      "kind: sole, frame: {position: [0, 0, -0.051]}}\n  palm: {link: l_arm, kind: palm, frame: {position: [0, 0.03, "
      "-0.35], rpy: [0.3, 0.4, 0.5]}, points: [[0.02, 0.02, 0], [-0.02, 0.02, 0], [0, -0.02, 0]]}\n  grip: {link: "
      "r_arm, kind: rail, frame: {position: [0.01, -0.06, -0.4], rpy: "
      "[-0.2, 0.3, 0.1]}, points: [[0.03, 0, 0], [-0.03, 0, 0]], max_force_N: 200, slide_m: 0.1}\n");
  test::WriteText(folder / "problems-posture.json",
                  R"({"task": "posture", "problems": [{"id": 0, "definition": [{"contacts": )"
                  R"("l_foot,1 0 0 0 0 0.1 0 ,r_foot,1 0 0 0 0 -0.1 0 ,palm,0.6 0.8 0 0 0.1 0.4 0.5 ,)"
                  R"(grip,0.8 0 0.6 0 0.1 -0.3 0.6 ,", "load": {"grip": ")" +
                      load + R"("}}]}]})");
  WriteManifestHashes(folder);
  return Dataset::Load(folder);
}

TEST(Terms, HandsMeetFiniteDifferences) {
  for (const std::string load : {"touch", "carry"}) {
    const test::TemporaryFolder temporary;
    const test::SyntheticFolder folder(temporary.path() / "dataset");
    const auto dataset = WithHands(folder.path(), load);
    CheckPostures(*dataset, 1, 0.5, 5);
    CollisionQuery query(dataset->collision_model());
    const auto program =
        MakeTaskProgram(Task::kPosture, *dataset, query, dataset->problems(Task::kPosture)[0].stances, {});
    program->SetPoint(test::StandingUpright());
    std::map<std::string, std::size_t> rows;
    for (const auto& term : program->terms()) {
      std::vector<double> values;
      term->Evaluate(values);
      rows[term->shape().name] = values.size();
    }
    EXPECT_EQ(rows["contact palm"], 5u) << "turns about its normal";
    EXPECT_EQ(rows["contact grip"], load == "touch" ? 4u : 5u) << "slides along the bar, unless it carries";
    EXPECT_EQ(rows["slide of grip"], load == "touch" ? 2u : 0u);
  }
}

TEST(Terms, AtlasMeetsFiniteDifferences) {
  LEGOPT_SKIP_WITHOUT_TEST_DATA();
  const auto dataset = Dataset::Load(test::LegOptFolder());
  CheckPostures(*dataset, 6, 0.05, 1000);
  CheckWindow(*dataset, 0.05);
}

TEST(Terms, APostureInDoubleSupportHasFiveTerms) {
  const test::TemporaryFolder temporary;
  const test::SyntheticFolder folder(temporary.path() / "dataset");
  const auto dataset = Dataset::Load(folder.path());
  CollisionQuery query(dataset->collision_model());
  const auto program =
      MakeTaskProgram(Task::kPosture, *dataset, query, dataset->problems(Task::kPosture)[0].stances, {});
  EXPECT_EQ(program->terms().size(), 5u);  // docs/explanation/paper.md#terms-and-samples
}

TEST(Terms, AFullWindowHasTheUnitsOfTheReference) {
  LEGOPT_SKIP_WITHOUT_TEST_DATA();
  const auto dataset = Dataset::Load(test::LegOptFolder());
  CollisionQuery query(dataset->collision_model());
  const std::vector<Stance>& stances = dataset->problems(Task::kMotion)[0].stances;
  const auto program = MakeTaskProgram(Task::kMotion, *dataset, query, std::span(stances).first(6), {});
  int alone = 0;
  std::set<int> shared;
  for (const auto& term : program->terms()) {
    if (term->shape().unit < 0) {
      ++alone;
    } else {
      shared.insert(term->shape().unit);
    }
  }
  // Foot poses, centres of mass, collision terms, continuous collision; one velocity cost: 54 in all.
  EXPECT_EQ(alone, 18 + 12 + 12 + 11);
  EXPECT_EQ(shared.size(), 1u);
}

TEST(Terms, ASolutionCostsItsTransitionsOnceOrItsWindows) {
  const test::TemporaryFolder temporary;
  const test::SyntheticFolder folder(temporary.path() / "dataset");
  const auto dataset = Dataset::Load(folder.path());
  std::vector<Eigen::VectorXd> waypoints(3, test::StandingUpright());
  waypoints[1][test::kLeftHip] += 0.5;
  constexpr double kWindowCosts = 12.5;
  EXPECT_EQ(SolutionCost(Task::kPosture, dataset->robot(), waypoints, kWindowCosts), kWindowCosts);
  EXPECT_NEAR(SolutionCost(Task::kMotion, dataset->robot(), waypoints, kWindowCosts), 0.5, 1e-15);
}

// Collision terms at the waypoints and between them.
TEST(Terms, DisabledTermsHaveNoRows) {
  const test::TemporaryFolder temporary;
  const test::SyntheticFolder folder(temporary.path() / "dataset");
  const auto dataset = Dataset::Load(folder.path());
  CollisionQuery query(dataset->collision_model());
  const std::vector<Stance>& stances = dataset->problems(Task::kMotion)[0].stances;
  const auto program = MakeTaskProgram(Task::kMotion, *dataset, query, stances, {});
  Eigen::VectorXd low = test::StandingUpright();
  Eigen::VectorXd next = low;
  low[dataset->robot().num_dofs() + 2] -= 0.3;  // below the ground
  next[dataset->robot().num_dofs()] += 0.3;
  Eigen::VectorXd x(program->num_waypoints() * low.size());
  for (int t = 0; t < program->num_waypoints(); ++t) x.segment(t * low.size(), low.size()) = t % 2 == 0 ? low : next;
  program->SetPoint(x);
  const auto rows_of = [](Term& term) {
    std::vector<double> rows;
    term.Evaluate(rows);
    return rows;
  };
  std::set<std::string> aside;
  for (const auto& term : program->terms()) {
    const std::vector<double> before = rows_of(*term);
    const std::int64_t queries = query.queries();
    if (term->SetDisabled(true)) {
      aside.insert(term->shape().name);
      LinearModel model;
      std::vector<int> keys;
      term->Linearize(model);
      term->RowKeys(0, keys);
      EXPECT_EQ(rows_of(*term).size() + static_cast<size_t>(model.rows()) + keys.size(), 0u) << term->shape().name;
      EXPECT_EQ(query.queries(), queries);
    } else {
      EXPECT_EQ(rows_of(*term), before) << term->shape().name;
    }
    term->SetDisabled(false);
    EXPECT_EQ(rows_of(*term), before) << term->shape().name;
    if (term->shape().name == "collision" && term->shape().waypoint == 0) {
      EXPECT_FALSE(before.empty());
    }
  }
  EXPECT_EQ(aside, (std::set<std::string>{"collision", "swept collision"}));
}

// Feet relax their margin completely at once, since the judge checks the same numbers; collisions relax theirs by
// shares. Terms of fixed waypoints have no margin.
TEST(Terms, FeetAndCollisionsHaveMargins) {
  const test::TemporaryFolder temporary;
  const test::SyntheticFolder folder(temporary.path() / "dataset");
  const auto dataset = Dataset::Load(folder.path());
  CollisionQuery query(dataset->collision_model());
  const ProgramOptions contacts{.margin_m = 1e-3, .relaxed_margin_m = -2e-3, .range_m = 0.5};
  const auto program =
      MakeTaskProgram(Task::kMotion, *dataset, query, dataset->problems(Task::kMotion)[0].stances, contacts, true);
  const Eigen::VectorXd x = test::StandingUpright().replicate(program->num_waypoints(), 1);
  program->SetPoint(x);
  std::set<std::string> with_reserve;
  for (const auto& term : program->terms()) {
    std::vector<double> kept, spent;
    term->Evaluate(kept);
    const bool fixed = term->shape().waypoint == 0 && term->shape().num_waypoints == 1;
    for (const double share : {0.5, 1.0, 0.0}) {
      const bool any = term->RelaxMargin(share);
      spent.clear();
      term->Evaluate(spent);
      if (any) with_reserve.insert(term->shape().name);
      ASSERT_EQ(spent.size(), kept.size());
      for (size_t i = 0; i < kept.size(); ++i) {
        const double in_use = any && !fixed ? share : 0.0;
        const double foot = in_use > 0.0 ? ContactPoseTerm::kRelaxedWeight * kept[i] : kept[i];
        const double expected = term->shape().kind == TermKind::kEquality ? foot : kept[i] - 3e-3 * in_use;
        EXPECT_NEAR(spent[i], expected, 1e-15) << term->shape().name << " of waypoint " << term->shape().waypoint;
      }
    }
  }
  for (const auto& term : program->terms()) term->RelaxMargin(0.5);
  TermDerivatives(*program).CheckAt(x);
  EXPECT_TRUE(with_reserve.contains("collision"));
  EXPECT_GE(with_reserve.size(), 2u);
}

TEST(Terms, TheFirstWaypointOfALaterWindowStays) {
  const test::TemporaryFolder temporary;
  const test::SyntheticFolder folder(temporary.path() / "dataset");
  const auto dataset = Dataset::Load(folder.path());
  CollisionQuery query(dataset->collision_model());
  const std::vector<Stance>& stances = dataset->problems(Task::kMotion)[0].stances;
  const auto program = MakeTaskProgram(Task::kMotion, *dataset, query, stances, {}, true);
  Eigen::VectorXd first = test::StandingUpright();
  first[test::kLeftHip] = 100.0;  // it is not even moved by limits
  const Eigen::VectorXd x = first.replicate(program->num_waypoints(), 1);
  Eigen::VectorXd dx = Eigen::VectorXd::Ones(program->num_waypoints() * program->tangent_size());
  Eigen::VectorXd moved(x.size()), lower(dx.size()), upper(dx.size());
  program->Retract(x, dx, moved);
  EXPECT_EQ(moved.head(first.size()), first);
  EXPECT_NE(moved.segment(first.size(), first.size()), first);
  program->StepBounds(x, lower, upper);
  EXPECT_EQ(lower.head(program->tangent_size()).norm(), 0.0);
  EXPECT_EQ(upper.head(program->tangent_size()).norm(), 0.0);
}

TEST(Terms, BoundsAreTheJointLimits) {
  const test::TemporaryFolder temporary;
  const test::SyntheticFolder folder(temporary.path() / "dataset");
  const auto dataset = Dataset::Load(folder.path());
  CollisionQuery query(dataset->collision_model());
  const auto program =
      MakeTaskProgram(Task::kPosture, *dataset, query, dataset->problems(Task::kPosture)[0].stances, {});
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
