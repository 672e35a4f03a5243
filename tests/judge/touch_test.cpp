// Policy: a contact touches where the meshes touch, whatever the contact's description says. Robots with a wrong
// description that satisfy all other checks are found; contacts without declared points are only reported.
#include "legopt/judge/internal/touch.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "legopt/dataset/internal/dataset_content.h"
#include "legopt/geometry/internal/exact_collision.h"
#include "legopt/judge/judge.h"
#include "legopt/robot/kinematics.h"
#include "tests/dataset/synthetic_dataset.h"
#include "tests/dataset/test_data.h"

namespace legopt {
namespace {

using testing::HasSubstr;

constexpr const char* kSoles =
    "points: [[-0.07, -0.05, 0], [0.13, -0.05, 0], [0.13, 0.05, 0], [-0.07, 0.05, 0]]";  // of the boxes

/// The synthetic robot, whose soles are 50 mm below the foot frames, standing 1 mm above the ground.
class Touch : public testing::Test {
 protected:
  void Replace(const std::string& file, const std::string& text, const std::string& by) {
    test::ReplaceInFile(folder_.path() / file, text, by);
  }

  /// Declares both contacts, with a frame `offset_m` below the link frame and more of a contact's keys.
  void Declare(double offset_m, const std::string& keys, const std::string& rpy = "[0, 0, 0]") {
    std::string contacts = "contacts:\n";
    for (const std::string name : {"l_foot", "r_foot"}) {
      contacts += "  " + name + ": {link: " + name + ", kind: sole, frame: {position: [0, 0, " +
                  std::to_string(-offset_m) + "], rpy: " + rpy + "}" + (keys.empty() ? "" : ", " + keys) + "}\n";
    }
    Replace("dataset.yaml", "format: legopt-dataset/1", "format: legopt-dataset/2");
    Replace("dataset.yaml", "feet: [l_foot, r_foot]\n", contacts);
    Replace("dataset.yaml", "sole_offset_m: 0.051\n", "");
  }

  Evaluation Judged(const Eigen::VectorXd& x) {
    WriteManifestHashes(folder_.path());
    dataset_ = Dataset::Load(folder_.path());
    Judge judge(dataset_);
    return judge.Evaluate(Task::kPosture, dataset_->problem(Task::kPosture, 0), {&x, 1});
  }

  /// Standing upright, higher by this much.
  static Eigen::VectorXd Raised(double height_m) {
    Eigen::VectorXd x = test::StandingUpright();
    x[test::kSyntheticDofs + 2] += height_m;
    return x;
  }

