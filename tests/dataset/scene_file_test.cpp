#include "legopt/dataset/scene_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/dataset/test_data.h"

namespace legopt {
namespace {

using test::MessageOf;
using test::WriteText;
using ::testing::AllOf;
using ::testing::HasSubstr;

class SceneFileTest : public testing::Test {
 protected:
  Scene Read(const std::string& text) {
    WriteText(folder_.path() / "scene.yaml", text);
    return ReadSceneFile(folder_.path() / "scene.yaml");
  }
  std::string Message(const std::string& text) {
    return MessageOf([&] { Read(text); });
  }
  test::TemporaryFolder folder_;
};

TEST_F(SceneFileTest, ReadsEveryShape) {
  WriteText(folder_.path() / "car.stl", "solid");
  const Scene scene = Read(R"(objects:
  - {name: a, shape: box, size: [1, 2, 3], position: [4, 5, 6], rpy: [0.1, 0.2, 0.3]}
  - {name: b, shape: sphere, radius: 0.5}
  - {name: c, shape: cylinder, radius: 0.5, length: 2}
  - {name: d, shape: capsule, radius: 0.25, length: 1}
  - {name: e, shape: mesh, file: car.stl, scale: [1, 2, 3]}
)");
  ASSERT_EQ(scene.objects.size(), 5u);
  const ShapeSpec& box = scene.objects[0].shape;
  EXPECT_EQ(box.kind, ShapeSpec::Kind::kBox);
  EXPECT_EQ(box.size, Eigen::Vector3d(1, 2, 3));
  EXPECT_EQ(box.pose.translation(), Eigen::Vector3d(4, 5, 6));
  // Fixed-axis roll, pitch, yaw: the x axis is rotated by pitch, then yaw.
  EXPECT_NEAR(box.pose.linear()(2, 0), -std::sin(0.2), 1e-15);
  EXPECT_NEAR(box.pose.linear()(1, 0), std::sin(0.3) * std::cos(0.2), 1e-15);
  EXPECT_NEAR(box.pose.linear()(2, 1), std::cos(0.2) * std::sin(0.1), 1e-15);
  EXPECT_EQ(scene.objects[1].shape.size.x(), 0.5);
  EXPECT_EQ(scene.objects[2].shape.kind, ShapeSpec::Kind::kCylinder);
  EXPECT_EQ(scene.objects[3].shape.size.z(), 1);
  EXPECT_EQ(scene.objects[4].shape.mesh_file, (folder_.path() / "car.stl").string());
  EXPECT_EQ(scene.objects[4].shape.scale, Eigen::Vector3d(1, 2, 3));
}

TEST_F(SceneFileTest, OneMeshIsAScene) {
  WriteText(folder_.path() / "garage.STL", "solid");
  const Scene scene = ReadSceneFile(folder_.path() / "garage.STL");
  ASSERT_EQ(scene.objects.size(), 1u);
  EXPECT_EQ(scene.objects[0].name, "garage");
  EXPECT_EQ(scene.objects[0].shape.kind, ShapeSpec::Kind::kMesh);
}

TEST_F(SceneFileTest, FaultsNameObjectKeyAndFix) {
  EXPECT_THAT(Message("objects:\n- {name: a, shape: bx, size: [1, 1, 1]}"),
              AllOf(HasSubstr("objects[0].shape"), HasSubstr("did you mean 'box'?")));
  EXPECT_THAT(Message("objects:\n- {name: a, shape: box, sise: [1, 1, 1]}"),
              AllOf(HasSubstr("sise: unknown key"), HasSubstr("did you mean 'size'?")));
  EXPECT_THAT(Message("objects:\n- {name: a, shape: box}"), HasSubstr("objects[0].size: the key is missing"));
  EXPECT_THAT(Message("objects:\n- {name: a, shape: box, size: [1, 1]}"), HasSubstr("three finite numbers"));
  EXPECT_THAT(Message("objects:\n- {name: a, shape: box, size: [1, -1, 1]}"), HasSubstr("greater than 0"));
  EXPECT_THAT(Message("objects:\n- {name: a, shape: box, size: [1, .nan, 1]}"), HasSubstr("finite"));
  EXPECT_THAT(Message("objects:\n- {name: a, shape: sphere, radius: 0}"), HasSubstr("greater than 0"));
  EXPECT_THAT(Message("objects:\n- {name: a, shape: mesh, file: none.stl}"), HasSubstr("does not exist"));
  EXPECT_THAT(Message("objects:\n- {name: a, shape: mesh, file: none.blend}"), HasSubstr("not a mesh file"));
  EXPECT_THAT(Message("objects:\n- {name: a, shape: sphere, radius: 1}\n- {name: a, shape: sphere, radius: 1}"),
              HasSubstr("used twice"));
  EXPECT_THAT(Message("objects: []"), HasSubstr("at least one"));
  EXPECT_THAT(Message("object: []"), HasSubstr("did you mean 'objects'?"));
  EXPECT_THAT(Message("- 1"), HasSubstr("must be a map"));
  EXPECT_THAT(Message("objects: [3]"), HasSubstr("must be a map"));
  EXPECT_THAT(Message("objects: ["), AllOf(HasSubstr("scene.yaml:1"), HasSubstr("not valid YAML")));
  EXPECT_THAT(MessageOf([&] { ReadSceneFile(folder_.path() / "none.yaml"); }), HasSubstr("cannot be read"));
}

std::string ColladaWith(const std::string& axis) {
  return "<COLLADA><asset>" + (axis.empty() ? "" : "<up_axis>" + axis + "</up_axis>") + "</asset></COLLADA>";
}

TEST_F(SceneFileTest, OtherFormatsAreNamed) {
  WriteText(folder_.path() / "a.fbx", std::string("Kaydara FBX Binary  \0", 21));
  EXPECT_THAT(MessageOf([&] { ReadSceneFile(folder_.path() / "a.fbx"); }),
              AllOf(HasSubstr(".fbx"), HasSubstr("export it as .stl")));
}

TEST_F(SceneFileTest, TheUpAxisOfAColladaMeshIsTurnedToZ) {
  for (const auto& [axis, up] :
       {std::pair("X_UP", Eigen::Vector3d::UnitX()), std::pair(" Y_UP\n", Eigen::Vector3d::UnitY()),
        std::pair("Z_UP", Eigen::Vector3d::UnitZ()), std::pair("", Eigen::Vector3d::UnitZ())}) {
    WriteText(folder_.path() / "slab.dae", ColladaWith(axis));
    const Scene listed =
        Read("objects:\n  - {name: a, shape: mesh, file: slab.dae, scale: [2, 3, 4], position: [1, 1, 1]}\n");
    const ShapeSpec& shape = listed.objects[0].shape;
    const Eigen::Vector3d scaled = shape.pose.linear() * shape.scale.cwiseProduct(Eigen::Vector3d(up));
    EXPECT_EQ(scaled, Eigen::Vector3d(0, 0, 4)) << axis << ": the scale multiplies the turned axes";
    EXPECT_EQ(shape.pose.linear().determinant(), 1.0) << axis;
    const Scene alone = ReadSceneFile(folder_.path() / "slab.dae");
    EXPECT_EQ(alone.objects[0].shape.pose.linear() * Eigen::Vector3d(up), Eigen::Vector3d::UnitZ()) << axis;
  }
}

TEST_F(SceneFileTest, AnUnknownUpAxisIsRefused) {
  WriteText(folder_.path() / "slab.dae", ColladaWith("W_UP"));
  EXPECT_THAT(MessageOf([&] { ReadSceneFile(folder_.path() / "slab.dae"); }),
              AllOf(HasSubstr("slab.dae"), HasSubstr("<up_axis>"), HasSubstr("W_UP"), HasSubstr("Y_UP")));
}

}  // namespace
}  // namespace legopt
