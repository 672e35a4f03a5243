// Policy: small datasets of every family, whose promises are checked without the generator's own code where possible.
#include "legopt/worldgen/contact_dataset.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <set>
#include <string>

#include "legopt/dataset/contact.h"
#include "legopt/judge/judge.h"
#include "legopt/judge/solution_file.h"
#include "legopt/planning/certify/certificate.h"
#include "legopt/planning/certify/internal/balance_prover.h"
#include "legopt/statics/equilibrium_polygon.h"
#include "tests/dataset/test_data.h"
#include "tests/folders.h"

namespace legopt::worldgen {
namespace {

using ::testing::HasSubstr;

ContactDatasetOptions OptionsFor(const std::string& robot, int postures, int motions) {
  ContactDatasetOptions options;
  options.name = "stations";
  options.robot_folder = SourceFolder() + "/data/" + robot;
  options.postures = postures;
  options.motions = motions;
  options.traps = 3;
  options.threads = 2;
  return options;
}

std::vector<std::string> Column(const std::filesystem::path& csv, std::size_t column) {
  std::ifstream file(csv);
  std::string line;
  std::getline(file, line);
  std::vector<std::string> values;
  while (std::getline(file, line)) {
    for (std::size_t c = 0; c < column; ++c) line.erase(0, line.find(',') + 1);
    values.push_back(line.substr(0, line.find(',')));
  }
  return values;
}

/// Checks contact sequences: consecutive stances differ by one contact that is lifted or placed, and every planted
/// motion is balanced between its waypoints, too.
void CheckMotions(const std::filesystem::path& folder, const Dataset& dataset, Judge& judge) {
  const SolutionFile planted = ReadSolutions(folder / "solutions-motion.json");
  ASSERT_EQ(planted.problems.size(), dataset.problems(Task::kMotion).size());
  for (const SolvedProblem& problem : planted.problems) {
    const std::vector<Stance>& stances = problem.definition.stances;
    const std::size_t contacts = stances.front().contacts.size();
    ASSERT_EQ(stances.size() % (2 * contacts), 1u) << "every contact moves equally often";
    for (std::size_t s = 0; s < stances.size(); ++s) {
      EXPECT_EQ(stances[s].contacts.size(), contacts - s % 2);
      const Stance planted_contacts = PlantedContacts(dataset, stances[s], stances[s + 1 < stances.size() ? s + 1 : s]);
      EXPECT_GE(planted_contacts.contacts.size(), contacts - 1);
    }
    EXPECT_FALSE(stances.front() == stances.back()) << "the robot goes somewhere";
    const Evaluation evaluation =
        judge.Evaluate(Task::kBalanced, problem.definition, problem.solutions.at(0).waypoints);
    EXPECT_EQ(evaluation.physical, Verdict::kSuccess) << problem.definition.id << ": " << evaluation.detail;
  }
}

/// Checks planted postures, certificate and traps of a generated dataset.
void CheckPromises(const std::filesystem::path& folder, std::size_t postures) {
  const auto dataset = Dataset::Load(folder);
  ASSERT_EQ(dataset->problems(Task::kPosture).size(), postures);
  const SolutionFile planted = ReadSolutions(folder / "solutions-posture.json");
  ASSERT_EQ(planted.problems.size(), postures);
  Judge judge(dataset);
  for (const SolvedProblem& problem : planted.problems) {
    const Evaluation evaluation = judge.Evaluate(Task::kPosture, problem.definition, problem.solutions.at(0).waypoints);
    EXPECT_EQ(evaluation.physical, Verdict::kSuccess) << problem.definition.id << ": " << evaluation.detail;
  }
  if (!dataset->problems(Task::kMotion).empty()) CheckMotions(folder, *dataset, judge);
  const certify::ProblemFeasibility feasibility =
      certify::ReadProblemFeasibility(folder / certify::kCertificateFileName);
  for (const auto& [id, state] : feasibility.problems[Task::kPosture]) EXPECT_EQ(state, Feasibility::kCertified) << id;

  const auto traps = Dataset::Load(folder / "traps");
  std::ifstream file(folder / "traps" / "proofs.json");
  const nlohmann::json proofs = nlohmann::json::parse(file)["proofs"];
  ASSERT_EQ(proofs.size(), 3u);
  ASSERT_EQ(traps->problems(Task::kPosture).size(), 3u);
  for (std::size_t i = 0; i < 3; ++i) {
    const StanceForces forces(SurfacesOf(*traps, traps->problems(Task::kPosture)[i].stances[0]),
                              FrictionPyramid::kCircumscribed);
    const auto u = proofs[i]["direction"];
    const SlideProof checked = CheckedProof(forces, Eigen::Vector3d(u[0], u[1], u[2]), proofs[i]["turn"]);
    EXPECT_GE(checked.margin, kProofMargin);
    EXPECT_LE(checked.largest, 1e-9) << "with 0.02 less friction than that of the proof";
  }
}

TEST(ContactDataset, AHumanoidGetsSlidesReachesAndClimbs) {
  const test::TemporaryFolder folder;
  const ContactDatasetReport report = BuildContactDataset(OptionsFor("hands-small", 9, 0), folder.path(), {});
  EXPECT_EQ(report.histograms.at(0).histograms.size(), 6u);
  CheckPromises(folder.path(), 9);
  const std::vector<std::string> families = Column(folder.path() / "features.csv", 1);
  EXPECT_EQ(std::set<std::string>(families.begin(), families.end()),
            (std::set<std::string>{"slide", "reach", "climb"}));
  const std::vector<std::string> alone = Column(folder.path() / "features.csv", 3);
  const auto dataset = Dataset::Load(folder.path());
  for (std::size_t i = 0; i < families.size(); ++i) {
    EXPECT_EQ(alone[i], families[i] == "climb" ? "open" : families[i] + " proven");
    Stance feet = dataset->problems(Task::kPosture)[i].stances[0];
    for (ContactTarget& target : feet.contacts) target.carries = dataset->contact(target.contact).facts().supports;
    const EquilibriumPolygon polygon = ComputeEquilibriumPolygon(StanceForces(SurfacesOf(*dataset, feet)));
    EXPECT_EQ(polygon.corners.empty(), families[i] == "slide") << i;
    EXPECT_TRUE(families[i] != "reach" || certify::RefuteBalance(*dataset, feet)) << i;
  }
}

TEST(ContactDataset, AQuadrupedGetsRubbleAndTheSameBitsAgain) {
  const test::TemporaryFolder folder, again;
  const std::string hash = BuildContactDataset(OptionsFor("quadruped-rubble", 3, 3), folder.path(), {}).content_hash;
  CheckPromises(folder.path(), 3);
  ContactDatasetOptions options = OptionsFor("quadruped-rubble", 3, 3);
  options.threads = 1;
  EXPECT_EQ(BuildContactDataset(options, again.path(), {}).content_hash, hash);
  for (const char* file :
       {"features.csv", "solutions-posture.json", "solutions-motion.json", "certificate.json", "traps/proofs.json"}) {
    EXPECT_EQ(test::ReadText(folder.path() / file), test::ReadText(again.path() / file)) << file;
  }
}

// Making motions with hands takes minutes; the embedded ones are the generator's.
TEST(ContactDataset, EmbeddedMotionsAreBalanced) {
  for (const char* name : {"contacts-humanoid", "contacts-quadruped"}) {
    SCOPED_TRACE(name);
    const std::filesystem::path folder = SourceFolder() + "/data/" + name;
    const auto dataset = Dataset::Load(folder);
    Judge judge(dataset);
    CheckMotions(folder, *dataset, judge);
  }
}

TEST(ContactDataset, ARobotWithoutHandsOnTwoFeetIsRefused) {
  const test::TemporaryFolder folder;
  EXPECT_THAT(test::MessageOf([&] { BuildContactDataset(OptionsFor("garage-small", 3, 0), folder.path(), {}); }),
              HasSubstr("contacts: the robot has neither hands nor more than two feet; declare contacts of kind palm"));
}

}  // namespace
}  // namespace legopt::worldgen
