// Policy: Gazebo worlds written here become scenes with shapes at the poses that the nesting gives.

#include "legopt/import/internal/sdf_world.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "app/isolated_call.h"
#include "legopt/dataset/scene_file.h"
#include "legopt/geometry/internal/scene_solids.h"
#include "legopt/import/scene_repair.h"
#include "tests/dataset/synthetic_dataset.h"
#include "tests/dataset/test_data.h"

namespace legopt {
namespace {

using test::MessageOf;
using testing::HasSubstr;

class SdfWorldTest : public testing::Test {
 protected:
  std::filesystem::path Write(const std::string& models, const std::string& name = "scene.world") {
    test::WriteText(folder_.path() / name,
                    "<?xml version=\"1.0\"?><sdf version=\"1.6\"><world name=\"w\">" + models + "</world></sdf>");
    return folder_.path() / name;
  }
  static std::string Model(const std::string& geometry, const std::string& pose = "0 0 0 0 0 0") {
    return "<model name=\"m\"><static>true</static><pose>" + pose +
           "</pose><link name=\"l\"><pose>0 0 1 0 0 0</pose><collision name=\"c\"><geometry>" + geometry +
           "</geometry></collision></link></model>";
  }
  test::TemporaryFolder folder_;
};

TEST_F(SdfWorldTest, ShapesHaveTheirPoses) {
  const auto path =
      Write("<include><uri>model://ground_plane</uri></include><include><uri>model://sun</uri></include>" +
            Model("<box><size>0.4 0.6 1</size></box>", "1 2 0.5 0 0 1.5707963267948966"));
  for (const ReadGuard& guard : {ReadGuard(), ReadGuard(CallIsolated)}) {
    const Scene scene = ReadSdfWorld(path, guard);
    ASSERT_EQ(scene.objects.size(), 2U);
    const SceneObject& ground = scene.objects[scene.objects[0].name == "m/l/c" ? 1 : 0];
    const SceneObject& box = scene.objects[scene.objects[0].name == "m/l/c" ? 0 : 1];
    EXPECT_EQ(ground.name, "ground_plane/link/collision");
    EXPECT_EQ(ground.shape.size, Eigen::Vector3d(100, 100, 0.5));
    EXPECT_TRUE(ground.shape.pose.translation().isApprox(Eigen::Vector3d(0, 0, -0.25)));
    EXPECT_EQ(box.shape.size, Eigen::Vector3d(0.4, 0.6, 1));
    EXPECT_TRUE(box.shape.pose.translation().isApprox(Eigen::Vector3d(1, 2, 1.5)));
    EXPECT_TRUE((box.shape.pose.linear() * Eigen::Vector3d::UnitX()).isApprox(Eigen::Vector3d::UnitY()));
  }
}

TEST_F(SdfWorldTest, EveryKindOfShapeIsRead) {
  const auto kind = [&](const std::string& geometry) {
    return ReadSdfWorld(Write(Model(geometry)), CallIsolated).objects.at(0).shape;
  };
  EXPECT_EQ(kind("<sphere><radius>0.3</radius></sphere>").kind, ShapeSpec::Kind::kSphere);
  const ShapeSpec cylinder = kind("<cylinder><radius>0.3</radius><length>2</length></cylinder>");
  EXPECT_EQ(cylinder.kind, ShapeSpec::Kind::kCylinder);
  EXPECT_EQ(cylinder.size, Eigen::Vector3d(0.3, 0, 2));
  EXPECT_EQ(kind("<capsule><radius>0.3</radius><length>2</length></capsule>").kind, ShapeSpec::Kind::kCapsule);
  const ShapeSpec plane = kind("<plane><normal>0 0 1</normal><size>2 2</size></plane>");
  EXPECT_EQ(plane.size, Eigen::Vector3d(40, 40, 0.5));
  EXPECT_NEAR(plane.pose.translation().z(), 0.75, 1e-12);
}

TEST_F(SdfWorldTest, MeshesAndModelsAreFoundBesideTheWorld) {
  std::filesystem::create_directories(folder_.path() / "models" / "rock");
  test::WriteText(folder_.path() / "models" / "rock" / "rock.obj",
                  "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n");
  test::WriteText(folder_.path() / "models" / "rock" / "model.config",
                  "<?xml version=\"1.0\"?><model><name>rock</name><sdf version=\"1.6\">model.sdf</sdf></model>");
  test::WriteText(folder_.path() / "models" / "rock" / "model.sdf",
                  "<sdf version=\"1.6\"><model name=\"rock\"><link name=\"l\"><collision name=\"c\"><geometry><mesh>"
                  "<uri>model://rock/rock.obj</uri><scale>2 2 2</scale></mesh></geometry></collision></link></model>"
                  "</sdf>");
  const auto path = Write("<include><uri>model://rock</uri><pose>3 0 0 0 0 0</pose></include>");
  const RebuiltScene scene = RebuildScene(path, {.repair = true, .read_guard = CallIsolated});
  ASSERT_EQ(scene.objects.size(), 1U);
  EXPECT_NEAR(scene.objects[0].mesh->volume_m3, 8.0 / 6.0, 1e-5);
  WriteSceneYaml(scene, folder_.path() / "out.yaml", "meshes");
  EXPECT_EQ(CollectSceneTriangles(ReadSceneFile(folder_.path() / "out.yaml")).triangles.size(), 4U);
}

TEST_F(SdfWorldTest, FaultsAreReported) {
  const auto message = [&](const std::string& models) {
    const auto path = Write(models);
    return MessageOf([&] { ReadSdfWorld(path, CallIsolated); });
  };
  EXPECT_THAT(message("<model"), HasSubstr("not valid XML"));
  EXPECT_THAT(message(""), HasSubstr("no collision shape"));
  EXPECT_THAT(message("<include><uri>model://nowhere</uri></include>"), HasSubstr("nowhere"));
  EXPECT_THAT(message(Model("<mesh><uri>model://a/b.stl</uri></mesh>")), HasSubstr("model://a/b.stl"));
  EXPECT_THAT(message(Model("<ellipsoid><radii>1 2 3</radii></ellipsoid>")), HasSubstr("of a kind"));
}

}  // namespace
}  // namespace legopt
