// Policy: `scene repair` writes a closed scene and a picture, or nothing and the reason.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "app/exit_codes.h"
#include "legopt/input/json.h"
#include "program_run.h"
#include "tests/temporary_folder.h"

namespace legopt::client {
namespace {

using app::ExitCode;
using testing::HasSubstr;
namespace fs = std::filesystem;

class SceneCommandTest : public testing::Test {
 protected:
  SceneCommandTest() {
    std::ofstream(folder_.path() / "open.obj")
        << "v 0 0 0\nv 2 0 0\nv 2 3 0\nv 0 3 0\nv 0 0 1\nv 2 0 1\nv 2 3 1\nv 0 3 1\n"
           "f 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n";
  }
  ProgramResult Repair(std::vector<std::string> more) {
    more.insert(more.begin(), {"scene", "repair", "open.obj"});
    return RunLegopt(more, folder_.path());
  }
  test::TemporaryFolder folder_;
};

TEST_F(SceneCommandTest, WritesMeshAndPictureAndCounts) {
  const ProgramResult text = Repair({"--out", "closed.ply"});
  EXPECT_EQ(text.exit_code, static_cast<int>(ExitCode::kOk)) << text.err;
  EXPECT_THAT(text.out, HasSubstr("1 holes capped"));
  EXPECT_TRUE(fs::exists(folder_.path() / "closed.ply"));
  EXPECT_GT(fs::file_size(folder_.path() / "closed-repairs.png"), 1000U);
  const ProgramResult json = Repair({"--out", "closed.yaml", "--picture", "p.png", "--scale", "2", "--format", "json"});
  const nlohmann::json document = ParseJson(json.out, "output");
  EXPECT_EQ(document.at("repairs").at(0).at("capped_holes"), 1);
  EXPECT_NEAR(document.at("volume_m3").get<double>(), 48.0, 1e-6);
  EXPECT_TRUE(fs::exists(folder_.path() / "closed.yaml"));
  EXPECT_TRUE(fs::exists(folder_.path() / "p.png"));
}

TEST_F(SceneCommandTest, FlagsSetToleranceThicknessAndUpAxis) {
  const auto report = [&](const std::string& mesh, std::vector<std::string> flags) {
    std::ofstream(folder_.path() / "open.obj") << mesh;
    fs::remove(folder_.path() / "made.yaml");
    flags.insert(flags.end(), {"--out", "made.yaml", "--format", "json"});
    const ProgramResult result = Repair(flags);
    EXPECT_EQ(result.exit_code, static_cast<int>(ExitCode::kOk)) << result.err;
    return ParseJson(result.out, "output");
  };
  // Two triangles of a sheet whose common edge is torn by 1 mm.
  const std::string torn = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 1.001 1 0\nv 0.001 0 0\nf 1 2 3\nf 6 5 4\n";
  EXPECT_EQ(report(torn, {}).at("repairs").at(0).at("welded_vertices"), 0);
  EXPECT_EQ(report(torn, {"--weld", "0.002"}).at("repairs").at(0).at("welded_vertices"), 2);
  const std::string sheet = "v 0 0 0\nv 2 0 0\nv 2 3 0\nv 0 3 0\nf 1 2 3 4\n";
  EXPECT_NEAR(report(sheet, {"--thickness", "0.5"}).at("volume_m3").get<double>(), 3.0, 1e-9);
  EXPECT_EQ(report(sheet, {}).at("repairs").at(0).at("thickened_ground"), 1);
  EXPECT_EQ(report(sheet, {"--up", "y"}).at("repairs").at(0).at("thickened_walls"), 1) << "upright then";
}

TEST_F(SceneCommandTest, MistakesAreReported) {
  EXPECT_THAT(Repair({"--out", "closed.blend"}).err, HasSubstr("NAME.ply"));
  EXPECT_THAT(Repair({"--out", "open.obj"}).err, HasSubstr("--out"));
  EXPECT_THAT(Repair({"--out", "a.ply", "--up", "x"}).err, HasSubstr("--up"));
  EXPECT_THAT(Repair({"--out", "a.ply", "--weld", "-1"}).err, HasSubstr("--weld"));
  EXPECT_THAT(Repair({"--out", "a.ply", "--thickness", "0"}).err, HasSubstr("--thickness"));
  EXPECT_THAT(RunLegopt({"scene", "repair", "none.obj", "--out", "a.ply"}, folder_.path()).err,
              HasSubstr("no such file"));
  EXPECT_FALSE(fs::exists(folder_.path() / "a.ply"));
}

}  // namespace
}  // namespace legopt::client
