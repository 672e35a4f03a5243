// Policy: damaged scenes become datasets with closed scenes of known volume, and each repair is reported.

#include "legopt/import/scene_repair.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>

#include "legopt/dataset/dataset.h"
#include "legopt/dataset/scene_file.h"
#include "legopt/geometry/internal/scene_solids.h"
#include "legopt/import/importer.h"
#include "tests/dataset/synthetic_dataset.h"
#include "tests/dataset/test_data.h"

namespace legopt {
namespace {

namespace fs = std::filesystem;
using test::MessageOf;
using testing::HasSubstr;

// A ground slab of 18 x 18 x 1 m with faces of four corners; the last one is its bottom.
constexpr const char* kCorners = "v -9 -9 -1\nv 9 -9 -1\nv 9 9 -1\nv -9 9 -1\nv -9 -9 0\nv 9 -9 0\nv 9 9 0\nv -9 9 0\n";
constexpr const char* kSides = "f 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n";
constexpr const char* kBottom = "f 1 4 3 2\n";
constexpr double kSlab_m3 = 18.0 * 18.0;

/// Imports the synthetic dataset with another scene.
class SceneImport {
 public:
  explicit SceneImport(const std::string& name, const std::string& text) : synthetic_(folder_.path() / "in") {
    test::WriteText(synthetic_.path() / name, text);
    options_.source = synthetic_.path();
    options_.name = "imported";
    options_.files.scene = name;
  }
  ImportOptions& options() { return options_; }
  fs::path out() const { return folder_.path() / ("out" + std::to_string(runs_)); }
  ImportReport Run() {
    ++runs_;
    fs::create_directories(out());
    return ImportDataset(options_, out());
  }
  TriangleMesh Triangles() const { return CollectSceneTriangles(Dataset::Load(out())->scene()); }