  test::TemporaryFolder folder_;
  test::SyntheticFolder files_{folder_.path()};
  std::shared_ptr<const Dataset> dataset_;
};

TEST_F(Touch, SolesOneMillimetreAboveTheGroundTouch) {
  Declare(0.051, kSoles);
  const Evaluation evaluation = Judged(test::StandingUpright());
  EXPECT_EQ(evaluation.solid, Verdict::kSuccess) << evaluation.detail;
  EXPECT_NEAR(evaluation.Largest(Verdict::kTouch, Rule::kSolid), 1e-3, 1e-9);
  EXPECT_EQ(evaluation.Largest(Verdict::kCom, Rule::kSolid), 0.0);
}

TEST_F(Touch, AWrongSoleHeightHovers) {
  Declare(0.101, kSoles);
  const Evaluation evaluation = Judged(Raised(0.05));
  EXPECT_EQ(evaluation.literal, Verdict::kSuccess) << evaluation.detail;
  EXPECT_EQ(evaluation.strict, Verdict::kSuccess);
  EXPECT_EQ(evaluation.solid, Verdict::kTouch);
  EXPECT_NEAR(evaluation.Largest(Verdict::kTouch, Rule::kSolid), 0.051, 1e-9);
  EXPECT_THAT(evaluation.detail, HasSubstr("l_foot does not touch the scene"));
  EXPECT_THAT(evaluation.detail, HasSubstr("51 mm"));
}

TEST_F(Touch, WithoutDeclaredPointsItIsOnlyReported) {
  Replace("dataset.yaml", "sole_offset_m: 0.051", "sole_offset_m: 0.101");
  const Evaluation evaluation = Judged(Raised(0.05));
  EXPECT_EQ(evaluation.solid, Verdict::kSuccess);
  EXPECT_NEAR(evaluation.Largest(Verdict::kTouch, Rule::kSolid), 0.051, 1e-9);
  EXPECT_THAT(evaluation.detail, HasSubstr("reported only"));
}

TEST_F(Touch, ATiltedSoleStandsOnAnEdge) {
  Declare(0.051, kSoles, "[0, 0.349, 0]");
  WriteManifestHashes(folder_.path());
  dataset_ = Dataset::Load(folder_.path());
  ExactCollision collision(dataset_->robot(), dataset_->scene(), dataset_->collision_model());
  TouchProbe probe(*dataset_, collision);
  const ContactTarget& target = dataset_->problem(Task::kPosture, 0).stances[0].contacts[0];
  const Contact& contact = dataset_->contact(target.contact);
  const ContactTouch touch = probe.Measure(contact, NormalOf(target), contact.LinkTarget(target));
  EXPECT_GT(touch.gap_m, 0.01);
}

// A spur behind the sole, 20 mm above it, is a fifth of the box. The centre of mass over it has no support.
TEST_F(Touch, TheSupportPolygonIsOfWhatTouches) {
  const std::string spur =
      "<collision><origin xyz='-0.095 0 -0.02'/><geometry><box size='0.05 0.1 0.02'/></geometry></collision>";
  for (int side = 0; side < 2; ++side) {
    Replace("robot.urdf", "<origin xyz='0.03 0 -0.03'/><geometry><box size='0.2 0.1 0.04'/></geometry></collision>",
            "<origin xyz='0.03 0 -0.03'/><geometry><box size='0.20 0.1 0.04'/></geometry></collision>" + spur);
  }
  Declare(0.051, "points: [[-0.12, -0.05, 0], [0.13, -0.05, 0], [0.13, 0.05, 0], [-0.12, 0.05, 0]]");
  Evaluation evaluation = Judged(test::Leaning(-0.2));
  EXPECT_EQ(evaluation.literal, Verdict::kSuccess) << evaluation.detail;
  EXPECT_EQ(evaluation.solid, Verdict::kCom) << evaluation.detail;
  EXPECT_NEAR(evaluation.Largest(Verdict::kTouch, Rule::kSolid), 1e-3, 1e-9);
  const double outside_m = evaluation.Largest(Verdict::kCom, Rule::kSolid);
  evaluation = Judged(test::Leaning(-0.1));
  EXPECT_EQ(evaluation.solid, Verdict::kSuccess) << evaluation.detail;
  EXPECT_GT(outside_m, 1e-3);
}

// The left foot is half over the edge of a step: half of its patch is far from any surface.
TEST_F(Touch, OverAnEdgeOnlyThePartAboveTheSurfaceTouches) {
  Declare(0.051, kSoles);
  Replace("scene.yaml", "size: [20, 20, 0.5], position: [0, 0, -0.25]",
          "size: [10.06, 20, 0.5], position: [-5, 0, -0.25]");
  WriteManifestHashes(folder_.path());
  dataset_ = Dataset::Load(folder_.path());
  ExactCollision collision(dataset_->robot(), dataset_->scene(), dataset_->collision_model());
  TouchProbe probe(*dataset_, collision);
  const Contact& contact = dataset_->contact("l_foot");
  Eigen::Isometry3d X_WL = Eigen::Isometry3d::Identity();
  X_WL.translation() = Eigen::Vector3d(0, 0.1, 0.051);
  const ContactTouch touch = probe.Measure(contact, Eigen::Vector3d::UnitZ(), X_WL);
  EXPECT_EQ(touch.gap_m, kFarGap_m);
  double farthest = -1.0;
  for (const Eigen::Vector2d& place : touch.places_W) farthest = std::max(farthest, place.x());
  EXPECT_NEAR(farthest, 0.03, 2e-4);
}

/// The synthetic robot on four balls per foot, whose lowest points are at the corners of a rectangle of 180 x 80 mm.
class TouchWithStuds : public Touch {
 protected:
  TouchWithStuds() {
    std::string studs = "<origin xyz='0.03 0 -0.01'/><geometry><box size='0.2 0.1 0.04'/></geometry></collision>";
    for (const char* place : {"0.12 0.04", "0.12 -0.04", "-0.06 0.04", "-0.06 -0.04"}) {
      studs += "<collision><origin xyz='" + std::string(place) +
               " -0.04'/><geometry><sphere radius='0.01'/></geometry></collision>";
    }
    const std::string box = "<origin xyz='0.03 0 -0.03'/><geometry><box size='0.2 0.1 0.04'/></geometry></collision>";
    for (int side = 0; side < 2; ++side) Replace("robot.urdf", box, studs);
  }

