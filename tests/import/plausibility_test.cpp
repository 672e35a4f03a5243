// Policy: mixed-up units are reported with a remedy, a scene of kilometres takes neither much memory nor time, and
// meaningless values are refused. Valid datasets, including those of the repository, cause no message.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <sstream>

#include "app/isolated_call.h"
#include "legopt/dataset/internal/dataset_content.h"
#include "legopt/geometry/internal/terrain.h"
#include "legopt/import/importer.h"
#include "legopt/import/internal/dataset_check.h"
#include "legopt/types/input_error.h"
#include "tests/dataset/synthetic_dataset.h"
#include "tests/dataset/test_data.h"
#include "tests/folders.h"

namespace legopt {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;
using testing::IsEmpty;

std::string Words(const std::vector<DatasetDiagnostic>& findings) {
  std::string text;
  for (const DatasetDiagnostic& f : findings) {
    if (f.severity == DatasetDiagnostic::Severity::kInfo) continue;
    text += f.check + ": " + f.field + ": " + f.value + ": " + f.message + "; " + f.fix + "\n";
  }
  return text;
}

class Plausibility : public testing::Test {
 protected:
  Plausibility() : synthetic_(folder_.path() / "dataset") {}

  std::string WordsWith(const std::string& file, const std::string& from, const std::string& to) {
    test::ReplaceInFile(synthetic_.path() / file, from, to);
    WriteManifestHashes(synthetic_.path());
    return Words(CheckPlausibility(*Dataset::Load(synthetic_.path())));
  }
  std::string ErrorWith(const std::string& file, const std::string& from, const std::string& to) {
    test::ReplaceInFile(synthetic_.path() / file, from, to);
    return test::MessageOf([&] {
      WriteManifestHashes(synthetic_.path());
      Dataset::Load(synthetic_.path());
    });
  }

