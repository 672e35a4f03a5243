// Policy: static equilibrium and torques decide by the physical rule only, on a robot whose torques are known by hand.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

#include "legopt/dataset/internal/dataset_content.h"
#include "legopt/judge/judge.h"
#include "tests/dataset/synthetic_dataset.h"
#include "tests/dataset/test_data.h"

namespace legopt {
namespace {

using ::testing::HasSubstr;

constexpr double kGravity_m_s2 = 9.797930195020351;

/// Replaces every occurrence in the text of a file.
void ReplaceAll(const std::filesystem::path& file, const std::string& from, const std::string& to) {
  std::ifstream in(file);
  std::string text(std::istreambuf_iterator<char>(in), {});
  for (std::size_t at = text.find(from); at != std::string::npos; at = text.find(from, at + to.size())) {
    text.replace(at, from.size(), to);
  }
  test::WriteText(file, text);
}

class PhysicalRule : public testing::Test {
 protected:
  PhysicalRule() : synthetic_(folder_.path()) {}

  void Replace(const std::string& file, const std::string& from, const std::string& to) {
    ReplaceAll(synthetic_.path() / file, from, to);
  }
  Evaluation Posture(const Eigen::VectorXd& x) const {
    WriteManifestHashes(synthetic_.path());
    const auto dataset = Dataset::Load(synthetic_.path());
    return Judge(dataset).Evaluate(Task::kPosture, dataset->problem(Task::kPosture, 0), {&x, 1});
  }