 private:
  test::TemporaryFolder folder_;
  test::SyntheticFolder synthetic_;
  ImportOptions options_;
  int runs_ = 0;
};

const DatasetDiagnostic* Find(const ImportReport& report, const std::string& check) {
  const auto found = std::find_if(report.findings.begin(), report.findings.end(),
                                  [&](const DatasetDiagnostic& f) { return f.check == check; });
  return found == report.findings.end() ? nullptr : &*found;
}

TEST(SceneRepair, AnOpenSlabIsRefusedWithTheRemedyAndRepaired) {
  SceneImport import("slab.obj", std::string(kCorners) + kSides);
  const ImportReport refused = import.Run();
  ASSERT_TRUE(AnyError(refused.findings));
  EXPECT_THAT(Find(refused, "holes")->fix, HasSubstr("--repair"));
  EXPECT_THAT(Find(refused, "holes")->fix, HasSubstr("legopt scene repair"));
  import.options().scene.repair = true;
  const ImportReport repaired = import.Run();
  EXPECT_EQ(Find(repaired, "holes"), nullptr);
  ASSERT_NE(Find(repaired, "repair"), nullptr);
  EXPECT_THAT(Find(repaired, "repair")->value, HasSubstr("1 holes capped"));
  EXPECT_NEAR(EnclosedVolume(import.Triangles()), kSlab_m3, 1e-6 * kSlab_m3);
  ASSERT_EQ(repaired.scene.size(), 1U);
  EXPECT_EQ(repaired.scene[0].mesh->counts.capped_holes, 1);
}

TEST(SceneRepair, FaultsThatNeedNoSurfaceAreRepairedAlways) {
  const std::string near =
      "v -9 -9 -1\nv 9 -9 -1\nv 9 9 -1\nv -9 9 -1\nv -9 -9 0\nv 9 -9 0\nv 9 9 0\nv -9 9 0\nv 9.000001 9 0\n";
  const std::vector<std::string> scenes = {
      std::string(kCorners) + kSides + "f 1 2 3 4\n",                                                // mixed
      near + "f 5 6 9 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n" + kBottom,                    // not welded
      std::string(kCorners) + kSides + kBottom + kSides,                                             // duplicates
      std::string(kCorners) + "v 20 0 0\nv 21 0 0\nv 22 0 0\n" + kSides + kBottom + "f 9 10 11\n"};  // no area
  for (const std::string& scene : scenes) {
    SceneImport import("slab.obj", scene);
    const ImportReport report = import.Run();
    ASSERT_NE(Find(report, "repair"), nullptr) << scene;
    EXPECT_EQ(Find(report, "holes"), nullptr);
    EXPECT_NEAR(EnclosedVolume(import.Triangles()), kSlab_m3, 1e-5 * kSlab_m3);
    EXPECT_EQ(import.Triangles().triangles.size(), 12U);
  }
}

TEST(SceneRepair, AGoodSceneIsCopiedByteByByte) {
  const std::string text = std::string(kCorners) + kSides + kBottom;
  SceneImport import("slab.obj", text);
  const ImportReport report = import.Run();
  EXPECT_EQ(Find(report, "repair"), nullptr);
  std::ifstream stream(import.out() / "scene.obj");
  EXPECT_EQ(std::string(std::istreambuf_iterator<char>(stream), {}), text);
}

TEST(SceneRepair, ScaleAndUpChangeTheWholeScene) {
  // In millimetres with y up.
  SceneImport import("slab.obj",
                     "v -4000 -1000 -4000\nv 4000 -1000 -4000\nv 4000 -1000 4000\nv -4000 -1000 4000\nv -4000 0 -4000\n"
                     "v 4000 0 -4000\nv 4000 0 4000\nv -4000 0 4000\n"
                     "f 5 8 7 6\nf 1 5 6 2\nf 2 6 7 3\nf 3 7 8 4\nf 4 8 5 1\nf 1 2 3 4\n");
  const ImportReport large = import.Run();
  ASSERT_NE(Find(large, "units"), nullptr);
  EXPECT_THAT(Find(large, "units")->fix, HasSubstr("--scale 0.001"));
  EXPECT_EQ(Find(large, "units")->severity, DatasetDiagnostic::Severity::kError);
  import.options().scene.scale = 0.001;
  import.options().scene.up = "y";
  const ImportReport report = import.Run();
  EXPECT_EQ(Find(report, "units"), nullptr);
  EXPECT_NE(Find(report, "up axis"), nullptr);
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3d& vertex : import.Triangles().vertices) box.extend(vertex);
  EXPECT_TRUE(box.min().isApprox(Eigen::Vector3d(-4, -4, -1)));
  EXPECT_NEAR(box.max().z(), 0.0, 1e-12);
}

TEST(SceneRepair, ObjectsOfASceneKeepTheirNamesAndShapes) {
  const test::TemporaryFolder folder;
  test::WriteText(folder.path() / "sheet.obj", "v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nf 1 2 3 4\n");
  test::WriteText(
      folder.path() / "scene.yaml",
      "objects:\n  - {name: post, shape: cylinder, radius: 0.1, length: 2, position: [1, 0, 1], rpy: [0, 0.3, 0]}\n"
      "  - {name: \"a: wall\", shape: mesh, file: sheet.obj, rpy: [1.5707963267948966, 0, 0], position: [0, 5, 1]}\n"
      "  - {name: floor, shape: plane}\n");
  const RebuiltScene scene =
      RebuildScene(folder.path() / "scene.yaml", {.repair = true, .scale = 2.0, .read_guard = {}});
  EXPECT_EQ(scene.Counts().thickened_walls, 1) << "level in the file, upright in the scene";
  WriteSceneYaml(scene, folder.path() / "out.yaml", "out-meshes");
  const Scene read = ReadSceneFile(folder.path() / "out.yaml");
  ASSERT_EQ(read.objects.size(), 3U);
  EXPECT_EQ(read.objects[0].shape.size.x(), 0.2);
  EXPECT_TRUE(read.objects[0].shape.pose.isApprox(scene.objects[0].object.shape.pose));
  EXPECT_EQ(read.objects[1].name, "a: wall");
  EXPECT_NEAR(EnclosedVolume(Tessellate(read.objects[1].shape)), 4.0 * 4.0 * 0.01, 1e-5);
  WriteSceneMesh(scene, folder.path() / "out.ply");
  EXPECT_TRUE(FindMeshFaults(CollectSceneTriangles(ReadSceneFile(folder.path() / "out.ply"))).none());
}

TEST(SceneRepair, OptionsAreChecked) {
  const auto message = [](const SceneRepairOptions& options) { return MessageOf([&] { options.Validate(); }); };
  EXPECT_THAT(message({.scale = 0.0}), HasSubstr("--scale"));
  EXPECT_THAT(message({.up = "x"}), HasSubstr("--up"));
  const test::TemporaryFolder folder;
  test::WriteText(folder.path() / "scene.yaml", "objects:\n  - {name: floor, shape: plane}\n");
  EXPECT_THAT(MessageOf([&] { RebuildScene(folder.path() / "scene.yaml", {.up = "y"}); }), HasSubstr("mesh file"));
}

TEST(SceneRepair, HolesThatRemainAreReported) {
  const test::TemporaryFolder folder;
  // A ribbon that is turned over once has one side only.
  std::string ribbon;
  constexpr int kParts = 12;
  for (int k = 0; k < kParts; ++k) {
    const double along = 2.0 * 3.14159265358979 * k / kParts, twist = 0.5 * along;
    for (const double w : {-0.3, 0.3}) {
      const double radius = 2.0 + w * std::cos(twist);
      ribbon += "v " + std::to_string(radius * std::cos(along)) + " " + std::to_string(radius * std::sin(along)) + " " +
                std::to_string(w * std::sin(twist)) + "\n";
    }
  }
  for (int k = 0; k < kParts; ++k) {
    const int a = 2 * k + 1, b = 2 * k + 2;
    const int c = k + 1 < kParts ? b + 2 : 1, d = k + 1 < kParts ? a + 2 : 2;
    ribbon += "f " + std::to_string(a) + " " + std::to_string(b) + " " + std::to_string(c) + "\nf " +
              std::to_string(a) + " " + std::to_string(c) + " " + std::to_string(d) + "\n";
  }
  test::WriteText(folder.path() / "ribbon.obj", ribbon);
  const RebuiltScene scene = RebuildScene(folder.path() / "ribbon.obj", {.repair = true});
  const auto faults = FaultsOf(scene);
  EXPECT_EQ(faults.empty(), scene.objects[0].mesh->faults.open_edges == 0);
}

}  // namespace
}  // namespace legopt
