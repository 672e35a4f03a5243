// Policy: every check detects its fault when planted in a small, otherwise valid dataset, and reports nothing for the
// unchanged dataset.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "legopt/dataset/internal/dataset_content.h"
#include "legopt/geometry/internal/mesh_bodies.h"
#include "legopt/geometry/internal/scene_solids.h"
#include "legopt/import/internal/dataset_check.h"
#include "legopt/import/internal/used_contacts.h"
#include "tests/dataset/synthetic_dataset.h"
#include "tests/import/clone_folder.h"

namespace legopt {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;
using Severity = DatasetDiagnostic::Severity;

TriangleMesh BoxMesh(const Eigen::Vector3d& size, const Eigen::Vector3d& centre) {
  ShapeSpec box;
  box.size = size;
  box.pose.translation() = centre;
  return Tessellate(box);
}

/// Returns the findings of one check.
std::vector<DatasetDiagnostic> Of(const std::vector<DatasetDiagnostic>& findings, const std::string& check) {
  std::vector<DatasetDiagnostic> found;
  std::copy_if(findings.begin(), findings.end(), std::back_inserter(found),
               [&](const DatasetDiagnostic& f) { return f.check == check && f.severity != Severity::kInfo; });
  return found;
}

class Checks : public testing::Test {
 protected:
  Checks() : synthetic_(folder_.path() / "dataset") {}

  std::vector<DatasetDiagnostic> CheckWith(const std::string& file, const std::string& from, const std::string& to) {
    test::ReplaceInFile(synthetic_.path() / file, from, to);
    return CheckAll();
  }
  std::vector<DatasetDiagnostic> CheckAll() {
    WriteManifestHashes(synthetic_.path());
    return CheckDataset(*Dataset::Load(synthetic_.path()));
  }
  /// Replaces the rock of the scene by another closed box.
  void WriteRock(const std::string& faces) {
    test::WriteText(synthetic_.path() / "meshes" / "rock.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n" + faces);
  }

