// Generation for robots with more than two feet, on the embedded quadruped and hexapod.
#include <gtest/gtest.h>

#include <algorithm>

#include "legopt/planning/certify/certificate.h"
#include "legopt/types/input_error.h"
#include "legopt/worldgen/internal/legged_planner.h"
#include "legopt/worldgen/internal/stance_sampler.h"
#include "tests/dataset/test_data.h"
#include "tests/folders.h"
#include "tests/worldgen/plain_dataset.h"

namespace legopt::worldgen {
namespace {

const std::vector<std::string> kNames = {"quadruped-garage", "quadruped-rubble", "hexapod-garage", "hexapod-rubble"};

std::shared_ptr<const Dataset> Embedded(const std::string& name) {
  return Dataset::Load(std::filesystem::path(SourceFolder()) / "data" / name);
}

std::shared_ptr<const ProbeModel> Model(const std::shared_ptr<const Dataset>& dataset) {
  return ProbeModel::Build(dataset, ProbeOptions::For(*dataset));
}

TEST(LeggedDatasets, EveryStanceHasAPosture) {
  for (const std::string& name : kNames) {
    const auto dataset = Embedded(name);
    EXPECT_EQ(dataset->problems(Task::kPosture).size(), 10u) << name;
    EXPECT_EQ(dataset->problems(Task::kMotion).size(), 2u) << name;
    const certify::StanceCatalogue catalogue(*dataset);
    const auto certificate =
        certify::ReadCertificate(dataset->folder() / certify::kCertificateFileName, catalogue, *dataset);
    certify::StanceCertifier certifier(dataset);
    for (size_t s = 0; s < catalogue.stances().size(); ++s) {
      ASSERT_TRUE(certificate.stances[s]) << name;
      ASSERT_EQ(certificate.stances[s]->feasibility, Feasibility::kCertified) << name << ' ' << s;
      EXPECT_TRUE(certifier.Accepts(catalogue.stances()[s], certificate.stances[s]->posture)) << name << ' ' << s;
    }
  }
}

TEST(LeggedGaits, FollowTheNumberOfLegs) {
  const ReachCloud four(*Embedded("quadruped-rubble"), 1);
  const std::vector<Gait> gaits = GaitsOf(four);
  ASSERT_EQ(gaits.size(), 2u);
  EXPECT_EQ(gaits[0].name, "trot");
  for (const std::vector<int>& phase : gaits[0].phases) {  // diagonal pairs
    ASSERT_EQ(phase.size(), 2u);
    EXPECT_LT(four.nominal(phase[0]).position.x() * four.nominal(phase[1]).position.x(), 0.0);
    EXPECT_LT(four.nominal(phase[0]).position.y() * four.nominal(phase[1]).position.y(), 0.0);
  }
  EXPECT_EQ(gaits[1].phases.size(), 4u);
  const std::vector<Gait> six = GaitsOf(ReachCloud(*Embedded("hexapod-rubble"), 1));
  EXPECT_EQ(six[0].name, "tripod");
  EXPECT_EQ(six[0].phases[0].size(), 3u);
}

TEST(LeggedReach, NominalPlacesAreInReachAndFarOnesAreNot) {
  const ReachCloud reach(*Embedded("quadruped-rubble"), 1);
  for (int c = 0; c < reach.num_contacts(); ++c) {
    EXPECT_TRUE(reach.Reaches(c, reach.nominal(c).position));
    EXPECT_FALSE(reach.Reaches(c, reach.nominal(c).position - Eigen::Vector3d(0, 0, 0.3)));
  }
  EXPECT_GT(reach.stride_m(), 0.02);
}

TEST(LeggedStances, AreTheSameForAnyNumberOfThreads) {
  const auto model = Model(Embedded("quadruped-rubble"));
  StanceSamplerOptions options;
  options.count = 5;
  const SampledStances one = SampleStances(model, options, {});
  options.threads = 2;
  EXPECT_EQ(one.stances, SampleStances(model, options, {}).stances);
  PostureProver prover(model->dataset);
  for (const Stance& stance : one.stances) {
    EXPECT_EQ(stance.contacts.size(), 4u);
    EXPECT_TRUE(prover.Prove(stance, 0).accepted);
  }
}

TEST(LeggedPlans, AlternateBetweenAllFeetAndThoseThatStand) {
  const auto dataset = Embedded("quadruped-rubble");
  const auto model = Model(dataset);
  LeggedPlanner planner(model, std::make_shared<const GuideMap>(*model), {});
  const std::vector<Stance>& known = dataset->problem(Task::kMotion, 0).stances;
  const auto plan = planner.Plan(known.front(), known.back());
  ASSERT_TRUE(plan.has_value());
  EXPECT_EQ(plan->stances.front(), known.front());
  EXPECT_EQ(plan->stances.back(), known.back());
  EXPECT_GE(plan->bound, 1.0);
  for (size_t s = 1; s < plan->stances.size(); s += 2) {
    const Stance& standing = plan->stances[s];
    EXPECT_LT(standing.contacts.size(), 4u);
    for (const Stance* all : {&plan->stances[s - 1], &plan->stances[s + 1]}) {
      ASSERT_EQ(all->contacts.size(), 4u);
      EXPECT_EQ(PlantedContacts(*dataset, standing, *all), standing);
    }
  }
  EXPECT_EQ(planner.Plan(known.front(), known.back())->stances, plan->stances) << "the cache changes nothing";
}

TEST(StanceRefusal, NamesTheFootThatCannotReachItsTarget) {
  const test::TemporaryFolder folder;
  const auto path = folder.path() / "turned";
  test::WritePlainDataset(path, test::kTwoLevels);
  // The contact frame of the right foot points to the ground: the foot would have to stand upside down.
  std::string text = test::ReadText(path / kDatasetFileName);
  const auto from = text.find("feet: "), to = text.find("gravity_m_s2");
  ASSERT_LT(from, to);
  text.replace(
      from, to - from,
      "contacts:\n"
      "  l_foot: {link: l_foot, kind: sole, frame: {position: [0, 0, -0.082351]}}\n"
      "  r_foot: {link: r_foot, kind: sole, frame: {position: [0, 0, 0.3], rpy: [3.141592653589793, 0, 0]}}\n");
  const std::string format = "legopt-dataset/1";
  text.replace(text.find(format), format.size(), "legopt-dataset/2");
  test::WriteText(path / kDatasetFileName, text);
  const auto model = Model(Dataset::Load(path));
  StanceSamplerOptions options;
  options.max_infeasible = 100;
  options.max_candidates = 20000;
  const std::string message = test::MessageOf([&] { SampleStances(model, options, {}); });
  EXPECT_NE(message.find("stances none has a posture: "), std::string::npos) << message;
  EXPECT_NE(message.find("foot_pose of r_foot"), std::string::npos) << message;
  EXPECT_NE(message.find("joint limits keep the feet of stance 1 off their common targets"), std::string::npos)
      << message;
  EXPECT_NE(message.find("check the contact frames and joint limits"), std::string::npos) << message;
}

TEST(StanceRefusal, GroundWithoutRoomForAFootIsNamed) {
  const test::TemporaryFolder folder;
  const auto path = folder.path() / "posts";
  test::WritePlainDataset(path, "objects:\n  - {name: post, shape: box, size: [0.05, 0.05, 1], position: [0, 0, 0]}\n");
  StanceSamplerOptions options;
  options.max_rejected = 500;
  const std::string message = test::MessageOf([&] { SampleStances(Model(Dataset::Load(path)), options, {}); });
  EXPECT_NE(message.find("no foot can stand on the ground"), std::string::npos) << message;
}

}  // namespace
}  // namespace legopt::worldgen