  test::TemporaryFolder folder_;
  test::SyntheticFolder synthetic_;
};

constexpr const char* kRobot = "robot.urdf";

TEST_F(Plausibility, ASoundRobotGetsNoWord) { EXPECT_EQ(WordsWith(kRobot, "tiny", "tiny"), ""); }

TEST_F(Plausibility, EffortsThatNoMotorHas) {
  const std::string words = WordsWith(kRobot, "effort='100'", "effort='1e5'");
  EXPECT_THAT(words, HasSubstr("efforts: "));
  EXPECT_THAT(words, HasSubstr("1e+05 N m"));
}

TEST_F(Plausibility, UnknownEffortsAreSaidWithoutAWarning) {
  test::ReplaceInFile(synthetic_.path() / kRobot, "effort='100'", "effort='0'");
  WriteManifestHashes(synthetic_.path());
  const std::vector<DatasetDiagnostic> findings = CheckPlausibility(*Dataset::Load(synthetic_.path()));
  EXPECT_EQ(Words(findings), "");
  ASSERT_EQ(findings.size(), 1u);
  EXPECT_EQ(findings[0].check, "efforts");
  EXPECT_THAT(findings[0].message, HasSubstr("no effort limit"));
}

TEST_F(Plausibility, LimitsInDegrees) {
  const std::string words = WordsWith(kRobot, "lower='-0.6' upper='2'", "lower='-35' upper='126'");
  EXPECT_THAT(words, HasSubstr("l_shoulder (-35 .. 126)"));
  EXPECT_THAT(words, HasSubstr("degrees"));
  EXPECT_THAT(words, HasSubstr("1.5708"));
}

TEST_F(Plausibility, ATurnOfAJointIsNoDegrees) {
  EXPECT_EQ(WordsWith(kRobot, "lower='-0.6' upper='2'", "lower='-6.28319' upper='6.28319'"), "");
}

TEST_F(Plausibility, ARobotInMillimetres) {
  const std::string words = WordsWith(kRobot, "0 0 -0.5", "0 0 -280");
  EXPECT_THAT(words, HasSubstr("units: robot: "));
  EXPECT_THAT(words, HasSubstr("millimetres"));
  EXPECT_THAT(words, HasSubstr("'l_ankle' is 280 m"));
}

TEST_F(Plausibility, ASceneInMillimetres) {
  const std::string words = WordsWith("scene.yaml", "size: [20, 20, 0.5]", "size: [2000, 2000, 0.5]");
  EXPECT_THAT(words, HasSubstr("units: scene: 2000 x 2000 x 2.5"));
  EXPECT_THAT(words, HasSubstr("millimetres"));
}

TEST_F(Plausibility, WhatIsTooFarForTheJudgeIsRefused) {
  EXPECT_THAT(ErrorWith("scene.yaml", "position: [5, 5, 1]", "position: [9000, 5, 1]"),
              AllOf(HasSubstr("scene object 'rock'"), HasSubstr("8192 m"), HasSubstr("millimetres")));
}

TEST_F(Plausibility, ANegativeMassIsRefused) {
  EXPECT_THAT(ErrorWith(kRobot, "<mass value='10'/>", "<mass value='-10'/>"),
              AllOf(HasSubstr("link 'trunk'"), HasSubstr("mass"), HasSubstr("-10"), HasSubstr("negative")));
}

TEST_F(Plausibility, ARobotWithoutMassIsRefused) {
  std::string xml = test::ReadText(synthetic_.path() / kRobot);
  for (std::size_t at = 0; (at = xml.find("<mass value='", at)) != std::string::npos; ++at) {
    const std::size_t from = at + std::string("<mass value='").size();
    xml.replace(from, xml.find('\'', from) - from, "0");
  }
  test::WriteText(synthetic_.path() / kRobot, xml);
  EXPECT_THAT(ErrorWith(kRobot, "tiny", "tiny"),
              AllOf(HasSubstr(kRobot), HasSubstr("no mass"), HasSubstr("<inertial>")));
}

TEST_F(Plausibility, ABodyWithoutMass) {
  EXPECT_THAT(WordsWith(kRobot, "<mass value='2'/>", "<mass value='0'/>"),
              AllOf(HasSubstr("l_leg"), HasSubstr("0 kg"), HasSubstr("<inertial>")));
}

TEST_F(Plausibility, InertiaThatNoBodyHas) {
  EXPECT_THAT(WordsWith(kRobot, "ixx='1' iyy='1' izz='1'", "ixx='-1' iyy='1' izz='1'"),
              AllOf(HasSubstr("trunk"), HasSubstr("not positive definite")));
  EXPECT_THAT(WordsWith(kRobot, "ixx='-1' iyy='1' izz='1'", "ixx='1' iyy='1' izz='2.1'"),
              AllOf(HasSubstr("trunk"), HasSubstr("principal moment")));
}

TEST_F(Plausibility, JointsWithoutAxisOrRange) {
  const std::string words = WordsWith(kRobot, "<axis xyz='0 1 0'/>", "");
  EXPECT_THAT(words, AllOf(HasSubstr("l_hip"), HasSubstr("<axis>"), HasSubstr("along, x")));
  EXPECT_THAT(WordsWith(kRobot, "lower='0' upper='0.1'", "lower='0' upper='0'"),
              AllOf(HasSubstr("neck (0 .. 0)"), HasSubstr("cannot move")));
}

class ShippedDataset : public testing::TestWithParam<std::string> {};

TEST_P(ShippedDataset, GetsNoWord) {
  const fs::path folder = GetParam();
  if (!fs::exists(folder)) GTEST_SKIP() << folder << " is not there";
  EXPECT_EQ(Words(CheckPlausibility(*Dataset::Load(folder))), "");
}

INSTANTIATE_TEST_SUITE_P(Import, ShippedDataset,
                         testing::Values(SourceFolder() + "/data/garage-small", SourceFolder() + "/data/garage-easier",
                                         TestDataFolder()));

// Writes the biped's workshop with its mesh enlarged by `factor`, as a folder to import.
fs::path Enlarged(const fs::path& folder, double factor) {
  fs::create_directories(folder);
  for (const char* file : {"robot.urdf", "problemsposture.json", "problemsmotion.json"}) {
    fs::copy(fs::path(SourceFolder() + "/data/biped") / file, folder / file);
  }
  std::ifstream source(SourceFolder() + "/data/biped/scene.obj");
  std::ofstream scene(folder / "scene.obj");
  for (std::string line; std::getline(source, line);) {
    std::istringstream words(line);
    std::string mark;
    double x = 0.0, y = 0.0, z = 0.0;
    if (line.starts_with("v ") && words >> mark >> x >> y >> z) {
      scene << "v " << factor * x << ' ' << factor * y << ' ' << factor * z << '\n';
    } else {
      scene << line << '\n';
    }
  }
  return folder;
}

ImportOptions FromEnlarged(const fs::path& source) {
  ImportOptions options;
  options.source = source;
  options.name = "enlarged";
  return options;
}

// Growing memory was the failure: the limits are a fifth of a machine that was exhausted.
TEST(SceneOfKilometres, TakesNeitherMemoryNorTimeToImport) {
  const test::TemporaryFolder folder;
  const fs::path source = Enlarged(folder.path() / "source", 1000.0);
  fs::create_directories(folder.path() / "out");
  const ReadLimits limits{.cpu_s = 60, .wall_s = 600, .memory_bytes = std::int64_t{500} << 20};
  std::string words;
  ASSERT_NO_THROW(
      words = CallIsolated([&] { return Words(ImportDataset(FromEnlarged(source), folder.path() / "out").findings); },
                           limits));
  EXPECT_THAT(words, HasSubstr("units: scene: "));
  EXPECT_THAT(words, HasSubstr("millimetres"));
}

TEST(SceneOfKilometres, BeyondWhatTheJudgeTellsApartIsRefused) {
  const test::TemporaryFolder folder;
  const fs::path source = Enlarged(folder.path() / "source", 1e5);
  fs::create_directories(folder.path() / "out");
  try {
    ImportDataset(FromEnlarged(source), folder.path() / "out");
    FAIL() << "accepted";
  } catch (const InputError& error) {
    EXPECT_EQ(error.fault().file, (source / "scene.obj").string());
    EXPECT_THAT(error.what(), HasSubstr("millimetres"));
  }
}

// A terrain's answers do not depend on the size and number of the squares of its index of triangles.
TEST(SceneOfKilometres, GroundIsFoundAsInASmallOne) {
  TriangleMesh mesh;
  mesh.vertices = {{-3000, -3000, 0}, {3000, -3000, 0}, {3000, 3000, 0}, {-3000, 3000, 0},
                   {10, 10, 1},       {12, 10, 1},      {10, 12, 1}};
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}, {4, 5, 6}};
  const Terrain terrain(mesh);
  std::vector<Terrain::Hit> hits;
  terrain.Ground(10.5, 10.7, -1.0, 2.0, hits);
  ASSERT_EQ(hits.size(), 2U);
  EXPECT_EQ(hits[0].triangle, 2);
  EXPECT_EQ(terrain.Highest(-2999.0, 2999.0, -1.0, 1.0).triangle, 1);
  EXPECT_EQ(terrain.Highest(11.9, 11.8, -1.0, 2.0).z_m, 0.0);
  EXPECT_EQ(terrain.Highest(3001.0, 0.0, -1.0, 1.0).triangle, -1);
}

}  // namespace
}  // namespace legopt