  test::TemporaryFolder folder_;
  test::SyntheticFolder synthetic_;
};

constexpr const char* kRightFoot = "r_foot,1 0 0 0 0 -0.1 0 ,\"]},";  // contact of posture problem 0

TEST_F(Checks, NothingIsFoundInADatasetThatIsInOrder) {
  const std::vector<DatasetDiagnostic> findings = CheckAll();
  EXPECT_GE(findings.size(), 7U) << "every check says that it looked";
  for (const DatasetDiagnostic& f : findings) EXPECT_EQ(f.severity, Severity::kInfo) << f.check << ": " << f.message;
}

TEST_F(Checks, ExtentsOfEveryMeshAreListed) {
  WriteRock("f 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n");
  const std::vector<DatasetDiagnostic> findings = CheckAll();
  const auto sizes = std::find_if(findings.begin(), findings.end(),
                                  [](const auto& f) { return f.check == "mesh sizes" && f.field == "scene"; });
  ASSERT_NE(sizes, findings.end());
  EXPECT_EQ(sizes->value, "1 mesh");
  EXPECT_THAT(sizes->message, HasSubstr("in metres: rock "));
}

TEST_F(Checks, HoveringFeetAreNamedWithTheirHeightAndProblems) {
  const auto findings =
      Of(CheckWith("problems-posture.json", kRightFoot, "r_foot,1 0 0 0 0 -0.1 0.051 ,\"]},"), "hovering feet");
  ASSERT_EQ(findings.size(), 1U);
  EXPECT_EQ(findings[0].field, "posture 0");
  EXPECT_THAT(findings[0].value, HasSubstr("51.0 mm"));
  EXPECT_THAT(findings[0].message, HasSubstr("sole offset"));
}

TEST_F(Checks, SunkFeetCollideAtTheirTarget) {
  const auto findings = CheckWith("problems-posture.json", kRightFoot, "r_foot,1 0 0 0 0 -0.1 -0.02 ,\"]},");
  ASSERT_EQ(Of(findings, "sunk feet").size(), 1U);
  EXPECT_THAT(Of(findings, "sunk feet")[0].value, HasSubstr("-20.0 mm"));
  ASSERT_EQ(Of(findings, "feet in collision").size(), 1U);
  EXPECT_EQ(Of(findings, "feet in collision")[0].field, "posture 0");
}

TEST_F(Checks, FeetBesideTheSceneHaveNoSurface) {
  const auto findings =
      Of(CheckWith("problems-posture.json", kRightFoot, "r_foot,1 0 0 0 0 -50 0 ,\"]},"), "feet on surfaces");
  ASSERT_EQ(findings.size(), 1U);
  EXPECT_THAT(findings[0].message, HasSubstr("no surface"));
}

TEST_F(Checks, ProblemsOfAnotherSceneAreAnError) {
  const auto findings = CheckWith("scene.yaml", "position: [0, 0, -0.25]", "position: [0, 0, -0.4]");
  EXPECT_TRUE(AnyError(Of(findings, "feet on surfaces")));
}

TEST_F(Checks, ASoleOverAnEdgeIsSeen) {
  // Contact patches reach from x = -0.07 to 0.13, in nine rows of points. Ground that begins at -0.02 supports seven
  // of them, ground that begins at -0.01 six.
  const auto most = CheckWith("scene.yaml", "position: [0, 0, -0.25]", "position: [9.98, 0, -0.25]");
  EXPECT_THAT(Of(most, "soles"), IsEmpty());
  const auto less = Of(CheckWith("scene.yaml", "position: [9.98, 0, -0.25]", "position: [9.99, 0, -0.25]"), "soles");
  ASSERT_EQ(less.size(), 1U);
  EXPECT_EQ(less[0].field, "posture 0, 7; motion 0");
}

TEST_F(Checks, ATrunkInAnObstacleIsNamed) {
  const auto findings =
      Of(CheckWith("scene.yaml", "position: [0, 0.6, 1]", "position: [0, 0.1, 1.2]"), "trunk in collision");
  ASSERT_EQ(findings.size(), 2U) << "one for postures, one for motions";
  EXPECT_EQ(findings[0].field, "posture 0, 7");
  EXPECT_THAT(findings[0].message, HasSubstr("trunk (2)"));
}

TEST_F(Checks, InvertedBodiesAndHolesOfTheSceneAreErrors) {
  WriteRock("f 1 2 3\nf 1 4 2\nf 1 3 4\nf 2 4 3\n");
  const auto inverted = Of(CheckAll(), "winding");
  ASSERT_EQ(inverted.size(), 1U);
  EXPECT_EQ(inverted[0].severity, Severity::kError);
  EXPECT_EQ(inverted[0].file, "meshes/rock.obj");
  EXPECT_EQ(inverted[0].field, "rock");
  EXPECT_THAT(inverted[0].value, HasSubstr("1 of 1"));
  WriteRock("f 1 3 2\nf 1 2 4\nf 1 4 3\n");
  const auto open = Of(CheckAll(), "holes");
  ASSERT_EQ(open.size(), 1U);
  EXPECT_EQ(open[0].severity, Severity::kError);
  EXPECT_THAT(open[0].value, HasSubstr("3 of 6 edges"));
}

TEST(MeshFaults, InvertedComponentsAreTurnedRound) {
  const TriangleMesh box = BoxMesh({1, 2, 3}, {0, 0, 0});
  TriangleMesh two = box;
  for (const auto& [a, b, c] : box.triangles) two.triangles.push_back({a + 8, c + 8, b + 8});
  for (const Eigen::Vector3d& v : box.vertices) two.vertices.push_back(v + Eigen::Vector3d(5, 0, 0));
  EXPECT_EQ(FindMeshFaults(two).components, 2);
  EXPECT_EQ(FindMeshFaults(two).inverted_components, 1);
  EXPECT_TRUE(FindMeshFaults(FlipInvertedComponents(two)).none());
  EXPECT_EQ(FlipInvertedComponents(two).triangles.size(), two.triangles.size());
}

TEST(MeshFaults, AnOpenSheetIsNotInverted) {
  TriangleMesh sheet;
  sheet.vertices = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0.3}, {0, 1, 0}};
  sheet.triangles = {{0, 2, 1}, {0, 3, 2}};
  const MeshFaults faults = FindMeshFaults(sheet);
  EXPECT_EQ(faults.open_components, 1);
  EXPECT_EQ(faults.inverted_components, 0);
}

