// Policy: a mesh is found where its name says, or by a fallback that is named; an ambiguous or absent one is not found.
#include "legopt/robot/internal/mesh_lookup.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/dataset/test_data.h"

namespace legopt {
namespace {

using testing::AllOf;
using testing::HasSubstr;

/// A workspace with the package "walker": walker/urdf for the URDF, walker/meshes/visual/Foot.stl and others.
class MeshLookup : public testing::Test {
 protected:
  MeshLookup() {
    std::filesystem::create_directories(urdf_);
    for (const char* file : {"meshes/visual/Foot.stl", "meshes/leg one.stl", "meshes/twice.stl", "meshes/TWICE.stl"}) {
      test::WriteText(root_ / file, "solid");
    }
  }

  // Returns the file relative to the package, or "absent".
  std::string Found(const std::string& name) const {
    const auto mesh = FindMesh(name, urdf_);
    return mesh ? mesh->path.lexically_relative(root_).generic_string() : "absent";
  }
  std::string Fallback(const std::string& name) const {
    const auto mesh = FindMesh(name, urdf_);
    return mesh ? mesh->fallback : "absent";
  }

  test::TemporaryFolder folder_;
  std::filesystem::path root_ = folder_.path() / "walker";
  std::filesystem::path urdf_ = root_ / "urdf";
};

TEST_F(MeshLookup, ExactNamesNeedNoFallback) {
  const std::string absolute = (root_ / "meshes/visual/Foot.stl").string();
  for (const std::string& name :
       {std::string("../meshes/visual/Foot.stl"), std::string("package://walker/meshes/visual/Foot.stl"),
        std::string("model://walker/meshes/visual/Foot.stl"), absolute, "file://" + absolute}) {
    EXPECT_EQ(Found(name), "meshes/visual/Foot.stl") << name;
    EXPECT_EQ(Fallback(name), "") << name;
  }
}

TEST_F(MeshLookup, FallbacksAreNamed) {
  EXPECT_EQ(Found("..\\meshes\\visual\\Foot.stl"), "meshes/visual/Foot.stl");
  EXPECT_THAT(Fallback("..\\meshes\\visual\\Foot.stl"), HasSubstr("'/'"));
  EXPECT_EQ(Found("../meshes/leg%20one.stl"), "meshes/leg one.stl");
  EXPECT_THAT(Fallback("../meshes/leg%20one.stl"), HasSubstr("%XX"));
  EXPECT_EQ(Found("package://old_name/meshes/visual/Foot.stl"), "meshes/visual/Foot.stl");
  EXPECT_THAT(Fallback("package://old_name/meshes/visual/Foot.stl"), HasSubstr("end of its path"));
  EXPECT_EQ(Found("package:///old_name/meshes/visual/Foot.stl"), "meshes/visual/Foot.stl");
  EXPECT_EQ(Found("package:///walker/meshes/visual/Foot.stl"), "meshes/visual/Foot.stl");
  EXPECT_THAT(Fallback("package:///walker/meshes/visual/Foot.stl"), HasSubstr("name of a package"));
  EXPECT_EQ(Found("../Meshes/VISUAL/foot.STL"), "meshes/visual/Foot.stl");
  EXPECT_THAT(Fallback("../Meshes/VISUAL/foot.STL"), HasSubstr("case"));
}

TEST_F(MeshLookup, AllChangesOfANameAreNamed) {
  const std::string name = "package://old_name\\Meshes\\visual\\Foot%2Estl";
  EXPECT_EQ(Found(name), "meshes/visual/Foot.stl");
  EXPECT_THAT(Fallback(name),
              AllOf(HasSubstr("'/'"), HasSubstr("%XX"), HasSubstr("case"), HasSubstr("end of its path")));
}

TEST_F(MeshLookup, AFolderWithAnEqualNameDoesNotHideTheOnlyFile) {
  test::WriteText(root_ / "MESHES" / "other.stl", "solid");
  EXPECT_EQ(Found("../Meshes/visual/foot.stl"), "meshes/visual/Foot.stl");
}

TEST_F(MeshLookup, AbsentAndAmbiguousFilesAreNotFound) {
  for (const char* name : {"../meshes/gone.stl", "package://walker/gone.stl", "../meshes/Twice.stl", "", "%", "%2",
                           "package://", "../meshes", "/nonexistent/Foot.stl"}) {
    EXPECT_EQ(Found(name), "absent") << name;
  }
}

}  // namespace
}  // namespace legopt