  /// Measures the left foot, 1 mm above the ground and higher by `raised_m`.
  ContactTouch MeasureLeft(double x_m, double raised_m = 0.0) {
    WriteManifestHashes(folder_.path());
    dataset_ = Dataset::Load(folder_.path());
    ExactCollision collision(dataset_->robot(), dataset_->scene(), dataset_->collision_model());
    TouchProbe probe(*dataset_, collision);
    Eigen::Isometry3d X_WL = Eigen::Isometry3d::Identity();
    X_WL.translation() = Eigen::Vector3d(x_m, 0.1, 0.051 + raised_m);
    return probe.Measure(dataset_->contact("l_foot"), Eigen::Vector3d::UnitZ(), X_WL);
  }

  static constexpr const char* kOutline =
      "points: [[-0.06, -0.04, 0], [0.12, -0.04, 0], [0.12, 0.04, 0], [-0.06, 0.04, 0]]";
};

TEST_F(TouchWithStuds, TheirPartsAreThePatch) {
  Declare(0.051, kOutline);
  const Evaluation evaluation = Judged(test::StandingUpright());
  EXPECT_EQ(evaluation.solid, Verdict::kSuccess) << evaluation.detail;
  EXPECT_LE(evaluation.Largest(Verdict::kTouch, Rule::kSolid), 2e-3);
  EXPECT_EQ(evaluation.Largest(Verdict::kCom, Rule::kSolid), 0.0);
  EXPECT_LE(MeasureLeft(0.0).gap_m, kTouchTolerance_m);
  EXPECT_GT(MeasureLeft(0.0, 2e-3).gap_m, kTouchTolerance_m) << "3 mm above the ground";
}

TEST_F(TouchWithStuds, HalfOfThemOverAnEdgeDoNotSuffice) {
  Declare(0.051, kOutline);
  Replace("scene.yaml", "size: [20, 20, 0.5], position: [0, 0, -0.25]",
          "size: [10.06, 20, 0.5], position: [-5, 0, -0.25]");  // the edge is at x = 0.03
  const ContactTouch half = MeasureLeft(0.0);
  EXPECT_EQ(half.gap_m, kFarGap_m);
  double farthest = -1.0;
  for (const Eigen::Vector2d& place : half.places_W) farthest = std::max(farthest, place.x());
  EXPECT_NEAR(farthest, -0.06, 7e-3) << "the hull of what touches ends at the hind studs";
  EXPECT_LE(MeasureLeft(-0.2).gap_m, kTouchTolerance_m) << "all of them are before the edge";
}

// The front bar has most of the area; the hind bar is over the edge.
TEST_F(Touch, OneOfTwoBarsDoesNotSuffice) {
  const auto box = [](const char* place, const char* size) {
    return "<origin xyz='" + std::string(place) + "'/><geometry><box size='" + size + "'/></geometry></collision>";
  };
  const std::string bars = box("0.03 0 -0.02", "0.2 0.1 0.04") + "<collision>" +
                           box("0.095 0 -0.045", "0.07 0.1 0.01") + "<collision>" +
                           box("-0.065 0 -0.045", "0.01 0.1 0.01");
  for (int side = 0; side < 2; ++side) {
    Replace("robot.urdf", "<origin xyz='0.03 0 -0.03'/><geometry><box size='0.2 0.1 0.04'/></geometry></collision>",
            bars);
  }
  Declare(0.051, kSoles);
  EXPECT_EQ(Judged(test::StandingUpright()).solid, Verdict::kSuccess);
  Replace("scene.yaml", "size: [20, 20, 0.5], position: [0, 0, -0.25]",
          "size: [10.06, 20, 0.5], position: [5, 0, -0.25]");  // the edge is at x = -0.03
  const Evaluation evaluation = Judged(test::StandingUpright());
  EXPECT_EQ(evaluation.literal, Verdict::kSuccess) << evaluation.detail;
  EXPECT_EQ(evaluation.solid, Verdict::kTouch);
}

// Ribs of 1.6 mm cover three fifths of the sole: most of the rest is not within 2 mm if the ribs are 1 mm above the
// ground, as at a target.
TEST_F(Touch, ASoleWithAProfileTouchesWithItsRibs) {
  std::string sole = "<origin xyz='0.03 0 -0.0292'/><geometry><box size='0.2 0.1 0.0384'/></geometry></collision>";
  for (const char* place : {"-0.055", "-0.02", "0.03", "0.08", "0.115"}) {
    sole += "<collision><origin xyz='" + std::string(place) +
            " 0 -0.045'/><geometry><box size='0.03 0.1 0.01'/></geometry></collision>";
  }
  for (int side = 0; side < 2; ++side) {
    Replace("robot.urdf", "<origin xyz='0.03 0 -0.03'/><geometry><box size='0.2 0.1 0.04'/></geometry></collision>",
            sole);
  }
  Declare(0.051, kSoles);
  const Evaluation evaluation = Judged(test::StandingUpright());
  EXPECT_EQ(evaluation.solid, Verdict::kSuccess) << evaluation.detail;
  EXPECT_NEAR(evaluation.Largest(Verdict::kTouch, Rule::kSolid), 1e-3, 1e-9);
  EXPECT_NEAR(Judged(Raised(4e-4)).Largest(Verdict::kTouch, Rule::kSolid), 1.4e-3, 1e-9);
}

TEST_F(TouchWithStuds, AnOutlineThatIsTooLargeKeepsTheWholePatch) {
  Declare(0.051, kSoles);  // 200 x 100 mm
  const Evaluation evaluation = Judged(test::StandingUpright());
  EXPECT_EQ(evaluation.solid, Verdict::kTouch);
  EXPECT_EQ(evaluation.literal, Verdict::kSuccess);
}

TEST(TriangleColumns, NoLineIsBetweenNeighbouringTriangles) {
  TriangleMesh square{{{0, 0, 1}, {1, 0, 1}, {1, 1, 2}, {0, 1, 2}}, {{{0, 1, 2}}, {{0, 2, 3}}}};
  TriangleColumns columns;
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.linear() = Eigen::AngleAxisd(0.7, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  for (int t = 0; t < 2; ++t) columns.Add(square, t, pose);
  for (int i = 0; i <= 100; ++i) {
    const Eigen::Vector3d p = pose * Eigen::Vector3d(i / 100.0, i / 100.0, 0);  // on the common edge
    EXPECT_NEAR(columns.Lowest(p.head<2>()), 1.0 + i / 100.0, 1e-9) << i;
    EXPECT_NEAR(columns.HighestBelow(p.head<2>(), 3.0), 1.0 + i / 100.0, 1e-9) << i;
    EXPECT_EQ(columns.HighestBelow(p.head<2>(), 0.5), -TriangleColumns::kNone);
  }
  EXPECT_EQ(columns.Lowest((pose * Eigen::Vector3d(1.001, 0.5, 0)).head<2>()), TriangleColumns::kNone);
}

}  // namespace
}  // namespace legopt
