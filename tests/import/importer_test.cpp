// Policy: a clone of the original benchmark and loose files become datasets that load. Repairs and decisions are
// reported; the source is not changed.
#include "legopt/import/importer.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <map>

#include "legopt/dataset/dataset.h"
#include "legopt/dataset/internal/dataset_writer.h"
#include "legopt/dataset/problem_definition.h"
#include "legopt/import/internal/used_contacts.h"
#include "tests/dataset/synthetic_dataset.h"
#include "tests/import/clone_folder.h"

namespace legopt {
namespace {

namespace fs = std::filesystem;
using test::MessageOf;
using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

const DatasetDiagnostic* Find(const ImportReport& report, const std::string& check,
                              DatasetDiagnostic::Severity severity) {
  const auto found = std::find_if(report.findings.begin(), report.findings.end(), [&](const DatasetDiagnostic& f) {
    return f.check == check && f.severity == severity;
  });
  return found == report.findings.end() ? nullptr : &*found;
}

ImportOptions From(const fs::path& source) {
  ImportOptions options;
  options.source = source;
  options.name = "imported";
  return options;
}

constexpr auto kInfo = DatasetDiagnostic::Severity::kInfo;
constexpr auto kWarning = DatasetDiagnostic::Severity::kWarning;
constexpr auto kRepaired = DatasetDiagnostic::Severity::kRepaired;

TEST(Import, OfACloneOfTheOriginalBenchmark) {
  const test::CloneFolder clone;
  const fs::path out = clone.StagedFolder("out");
  const ImportReport report = ImportDataset(From(clone.path()), out);
  EXPECT_FALSE(AnyError(report.findings));
  const auto dataset = Dataset::Load(out);
  EXPECT_EQ(dataset->content_hash(), report.content_hash);
  EXPECT_EQ(dataset->name(), "imported");
  EXPECT_EQ(dataset->robot().num_dofs(), test::kSyntheticDofs);
  EXPECT_EQ(dataset->problems(Task::kPosture).size(), 2U);
  EXPECT_EQ(dataset->problems(Task::kMotion).size(), 1U);
  ASSERT_EQ(dataset->contacts().size(), 2U) << "the links that the problems name";
  EXPECT_EQ(dataset->contacts()[0].link, "l_foot");
  EXPECT_NEAR(dataset->contacts()[0].link_height_m(), test::kSyntheticSoleOffset_m, 1e-6)
      << "lowest point of the feet and 1 mm";
  ASSERT_NE(Find(report, "quaternion order", kInfo), nullptr);
  EXPECT_THAT(Find(report, "quaternion order", kInfo)->value, HasSubstr("w first: 5 of 5"));
  EXPECT_NE(Find(report, "nominal posture", kInfo), nullptr);
  EXPECT_EQ(test::ReadText(out / "problems-posture.json"),
            test::ReadText(clone.path() / "data" / "problemsposture.json"));
}

TEST(Import, QuaternionsOfTheOtherOrderAreTurned) {
  const test::CloneFolder clone;
  const auto straight = Dataset::Load([&] {
    const fs::path out = clone.StagedFolder("straight");
    ImportDataset(From(clone.path()), out);
    return out;
  }());
  for (const Task task : {Task::kPosture, Task::kMotion}) {
    const fs::path file = clone.path() / "data" / ("problems" + std::string(ToString(task)) + ".json");
    ProblemFile problems = ReadProblemFile(file);
    for (ProblemDefinition& problem : problems.problems) {
      for (Stance& stance : problem.stances) {
        for (ContactTarget& target : stance.contacts) {
          const Eigen::Quaterniond q = target.rotation;
          target.rotation = Eigen::Quaterniond(q.x(), q.y(), q.z(), q.w());  // written as x y z w
        }
      }
    }
    test::WriteText(file, FormatProblems(problems.problems, task, "tiny", "yard"));
  }
  const fs::path out = clone.StagedFolder("turned");
  const ImportReport report = ImportDataset(From(clone.path()), out);
  EXPECT_FALSE(AnyError(report.findings));
  EXPECT_THAT(Find(report, "quaternion order", kInfo)->message, HasSubstr("turned into w x y z"));
  const auto turned = Dataset::Load(out);
  for (const Task task : {Task::kPosture, Task::kMotion}) {
    EXPECT_EQ(turned->problems(task), straight->problems(task));
  }
}

// As if the files came from different sources.
TEST(Import, EachProblemFileHasItsOwnOrderOfQuaternions) {
  const test::CloneFolder clone;
  const fs::path file = clone.path() / "data" / "problemsposture.json";
  const auto straight = ReadProblemFile(file).problems;
  test::ReplaceInFile(file, "1 0 0 0 0 0.1 0", "0 0 0 1 0 0.1 0");
  test::ReplaceInFile(file, "1 0 0 0 0 -0.1 0", "0 0 0 1 0 -0.1 0");
  test::ReplaceInFile(file, "0.7071067812 0 0 0.7071067812 2.9", "0 0 0.7071067812 0.7071067812 2.9");
  test::ReplaceInFile(file, "0.7071067812 0 0 0.7071067812 3.1", "0 0 0.7071067812 0.7071067812 3.1");
  const fs::path out = clone.StagedFolder("mixed");
  const ImportReport report = ImportDataset(From(clone.path()), out);
  EXPECT_FALSE(AnyError(report.findings));
  const DatasetDiagnostic* finding = Find(report, "quaternion order", kInfo);
  ASSERT_NE(finding, nullptr);
  EXPECT_EQ(finding->field, "posture problems");
  EXPECT_EQ(test::ReadText(out / "problems-motion.json"),
            test::ReadText(clone.path() / "data" / "problemsmotion.json"));
  EXPECT_EQ(Dataset::Load(out)->problems(Task::kPosture), straight);
}

TEST(Import, TheLeftFootComesFirstWhateverTheProblemsNameFirst) {
  const test::CloneFolder clone;
  for (const char* name : {"problemsposture.json", "problemsmotion.json"}) {
    const fs::path file = clone.path() / "data" / name;
    ProblemFile problems = ReadProblemFile(file);
    for (ProblemDefinition& problem : problems.problems) {
      for (Stance& stance : problem.stances) std::reverse(stance.contacts.begin(), stance.contacts.end());
    }
    test::WriteText(file, FormatProblems(problems.problems, *problems.task, "tiny", "yard"));
  }
  const fs::path out = clone.StagedFolder("out");
  ImportDataset(From(clone.path()), out);
  const auto dataset = Dataset::Load(out);
  ASSERT_EQ(dataset->contacts().size(), 2U);
  EXPECT_EQ(dataset->contacts()[0].link, "l_foot");
}

TEST(Import, OfAUrdfWithMeshesInPackages) {
  const test::TemporaryFolder folder;
  const test::SyntheticFolder synthetic(folder.path() / "ws" / "description");
  const fs::path& source = synthetic.path();
  fs::remove(source / "dataset.yaml");
  fs::create_directories(source / "models" / "a");
  fs::copy(source / "meshes" / "rock.obj", source / "models" / "a" / "head.obj");
  test::ReplaceInFile(source / "robot.urdf", "<box size='0.1 0.1 0.1'/>",
                      "<mesh filename='package://description/models/a/head.obj' scale='0.1 0.1 0.1'/>");
  test::ReplaceInFile(source / "robot.urdf", "<link name='lidar_link'/>",
                      "<link name='lidar_link'><visual><geometry><sphere radius='1'/></geometry></visual></link>");
  fs::create_directories(folder.path() / "out");
  const ImportReport report = ImportDataset(From(source), folder.path() / "out");
  EXPECT_FALSE(AnyError(report.findings));
  ASSERT_NE(Find(report, "robot", kWarning), nullptr);
  EXPECT_EQ(Find(report, "robot", kWarning)->field, "lidar_link");
  fs::remove_all(source);
  const auto dataset = Dataset::Load(folder.path() / "out");
  EXPECT_TRUE(fs::exists(folder.path() / "out" / "meshes" / "head.obj"));
  EXPECT_TRUE(fs::exists(folder.path() / "out" / "scene" / "meshes" / "rock.obj"));
  EXPECT_EQ(dataset->scene().objects.size(), 3U);
}

TEST(Import, OfADatasetKeepsItsConstants) {
  const test::TemporaryFolder folder;
  const test::SyntheticFolder synthetic(folder.path() / "in");
  fs::create_directories(folder.path() / "out");
  const ImportReport report = ImportDataset(From(synthetic.path()), folder.path() / "out");
  EXPECT_FALSE(AnyError(report.findings));
  const auto dataset = Dataset::Load(folder.path() / "out");
  EXPECT_EQ(dataset->nominal_joints(), Dataset::Load(synthetic.path())->nominal_joints());
  EXPECT_EQ(dataset->contacts()[0].link_height_m(), test::kSyntheticSoleOffset_m);
}

TEST(Import, InvertedScenesAreTurned) {
  const test::CloneFolder clone;
  const fs::path mesh = clone.path() / "destruction_scenarios" / "worlds" / "yard.obj";
  test::WriteText(mesh,
                  "v -9 -9 -1\nv 9 -9 -1\nv 9 9 -1\nv -9 9 -1\nv -9 -9 0\nv 9 -9 0\nv 9 9 0\nv -9 9 0\n"
                  "f 1 2 3 4\nf 5 8 7 6\nf 1 5 6 2\nf 2 6 7 3\nf 3 7 8 4\nf 4 8 5 1\n");
  test::ReplaceInFile(clone.path() / "LegOptEnv.xml", "yard.stl", "yard.obj");
  const ImportReport turned = ImportDataset(From(clone.path()), clone.StagedFolder("turned"));
  EXPECT_FALSE(AnyError(turned.findings));
  ASSERT_NE(Find(turned, "winding", kRepaired), nullptr);
  EXPECT_THAT(Find(turned, "winding", kRepaired)->value, HasSubstr("1 body"));
}

std::string TextOf(const fs::path& file) {
  std::ifstream stream(file);
  return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
}

// One inside-out file shared by two objects, once by a quoted name, and one valid file.
TEST(Import, OfAllMeshesOfASceneOnlyThoseInsideOutAreTurned) {
  const std::string corners = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n";
  const test::TemporaryFolder folder;
  const test::SyntheticFolder synthetic(folder.path() / "in");
  const fs::path& source = synthetic.path();
  test::WriteText(source / "meshes" / "rock.obj", corners + "f 1 2 3\nf 1 4 2\nf 1 3 4\nf 2 4 3\n");
  test::WriteText(source / "meshes" / "stone.obj", corners + "f 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n");
  test::ReplaceInFile(source / "scene.yaml", "objects:",
                      "# meshes/rock.obj is from a quarry\nobjects:\n"
                      "  - {name: boulder, shape: mesh, file: \"meshes/rock.obj\", position: [7, 7, 1]}\n"
                      "  - {name: stone, shape: mesh, file: meshes/stone.obj, position: [9, 5, 1]}");
  const std::string scene = TextOf(source / "scene.yaml");

  const ImportOptions options = From(source);
  const fs::path out = folder.path() / "out";
  fs::create_directories(out);
  const ImportReport turned = ImportDataset(options, out);
  EXPECT_FALSE(AnyError(turned.findings));
  const DatasetDiagnostic* finding = Find(turned, "winding", kRepaired);
  ASSERT_NE(finding, nullptr);
  EXPECT_EQ(finding->field, "meshes/rock.obj");
  EXPECT_EQ(finding->value, "1 body");
  std::string expected = scene;
  for (const std::string old : {"\"meshes/rock.obj\"", "file: meshes/rock.obj"}) {
    const std::string key = old.front() == 'f' ? "file: " : "";
    expected.replace(expected.rfind(old), old.size(), key + "'meshes/rock-turned.ply'");
  }
  EXPECT_EQ(TextOf(out / "scene" / "scene.yaml"), expected);
  EXPECT_FALSE(fs::exists(out / "scene" / "meshes" / "rock.obj"));
  EXPECT_EQ(TextOf(out / "scene" / "meshes" / "stone.obj"), TextOf(source / "meshes" / "stone.obj"));
  EXPECT_EQ(TextOf(source / "scene.yaml"), scene) << "the source stays as it is";
  const auto dataset = Dataset::Load(out);
  EXPECT_EQ(dataset->scene().objects.size(), 5U);
}

TEST(Import, MeshesOfOneNameAndDifferentSuffixesStayTwo) {
  const test::TemporaryFolder folder;
  const test::SyntheticFolder synthetic(folder.path() / "in");
  const fs::path& source = synthetic.path();
  // Two inside-out meshes, one a third of the other. The second has the suffix of another format and a byte order
  // mark.
  test::WriteText(source / "meshes" / "rock.obj",
                  "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\nf 1 4 2\nf 1 3 4\nf 2 4 3\n");
  test::WriteText(source / "meshes" / "rock.ply",
                  "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
                  "element face 4\nproperty list uchar int vertex_indices\nend_header\n"
                  "0 0 0\n3 0 0\n0 3 0\n0 0 3\n3 0 1 2\n3 0 3 1\n3 0 2 3\n3 1 3 2\n");
  test::ReplaceInFile(source / "scene.yaml",
                      "objects:", "objects:\n  - {name: big, shape: mesh, file: meshes/rock.ply, position: [7, 7, 1]}");
  test::WriteText(source / "scene.yaml", "\xEF\xBB\xBF" + TextOf(source / "scene.yaml"));
  const ImportOptions options = From(source);
  fs::create_directories(folder.path() / "out");
  EXPECT_FALSE(AnyError(ImportDataset(options, folder.path() / "out").findings));
  std::map<std::string, double> sizes;
  const auto dataset = Dataset::Load(folder.path() / "out");
  for (const SceneObject& object : dataset->scene().objects) {
    if (object.shape.kind != ShapeSpec::Kind::kMesh) continue;
    const TriangleMesh mesh = LoadMesh(object.shape.mesh_file);
    for (const Eigen::Vector3d& vertex : mesh.vertices) sizes[object.name] = std::max(sizes[object.name], vertex.x());
  }
  EXPECT_EQ(sizes.at("rock"), 1.0);
  EXPECT_EQ(sizes.at("big"), 3.0);
}

TEST(Import, AMeshNameThatCannotBeReplacedIsNamed) {
  const test::TemporaryFolder folder;
  const test::SyntheticFolder synthetic(folder.path() / "in");
  test::WriteText(synthetic.path() / "meshes" / "rock.obj",
                  "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\nf 1 4 2\nf 1 3 4\nf 2 4 3\n");
  test::ReplaceInFile(synthetic.path() / "scene.yaml", "file: meshes/rock.obj", "file: \"meshes/\\x72ock.obj\"");
  const ImportOptions options = From(synthetic.path());
  fs::create_directories(folder.path() / "out");
  EXPECT_THAT(MessageOf([&] { ImportDataset(options, folder.path() / "out"); }),
              AllOf(HasSubstr("scene.yaml"), HasSubstr("meshes/rock.obj"), HasSubstr("plain or quoted word")));
}

TEST(Import, FeetAreFound) {
  const test::CloneFolder clone;
  fs::remove_all(clone.path() / "data");
  const auto error = [&](const ImportOptions& options) {
    return MessageOf([&] { ImportDataset(options, clone.StagedFolder("out")); });
  };
  const ImportReport found = ImportDataset(From(clone.path()), clone.StagedFolder("found"));
  ASSERT_NE(Find(found, "feet", kInfo), nullptr);
  EXPECT_EQ(Find(found, "feet", kInfo)->value, "l_foot, r_foot");
  ImportOptions options = From(clone.path());
  options.contacts = {"l_fot"};
  EXPECT_THAT(error(options), AllOf(HasSubstr("l_fot"), HasSubstr("did you mean 'l_foot'"), Not(HasSubstr("/out"))));
  options.contacts = {"camera"};
  EXPECT_THAT(error(options), AllOf(HasSubstr("camera"), HasSubstr("no collision geometry")));
  options.contacts = {"l_foot", "r_foot"};
  const ImportReport report = ImportDataset(options, clone.StagedFolder("out"));
  EXPECT_NE(Find(report, "problems", kWarning), nullptr) << "a dataset for generate problems";
}

/// A folder with the synthetic robot only.
class RobotAlone {
 public:
  RobotAlone() {
    for (const char* file : {"dataset.yaml", "scene.yaml", "problems-posture.json", "problems-motion.json"}) {
      fs::remove(source_ / file);
    }
    fs::remove_all(source_ / "meshes");
    fs::create_directories(folder_.path() / "out");
  }
  void Replace(const std::string& text, const std::string& by) {
    test::ReplaceInFile(source_ / "robot.urdf", text, by);
  }
  ImportOptions& options() { return options_; }
  ImportReport Import() { return ImportDataset(options_, folder_.path() / "out"); }
  std::shared_ptr<const Dataset> Imported() {
    Import();
    return Dataset::Load(folder_.path() / "out");
  }

