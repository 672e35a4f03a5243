#include "legopt/worldgen/internal/picture.h"

#include <gtest/gtest.h>

#include "legopt/worldgen/internal/collapse.h"
#include "tests/dataset/test_data.h"

namespace legopt::worldgen {
namespace {

Drawing RedCube() {
  Building building;
  BuildingParts(&building).Box("cube", {-1, -1, -1}, {1, 1, 1}, Material::kConcrete, 0.0);
  building.plan = {Eigen::Vector2d(-1, -1), Eigen::Vector2d(1, 1)};
  Snapshot snapshot;
  snapshot.cells.resize(1);
  Drawing drawing;
  drawing.mesh = MeshOf(PiecesOf(building, {WholeCell(building.members[0], 0)}, snapshot), &drawing.parts);
  drawing.colours.assign(drawing.mesh.triangles.size(), Colour{200, 20, 20});
  return drawing;
}

TEST(Picture, CubeStandsInTheMiddle) {
  const Camera camera{.eye = {-8, -3, 2}, .target = {0, 0, 0}, .width = 80, .height = 60};
  const Picture picture = Render(RedCube(), camera);
  ASSERT_EQ(picture.rgb.size(), 80u * 60u * 3u);
  const auto pixel = [&](size_t x, size_t y) { return &picture.rgb[(y * 80 + x) * 3]; };
  EXPECT_GT(pixel(40, 30)[0], 3 * pixel(40, 30)[1]);  // red
  EXPECT_GT(pixel(2, 2)[2], pixel(2, 2)[0]);          // sky
}

TEST(Picture, CutOpensTheCube) {
  const Camera whole{.eye = {-8, -3, 6}, .target = {0, 0, 0}, .width = 80, .height = 60};
  Camera cut = whole;
  cut.cut_m = 0.0;
  EXPECT_NE(Render(RedCube(), whole).rgb, Render(RedCube(), cut).rgb);
}

TEST(Picture, PngStartsAsOneAndUnwritablePathIsAnError) {
  const test::TemporaryFolder folder;
  const Picture picture = Render(RedCube(), {.width = 8, .height = 8});
  WritePng(folder.path() / "cube.png", picture);
  EXPECT_EQ(test::ReadText(folder.path() / "cube.png").substr(1, 3), "PNG");
  EXPECT_NE(test::MessageOf([&] { WritePng(folder.path() / "missing" / "cube.png", picture); }).find("cube.png"),
            std::string::npos);
}

}  // namespace
}  // namespace legopt::worldgen