  test::TemporaryFolder folder_;
  test::SyntheticFolder synthetic_;
};

TEST_F(PhysicalRule, AcceptsWhatFrictionAndJointsHold) {
  Eigen::VectorXd x = test::StandingUpright();
  x[test::kRightShoulder] = 0.5;
  const Evaluation evaluation = Posture(x);
  EXPECT_EQ(evaluation.physical, Verdict::kSuccess) << evaluation.detail;
  EXPECT_EQ(evaluation.Largest(Verdict::kEquilibrium, Rule::kPhysical), 0.0);
  // The neck needs most: it carries 1 kg, of 100 N.
  EXPECT_NEAR(evaluation.Largest(Verdict::kTorque, Rule::kPhysical), 1.0 * kGravity_m_s2 / 100.0, 1e-9);
  EXPECT_TRUE(std::isnan(evaluation.Largest(Verdict::kTorque, Rule::kSolid))) << "no check of the other rules";
  EXPECT_EQ(evaluation.holding.postures, 1);
  EXPECT_EQ(evaluation.holding.without_equilibrium + evaluation.holding.over_torque, 0);
  EXPECT_EQ(evaluation.holding_halfway.postures, 0);
}

TEST_F(PhysicalRule, RefusesATorqueAboveTheEffortLimit) {
  Eigen::VectorXd x = test::StandingUpright();
  x[test::kRightShoulder] = 0.5;
  const double torque_Nm = 1.5 * kGravity_m_s2 * 0.2 * std::sin(0.5);
  const auto with_effort = [&](double effort_Nm) {
    const test::TemporaryFolder folder;
    const test::SyntheticFolder synthetic(folder.path());
    ReplaceAll(synthetic.path() / "robot.urdf", "lower='-0.6' upper='2' effort='100'",
               "lower='-0.6' upper='2' effort='" + std::to_string(effort_Nm) + "'");
    WriteManifestHashes(synthetic.path());
    const auto dataset = Dataset::Load(synthetic.path());
    return Judge(dataset).Evaluate(Task::kPosture, dataset->problem(Task::kPosture, 0), {&x, 1});
  };
  const Evaluation weak = with_effort(torque_Nm / 1.01);
  EXPECT_EQ(weak.solid, Verdict::kSuccess);
  EXPECT_EQ(weak.physical, Verdict::kTorque);
  EXPECT_THAT(weak.detail, HasSubstr("waypoint 0: by the physical rule, r_shoulder needs at least 101 % of its limit"));
  EXPECT_EQ(weak.holding.over_torque, 1);
  EXPECT_TRUE(std::isfinite(weak.cost)) << "the solution counts by the other rules";
  EXPECT_EQ(with_effort(torque_Nm * 1.0).physical, Verdict::kSuccess) << "within the tolerance of 0.1 %";
}

TEST_F(PhysicalRule, WithoutEffortLimitsOnlyEquilibriumCounts) {
  Replace("robot.urdf", "effort='100'", "effort='0'");
  const Evaluation evaluation = Posture(test::StandingUpright());
  EXPECT_EQ(evaluation.physical, Verdict::kSuccess);
  EXPECT_EQ(evaluation.Largest(Verdict::kTorque, Rule::kPhysical), 0.0);
}

TEST_F(PhysicalRule, CentreOfMassBesideThePolygon) {
  // Both feet lean on 0.2 m of ground; the polygon of level soles is the original evaluator's.
  const auto largest = [&](double angle_rad) {
    return Posture(test::Leaning(angle_rad)).Largest(Verdict::kEquilibrium, Rule::kPhysical);
  };
  EXPECT_EQ(largest(0.1), 0.0);
  const Evaluation fallen = Posture(test::Leaning(0.5));
  EXPECT_EQ(fallen.literal, Verdict::kCom);
  EXPECT_EQ(fallen.physical, Verdict::kCom) << "the first failure of a more lenient rule";
  EXPECT_EQ(fallen.holding.postures, 0) << "tested only if the original evaluator's checks of the posture pass";
}

TEST_F(PhysicalRule, SlipperySurfacesHoldNoTilt) {
  // Soles and targets tilted by 0.3 rad on ground tilted as well: friction 0.7 holds, 0.2 does not.
  const double angle = 0.3;
  Replace("scene.yaml", "{name: ground, shape: box, size: [20, 20, 0.5], position: [0, 0, -0.25]}",
          "{name: ground, shape: box, size: [20, 20, 0.5], position: [" + std::to_string(-0.25 * std::sin(angle)) +
              ", 0, " + std::to_string(-0.25 * std::cos(angle)) + "], rpy: [0, " + std::to_string(angle) + ", 0]}");
  const std::string turned = std::to_string(std::cos(angle / 2)) + " 0 " + std::to_string(std::sin(angle / 2)) + " 0";
  Replace("problems-posture.json", "l_foot,1 0 0 0 0 0.1 0 ,r_foot,1 0 0 0 0 -0.1 0",
          "l_foot," + turned + " 0 0.1 0 ,r_foot," + turned + " 0 -0.1 0");
  // The feet keep their poses on the slope while the legs stand upright.
  Eigen::VectorXd x = test::StandingUpright();
  x[test::kLeftAnkle] = x[test::kRightAnkle] = angle;
  x[test::kBaseX] = test::kSyntheticSoleOffset_m * std::sin(angle);
  x[test::kBaseX + 2] = test::kSyntheticLeg_m + test::kSyntheticSoleOffset_m * std::cos(angle);
  const Evaluation held = Posture(x);
  EXPECT_EQ(held.literal, Verdict::kSuccess) << held.detail;
  EXPECT_EQ(held.physical, Verdict::kSuccess) << held.detail;
  Replace("dataset.yaml", "format: legopt-dataset/1", "format: legopt-dataset/2");
  Replace("dataset.yaml", "feet: [l_foot, r_foot]\nsole_offset_m: 0.051\n",
          "contacts:\n  l_foot: {link: l_foot, kind: sole, frame: {position: [0, 0, -0.051]}, friction: 0.2}\n"
          "  r_foot: {link: r_foot, kind: sole, frame: {position: [0, 0, -0.051]}, friction: 0.2}\n");
  const Evaluation slides = Posture(x);
  EXPECT_EQ(slides.solid, Verdict::kSuccess) << slides.detail;
  EXPECT_EQ(slides.physical, Verdict::kEquilibrium);
  EXPECT_EQ(slides.holding.without_equilibrium, 1);
  EXPECT_THAT(slides.detail, HasSubstr("the robot slides along (0.9"));
}

TEST_F(PhysicalRule, CountsPosturesHalfWay) {
  // Both feet, the left foot alone, both feet: the centre of mass stays between the feet, so that the left foot alone
  // cannot hold it at any of its own waypoints, which the original evaluator refuses.
  const auto dataset = Dataset::Load(synthetic_.path());
  const ProblemDefinition& posed = dataset->problem(Task::kMotion, 0);
  const ProblemDefinition twice{.id = 1, .stances = {posed.stances[0], posed.stances[0]}};
  const std::vector<Eigen::VectorXd> still(4, test::StandingUpright());
  const Evaluation held = Judge(dataset).Evaluate(Task::kMotion, twice, still);
  EXPECT_EQ(held.physical, Verdict::kSuccess) << held.detail;
  EXPECT_EQ(held.holding.postures, 4);
  EXPECT_EQ(held.holding_halfway.postures, 3);
  EXPECT_EQ(held.holding_halfway.without_equilibrium, 0);
  // Without a contact in common, nothing holds the robot between two stances.
  ProblemDefinition apart = twice;
  apart.stances[0].contacts.resize(2);
  for (ContactTarget& target : apart.stances[1].contacts) target.position.x() += 1e-4;
  const Evaluation flies = Judge(dataset).Evaluate(Task::kMotion, apart, still);
  EXPECT_EQ(flies.literal, Verdict::kSuccess) << flies.detail;
  EXPECT_EQ(flies.holding_halfway.postures, 3);
  EXPECT_EQ(flies.holding_halfway.without_equilibrium, 1);
}

}  // namespace
}  // namespace legopt