 private:
  test::TemporaryFolder folder_;
  test::SyntheticFolder files_{folder_.path() / "in"};
  fs::path source_ = files_.path();
  ImportOptions options_ = From(source_);
};

constexpr const char* kFoot = "<origin xyz='0.03 0 -0.03'/><geometry><box size='0.2 0.1 0.04'/></geometry>";

TEST(Import, ARobotAloneStandsOnLevelGroundWithMeasuredSoles) {
  RobotAlone robot;
  const auto dataset = robot.Imported();
  ASSERT_EQ(dataset->contacts().size(), 2U);
  for (const Contact& contact : dataset->contacts()) {
    EXPECT_TRUE(contact.declares_points);
    EXPECT_EQ(contact.link_height_m(), test::kSyntheticSoleOffset_m);
    EXPECT_TRUE(contact.X_LC.linear().isIdentity(0.0));
    EXPECT_LT((contact.Patch().min() - Eigen::Vector2d(-0.07, -0.05)).norm(), 1e-9);
    EXPECT_LT((contact.Patch().max() - Eigen::Vector2d(0.13, 0.05)).norm(), 1e-9);
  }
  EXPECT_EQ(dataset->contacts()[0].link, "l_foot");
  EXPECT_EQ(dataset->scene().objects.size(), 1U);
}

TEST(Import, ATiltedSoleGetsAFrameOfItsOwn) {
  RobotAlone robot;
  for (int side = 0; side < 2; ++side) {
    robot.Replace(kFoot, "<origin xyz='0.03 0 -0.03' rpy='0 0.35 0'/><geometry><box size='0.2 0.1 0.04'/></geometry>");
  }
  const Contact contact = robot.Imported()->contacts()[0];
  const Eigen::Matrix3d expected = Eigen::AngleAxisd(0.35, Eigen::Vector3d::UnitY()).toRotationMatrix();
  EXPECT_LT((contact.X_LC.linear() - expected).norm(), 1e-9);
  // The middle of the sole, 20 mm below the middle of the box, is 1 mm above the contact frame's plane.
  const Eigen::Vector3d middle = Eigen::Vector3d(0.03, 0, -0.03) - 0.02 * expected.col(2);
  EXPECT_NEAR((contact.X_LC.inverse() * middle).z(), 1e-3, 1e-6);
}

TEST(Import, OnlyTheSoleIsThePatchNotASpurAboveIt) {
  RobotAlone robot;
  for (int side = 0; side < 2; ++side) {
    robot.Replace(kFoot,
                  "<origin xyz='0.030 0 -0.03'/><geometry><box size='0.2 0.1 0.04'/></geometry></collision>"
                  "<collision><origin xyz='-0.1 0 -0.02'/><geometry><box size='0.06 0.1 0.02'/></geometry>");
  }
  EXPECT_NEAR(robot.Imported()->contacts()[0].Patch().min().x(), -0.07, 1e-6);
}

TEST(Import, ABallIsAPointContact) {
  RobotAlone robot;
  for (int side = 0; side < 2; ++side) {
    robot.Replace(kFoot, "<origin xyz='0.030 0 -0.03'/><geometry><sphere radius='0.03'/></geometry>");
  }
  const Contact contact = robot.Imported()->contacts()[0];
  EXPECT_EQ(contact.kind, ContactKind::kPoint);
  EXPECT_TRUE(contact.X_LC.translation().isApprox(Eigen::Vector3d(0.03, 0.0, -0.03), 1e-9));
  EXPECT_NEAR(contact.radius_m, 0.03, 1e-9);
}

TEST(Import, UnclearFeetAreAskedFor) {
  RobotAlone robot;
  robot.Replace(
      "<joint name='r_hip' type='revolute'><parent link='trunk'/><child link='r_leg'/><origin xyz='0 -0.1 0'/>",
      "<joint name='r_hip' type='revolute'><parent link='trunk'/><child link='r_leg'/><origin xyz='0 -0.1 1'/>");
  EXPECT_THAT(MessageOf([&] { robot.Import(); }), AllOf(HasSubstr("--contacts"), HasSubstr("1 l_foot")));
}

TEST(Import, MeshesAreSearchedInOtherFoldersAndLeftOutOnRequest) {
  const test::TemporaryFolder elsewhere;
  test::WriteText(elsewhere.path() / "part.obj",
                  "v 0 0 1\nv 0.1 0 1\nv 0 0.1 1\nv 0 0 1.1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n");
  const std::string part =
      "</collision><collision><geometry><mesh filename='package://robot_parts/part.obj'/></geometry>";
  RobotAlone robot;
  robot.Replace(kFoot, kFoot + part);
  EXPECT_THAT(MessageOf([&] { robot.Import(); }),
              AllOf(HasSubstr("no such mesh file"), HasSubstr("--mesh-path"), HasSubstr("--allow-missing-meshes")));
  RobotAlone given;
  given.Replace(kFoot, kFoot + part);
  given.options().meshes.folders = {elsewhere.path()};
  EXPECT_EQ(given.Imported()->robot().links()[static_cast<std::size_t>(2)].collision.size(), 2U);
  RobotAlone without;
  without.Replace(kFoot, kFoot + part);
  without.options().meshes.allow_missing = true;
  const ImportReport report = without.Import();
  const DatasetDiagnostic* missing = Find(report, "link meshes", kWarning);
  ASSERT_NE(missing, nullptr);
  EXPECT_EQ(missing->field, "l_foot");
  EXPECT_THAT(missing->message, HasSubstr("do not exist"));
}

TEST(Import, ANominalPostureBeyondTheLimitsIsRefused) {
  const test::CloneFolder clone;
  ImportOptions options = From(clone.path());
  options.nominal_posture = {{"l_hip", 9.0}};
  EXPECT_THAT(MessageOf([&] { ImportDataset(options, clone.StagedFolder("out")); }),
              AllOf(HasSubstr("--nominal"), HasSubstr("l_hip=9.0"), HasSubstr("limits"), HasSubstr(" .. 0.99999")));
  options.nominal_posture = {{"l_hip", 0.9}};
  ImportDataset(options, clone.StagedFolder("within"));
}

TEST(Import, ErrorsNameTheUsersFiles) {
  const test::CloneFolder clone;
  const fs::path problems = clone.path() / "data" / "problemsposture.json";
  test::ReplaceInFile(problems, "l_foot,1 0 0 0 0 0.1 0 ,r_foot", "l_hand,1 0 0 0 0 0.1 0 ,r_foot");
  ImportOptions options = From(clone.path());
  options.contacts = {"l_foot", "r_foot"};
  EXPECT_THAT(MessageOf([&] { ImportDataset(options, clone.StagedFolder("out")); }),
              AllOf(HasSubstr(problems.string()), HasSubstr("l_hand"), HasSubstr("no such contact")));
}

TEST(Import, OfTheLegOptDataFindsTheirKnownFaults) {
  LEGOPT_SKIP_WITHOUT_TEST_DATA();
  const test::TemporaryFolder folder;
  const ImportReport report = ImportDataset(From(test::LegOptFolder()), folder.path());
  EXPECT_FALSE(AnyError(report.findings));
  const auto dataset = Dataset::Load(folder.path());
  const auto bare = Dataset::Load(test::LegOptFolder());
  EXPECT_EQ(dataset->contacts()[0].link_height_m(), bare->contacts()[0].link_height_m());
  EXPECT_EQ(dataset->nominal_joints(), bare->nominal_joints());
  EXPECT_EQ(dataset->problems(Task::kMotion), bare->problems(Task::kMotion));
  EXPECT_NE(Find(report, "quaternion order", kInfo), nullptr);
  const DatasetDiagnostic* hovering = Find(report, "hovering feet", kWarning);
  ASSERT_NE(hovering, nullptr);
  EXPECT_THAT(hovering->value, HasSubstr("57 of 3655 contacts, median 82.4 mm"));
  EXPECT_THAT(hovering->field, HasSubstr("posture 39; motion 1-2,"));
  EXPECT_THAT(hovering->message, HasSubstr("sole offset"));
}

}  // namespace
}  // namespace legopt
