// Policy: each format of height maps gives the same small grid, and its solid has the volume computed by hand.

#include "legopt/geometry/internal/height_map.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <png.h>

#include <fstream>

#include "legopt/geometry/internal/mesh_repair.h"
#include "legopt/types/input_error.h"
#include "tests/temporary_folder.h"

namespace legopt {
namespace {

using testing::HasSubstr;

class HeightMapTest : public testing::Test {
 protected:
  std::string Write(const std::string& name, const std::string& bytes) {
    const std::string path = (folder_.path() / name).string();
    std::ofstream(path, std::ios::binary) << bytes;
    return path;
  }
  std::string Message(const std::string& path) {
    try {
      ReadHeightGrid(path);
    } catch (const InputError& error) {
      return error.what();
    }
    return "";
  }
  test::TemporaryFolder folder_;
};

// 3 x 2 values; the first row has the larger y.
TEST_F(HeightMapTest, EveryFormatIsRead) {
  const std::vector<double> expected = {0.0, 0.2, 0.4, 0.6, 0.8, 1.0};
  const auto expect = [&](const std::string& path, double tolerance) {
    const HeightGrid grid = ReadHeightGrid(path);
    EXPECT_EQ(grid.columns, 3);
    EXPECT_EQ(grid.rows, 2);
    ASSERT_EQ(grid.heights_m.size(), expected.size());
    for (size_t i = 0; i < expected.size(); ++i) EXPECT_NEAR(grid.heights_m[i], expected[i], tolerance) << path;
  };
  expect(Write("a.txt", "# heights\n0 0.2 0.4\n\n0.6\t0.8 1\n"), 0.0);
  expect(Write("a.CSV", "0,0.2;0.4\r\n0.6, 0.8, 1"), 0.0);
  expect(Write("a.pgm", "P2\n# a comment\n3 2 255\n0 51 102 153 204 255\n"), 1e-12);
  expect(Write("b.pgm", std::string("P5 3 2 255\n") + '\0' + "\x33\x66\x99\xCC\xFF"), 1e-12);
  expect(Write("c.pgm", std::string("P5 3 2 65535\n") + '\0' + '\0' + "\x33\x33\x66\x66\x99\x99\xCC\xCC\xFF\xFF"),
         1e-12);
  const std::vector<std::uint8_t> grey = {0, 51, 102, 153, 204, 255};
  std::vector<std::uint8_t> rgb;
  for (const std::uint8_t value : grey) rgb.insert(rgb.end(), {value, value, value});
  for (const bool colour : {false, true}) {
    png_image image{};
    image.version = PNG_IMAGE_VERSION;
    image.width = 3;
    image.height = 2;
    image.format = colour ? PNG_FORMAT_RGB : PNG_FORMAT_GRAY;
    const std::string path = (folder_.path() / (colour ? "rgb.png" : "grey.png")).string();
    ASSERT_NE(png_image_write_to_file(&image, path.c_str(), 0, colour ? rgb.data() : grey.data(), 0, nullptr), 0);
    expect(path, colour ? 0.005 : 1e-12);
  }
}

TEST_F(HeightMapTest, TheSolidIsClosedAndStandsOnAFloor) {
  const TriangleMesh flat = LoadMesh(Write("flat.txt", "1 1 1\n1 1 1\n1 1 1\n1 1 1\n"), {4.0, 6.0, 2.0});
  EXPECT_TRUE(FindMeshFaults(flat).none());
  EXPECT_NEAR(EnclosedVolume(flat), 4.0 * 6.0 * 0.5, 1e-12);
  EXPECT_TRUE(RepairMesh(flat, {}).counts.none());
  // A ramp along y from 0 to 1 m, highest in the first row.
  const TriangleMesh ramp = LoadMesh(Write("ramp.txt", "1 1\n0.5 0.5\n0 0\n"), {2.0, 2.0, 1.0});
  EXPECT_TRUE(FindMeshFaults(ramp).none());
  EXPECT_NEAR(EnclosedVolume(ramp), 2.0 * 2.0 * (0.5 + 0.5), 1e-12);
  for (const Eigen::Vector3d& v : ramp.vertices) {
    EXPECT_TRUE(v.z() < 0.9 || v.y() == 1.0);
  }
}

TEST_F(HeightMapTest, FaultsAreReported) {
  EXPECT_THAT(Message(Write("a.txt", "0 1\n0 1 2\n")), HasSubstr("the first row has 2"));
  EXPECT_THAT(Message(Write("b.txt", "0 1\n0 one\n")), HasSubstr("line 2"));
  EXPECT_THAT(Message(Write("c.txt", "0 1\n0 nan\n")), HasSubstr("no finite number"));
  EXPECT_THAT(Message(Write("d.txt", "0 1 2\n")), HasSubstr("3 x 1"));
  EXPECT_THAT(Message(Write("e.pgm", "P5 3 2 255\nab")), HasSubstr("ends early"));
  EXPECT_THAT(Message(Write("f.pgm", "P6 3 2 255\nab")), HasSubstr("P2 or P5"));
  EXPECT_THAT(Message(Write("g.pgm", "P2 3000 2 255\n0")), HasSubstr("2049"));
  EXPECT_THAT(Message(Write("h.pgm", "P2 2 2 100\n0 1 2 101")), HasSubstr("larger"));
  EXPECT_THAT(Message(Write("i.png", "no picture")), HasSubstr("no PNG"));
}

}  // namespace
}  // namespace legopt
