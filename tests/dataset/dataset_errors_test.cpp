#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "app/isolated_call.h"
#include "legopt/dataset/dataset.h"
#include "legopt/dataset/internal/dataset_content.h"
#include "legopt/math/blake2b.h"
#include "tests/dataset/synthetic_dataset.h"
#include "tests/dataset/test_data.h"

namespace legopt {
namespace {

namespace fs = std::filesystem;
using test::MessageOf;
using test::ReplaceInFile;
using test::WriteText;
using ::testing::AllOf;
using ::testing::HasSubstr;

/// One error per test case in an otherwise valid dataset.
class DatasetErrorsTest : public testing::Test {
 protected:
  DatasetErrorsTest() { test::SyntheticFolder{folder_.path()}; }

  std::string LoadMessage() {
    return MessageOf([&] { Dataset::Load(folder_.path(), CallIsolated); });
  }
  /// Changes dataset.yaml and loads.
  std::string AfterYaml(const std::string& from, const std::string& to) {
    ReplaceInFile(folder_.path() / "dataset.yaml", from, to);
    return LoadMessage();
  }
  /// Changes another file, updates the hashes if the files can be read, and loads.
  std::string AfterFile(const std::string& file, const std::string& from, const std::string& to) {
    ReplaceInFile(folder_.path() / file, from, to);
    WriteManifestHashes(folder_.path(), CallIsolated);
    return LoadMessage();
  }
  test::TemporaryFolder folder_;
};

TEST_F(DatasetErrorsTest, FolderMissingOrEmpty) {
  EXPECT_THAT(MessageOf([] { Dataset::Load("/nonexistent/folder"); }),
              AllOf(HasSubstr("/nonexistent/folder"), HasSubstr("does not exist"), HasSubstr("dataset.yaml")));
  const test::TemporaryFolder empty;
  EXPECT_THAT(MessageOf([&] { Dataset::Load(empty.path()); }), HasSubstr("not a dataset folder"));
}

TEST_F(DatasetErrorsTest, BrokenYamlNamesTheLine) {
  EXPECT_THAT(AfterYaml("name: tiny", "name: [tiny"),
              AllOf(HasSubstr("dataset.yaml"), HasSubstr("dataset.yaml:4: is not valid YAML")));
}

TEST_F(DatasetErrorsTest, UnknownKeyNamesTheNearest) {
  EXPECT_THAT(AfterYaml("sole_offset_m", "sole_ofset_m"),
              AllOf(HasSubstr("sole_ofset_m: unknown key"), HasSubstr("did you mean 'sole_offset_m'?")));
}

TEST_F(DatasetErrorsTest, KeyTwice) {
  EXPECT_THAT(AfterYaml("name: tiny", "name: tiny\nname: other"), HasSubstr("given twice"));
}

TEST_F(DatasetErrorsTest, MissingKey) {
  EXPECT_THAT(AfterYaml("sole_offset_m: 0.051\n", ""), HasSubstr("sole_offset_m: the key is missing"));
}

TEST_F(DatasetErrorsTest, WrongFormat) {
  EXPECT_THAT(AfterYaml("legopt-dataset/1", "legopt-dataset/9"), HasSubstr("legopt-dataset/1"));
}

TEST_F(DatasetErrorsTest, NumbersThatAreNone) {
  EXPECT_THAT(AfterYaml("sole_offset_m: 0.051", "sole_offset_m: .nan"), HasSubstr("sole_offset_m: must be a finite"));
  EXPECT_THAT(AfterYaml("sole_offset_m: .nan", "sole_offset_m: 5cm"), HasSubstr("(got '5cm')"));
  EXPECT_THAT(AfterYaml("sole_offset_m: 5cm", "sole_offset_m: -1"), HasSubstr("must not be negative"));
  EXPECT_THAT(AfterYaml("sole_offset_m: -1", "sole_offset_m: 0.05\ngravity_m_s2: 0"), HasSubstr("gravity_m_s2"));
}

TEST_F(DatasetErrorsTest, PathOutsideTheFolder) {
  EXPECT_THAT(AfterYaml("robot: robot.urdf", "robot: ../robot.urdf"), HasSubstr("leaves the dataset's folder"));
  EXPECT_THAT(AfterYaml("robot: ../robot.urdf", "robot: /etc/robot.urdf"), HasSubstr("leaves the dataset's folder"));
}

TEST_F(DatasetErrorsTest, MissingFileIsNamed) {
  fs::remove(folder_.path() / "scene.yaml");
  EXPECT_THAT(LoadMessage(), AllOf(HasSubstr("scene.yaml"), HasSubstr("does not exist")));
}

TEST_F(DatasetErrorsTest, MissingMeshIsNamed) {
  fs::remove(folder_.path() / "meshes" / "rock.obj");
  EXPECT_THAT(LoadMessage(), AllOf(HasSubstr("meshes/rock.obj"), HasSubstr("does not exist")));
}

TEST_F(DatasetErrorsTest, CorruptMeshIsNamedWithItsUser) {
  const fs::path mesh = folder_.path() / "meshes" / "rock.obj";
  const std::string before = HashFile(mesh);
  test::WriteText(mesh, "no mesh at all");
  ReplaceInFile(folder_.path() / "dataset.yaml", before, HashFile(mesh));
  EXPECT_THAT(LoadMessage(), AllOf(HasSubstr("meshes/rock.obj"), HasSubstr("'rock'")));
}

TEST_F(DatasetErrorsTest, HashMismatchNamesFileExpectedFoundAndFix) {
  const fs::path mesh = folder_.path() / "meshes" / "rock.obj";
  const std::string expected = HashFile(mesh);
  ReplaceInFile(mesh, "v 1 0 0", "v 1 0 1");
  EXPECT_THAT(LoadMessage(), AllOf(HasSubstr("rock.obj"), HasSubstr("expects " + expected),
                                   HasSubstr("(got '" + HashFile(mesh) + "')"), HasSubstr("restore"),
                                   HasSubstr("legopt dataset hash")));
}

TEST_F(DatasetErrorsTest, UsedFileNotListedAndListedFileNotUsed) {
  const fs::path file = folder_.path() / "dataset.yaml";
  const std::string line = "  scene.yaml: " + HashFile(folder_.path() / "scene.yaml") + "\n";
  ReplaceInFile(file, line, "");
  EXPECT_THAT(LoadMessage(), AllOf(HasSubstr("not listed"), HasSubstr(line.substr(2, line.size() - 3))));
  WriteText(folder_.path() / "extra.txt", "");
  ReplaceInFile(file, "files:\n", "files:\n" + line + "  extra.txt: " + Blake2bHex("") + "\n");
  EXPECT_THAT(LoadMessage(), AllOf(HasSubstr("extra.txt"), HasSubstr("does not use")));
}

TEST_F(DatasetErrorsTest, HashThatIsNone) {
  EXPECT_THAT(AfterYaml("  robot.urdf: ", "  robot.urdf: x"), HasSubstr("is not a hash"));
  WriteManifestHashes(folder_.path());
  EXPECT_NO_THROW(Dataset::Load(folder_.path())) << "the command of the error message mends it";
}

TEST_F(DatasetErrorsTest, Feet) {
  EXPECT_THAT(AfterYaml("feet: [l_foot, r_foot]", "feet: [l_fot, r_foot]"),
              AllOf(HasSubstr("no such link"), HasSubstr("did you mean 'l_foot'?")));
  EXPECT_THAT(AfterYaml("feet: [l_fot, r_foot]", "feet: [camera]"), HasSubstr("no collision geometry"));
  EXPECT_THAT(AfterYaml("feet: [camera]", "feet: []"), HasSubstr("at least one link"));
  EXPECT_THAT(AfterYaml("feet: []", "feet: [l_foot, l_foot]"), HasSubstr("listed twice"));
  EXPECT_THAT(AfterYaml("feet: [l_foot, l_foot]\n", ""), HasSubstr("feet: the key is missing"));
}

TEST_F(DatasetErrorsTest, Joints) {
  EXPECT_THAT(AfterYaml("{l_hip: -0.3", "{l_hipp: -0.3"),
              AllOf(HasSubstr("nominal_posture"), HasSubstr("did you mean 'l_hip'?")));
  EXPECT_THAT(AfterYaml("{l_hipp: -0.3", "{camera_joint: -0.3"), HasSubstr("no such movable joint"));
  EXPECT_THAT(AfterYaml("{camera_joint: -0.3", "{l_hip: bent"), HasSubstr("nominal_posture.l_hip"));
}

TEST_F(DatasetErrorsTest, NoProblemFile) {
  EXPECT_THAT(AfterYaml("  posture: problems-posture.json\n  motion: problems-motion.json", "  {}"),
              HasSubstr("names no problem file"));
}

TEST_F(DatasetErrorsTest, StanceFaultsNameFileProblemAndStance) {
  EXPECT_THAT(AfterFile("problems-posture.json", "0 0.1 0 ,r_foot,1 0 0 0 0 -0.1 0 ,\"]},",
                        "0 0.1 0 ,r_foot,1 0 0 0 0 -0.1 ,\"]},"),
              AllOf(HasSubstr("problems-posture.json: problem 0, stance 0"), HasSubstr("6 numbers")));
}

TEST_F(DatasetErrorsTest, UnknownLinkNonUnitQuaternionAndNan) {
  EXPECT_THAT(AfterFile("problems-motion.json", " \"l_foot,1 0 0 0 0 0.1 0 ,\",", " \"l_foo,1 0 0 0 0 0.1 0 ,\","),
              AllOf(HasSubstr("problem 0, stance 1"), HasSubstr("did you mean 'l_foot'?")));
  EXPECT_THAT(AfterFile("problems-motion.json", "l_foo,1 0 0 0", "l_foot,1 0.1 0 0"), HasSubstr("not unit"));
  EXPECT_THAT(AfterFile("problems-motion.json", "l_foot,1 0.1 0 0 0", "l_foot,1 0 0 0 nan"), HasSubstr("finite"));
}

TEST_F(DatasetErrorsTest, IdsAndTasks) {
  EXPECT_THAT(AfterFile("problems-posture.json", "\"id\": 7", "\"id\": 0"), HasSubstr("used twice"));
  EXPECT_THAT(AfterFile("problems-posture.json", "{\"id\": 0, \"def", "{\"id\": -1, \"def"), HasSubstr("negative"));
  EXPECT_THAT(AfterFile("problems-posture.json", "\"id\": -1, ", ""), HasSubstr("problems[0].id"));
}

TEST_F(DatasetErrorsTest, TaskAndNumberOfStancesFit) {
  EXPECT_THAT(AfterFile("problems-posture.json", "\"task\": \"posture\"", "\"task\": \"motion\""),
              HasSubstr("used for posture problems"));
  EXPECT_THAT(AfterFile("problems-posture.json", "\"task\": \"motion\"", "\"task\": \"sit\""),
              HasSubstr("unknown task"));
  ReplaceInFile(folder_.path() / "problems-posture.json", "\"task\": \"sit\"", "\"task\": \"posture\"");
  EXPECT_THAT(AfterFile("problems-posture.json", "-0.1 0 ,\"]},", "-0.1 0 ,\", \"l_foot,1 0 0 0 0 0 0\"]},"),
              HasSubstr("one stance"));
}

TEST_F(DatasetErrorsTest, BrokenJson) {
  EXPECT_THAT(AfterFile("problems-posture.json", "\"problems\"", "problems"), HasSubstr("not valid JSON"));
}

TEST_F(DatasetErrorsTest, UnknownProblemIdListsTheIds) {
  const auto dataset = Dataset::Load(folder_.path());
  EXPECT_THAT(MessageOf([&] { dataset->problem(Task::kPosture, 3); }), HasSubstr("ids: 0, 7"));
}

TEST_F(DatasetErrorsTest, BareFolderMustBeUnambiguous) {
  const test::TemporaryFolder bare;
  fs::copy_file(folder_.path() / "problems-posture.json", bare.path() / "problemsposture.json");
  const auto message = [&] { return MessageOf([&] { Dataset::Load(bare.path()); }); };
  EXPECT_THAT(message(), HasSubstr("URDF"));
  fs::create_directory(bare.path() / "robot");
  fs::copy_file(folder_.path() / "robot.urdf", bare.path() / "robot" / "a.urdf");
  EXPECT_THAT(message(), HasSubstr("scene mesh"));
  fs::copy_file(folder_.path() / "meshes" / "rock.obj", bare.path() / "rock.obj");
  EXPECT_THAT(message(), AllOf(HasSubstr("no such movable joint"), HasSubstr("dataset.yaml")));
  fs::copy_file(folder_.path() / "robot.urdf", bare.path() / "robot" / "b.urdf");
  EXPECT_THAT(message(), AllOf(HasSubstr("several"), HasSubstr("robot/a.urdf, robot/b.urdf")));
}

TEST_F(DatasetErrorsTest, ManifestOfABareFolderCannotBeWritten) {
  const test::TemporaryFolder bare;
  EXPECT_THAT(MessageOf([&] { WriteManifestHashes(bare.path()); }), HasSubstr("dataset.yaml"));
}

}  // namespace
}  // namespace legopt