class QuaternionOrder : public testing::Test {
 protected:
  /// Returns contacts on flat ground that turn in steps of 30 degrees, as w x y z or as x y z w.
  static UsedContactList UsedContacts(bool x_first) {
    std::vector<ProblemDefinition> problems;
    for (int k = 0; k < 12; ++k) {
      const double half = 0.5 * k * M_PI / 6.0;
      const Eigen::Quaterniond right(std::cos(half), 0, 0, std::sin(half));
      // Numbers x y z w, interpreted as w x y z.
      const Eigen::Quaterniond wrong(0, 0, std::sin(half), std::cos(half));
      problems.push_back({k, {{{ContactTarget{"foot", Eigen::Vector3d::Zero(), x_first ? wrong : right}}}}});
    }
    UsedContactList contacts;
    contacts.Add(Task::kPosture, problems);
    return contacts;
  }
  const Terrain terrain_{BoxMesh({2, 2, 1}, {0, 0, -0.5})};
};

TEST_F(QuaternionOrder, IsDecidedByTheNormals) {
  const QuaternionEvidence w = CollectQuaternionEvidence(UsedContacts(false).all(), terrain_);
  EXPECT_EQ(w.verdict(), QuaternionEvidence::Verdict::kWFirst) << w.Describe();
  EXPECT_EQ(w.agree_w_first, 12);
  const QuaternionEvidence x = CollectQuaternionEvidence(UsedContacts(true).all(), terrain_);
  EXPECT_EQ(x.verdict(), QuaternionEvidence::Verdict::kXFirst) << x.Describe();
  EXPECT_EQ(x.agree_x_first, 12);
  EXPECT_EQ(DiagnoseQuaternionOrder(x).severity, Severity::kError);
}

TEST_F(QuaternionOrder, ReadingTheOtherWayGivesTheRotationThatWasMeant) {
  const UsedContactList right = UsedContacts(false), wrong = UsedContacts(true);
  for (size_t k = 0; k < right.all().size(); ++k) {
    EXPECT_TRUE(ReadAsXFirst(wrong.all()[k].target.rotation).isApprox(right.all()[k].target.rotation)) << k;
  }
}

TEST_F(QuaternionOrder, PosesOfNoOrderAreAnError) {
  std::vector<ProblemDefinition> problems = {
      {0, {{{ContactTarget{"foot", Eigen::Vector3d::Zero(), Eigen::Quaterniond(0.5, 0.5, 0.5, 0.5)}}}}}};
  UsedContactList contacts;
  contacts.Add(Task::kPosture, problems);
  const QuaternionEvidence evidence = CollectQuaternionEvidence(contacts.all(), terrain_);
  EXPECT_EQ(evidence.verdict(), QuaternionEvidence::Verdict::kNeither);
  EXPECT_EQ(DiagnoseQuaternionOrder(evidence).severity, Severity::kError);
}

TEST(ProblemIds, AreWrittenAsRanges) {
  EXPECT_EQ(ToString(ProblemIds{{Task::kPosture, {3, 33, 38, 39}}, {Task::kMotion, {0, 1, 2}}}),
            "posture 3, 33, 38-39; motion 0-2");
  EXPECT_EQ(ToString(ProblemIds{}), "");
}

}  // namespace
}  // namespace legopt
