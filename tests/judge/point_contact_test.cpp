// Policy: a point contact constrains the centre of its ball and nothing else; it touches where the meshes touch, within
// 1 mm; the support of points is the hull of their lowest points.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "legopt/dataset/internal/dataset_content.h"
#include "legopt/geometry/internal/exact_collision.h"
#include "legopt/judge/internal/diagnostic.h"
#include "legopt/judge/internal/touch.h"
#include "legopt/judge/judge.h"
#include "legopt/robot/kinematics.h"
#include "tests/dataset/synthetic_dataset.h"
#include "tests/dataset/test_data.h"

namespace legopt {
namespace {

using testing::HasSubstr;

constexpr double kRadius_m = 0.03;
constexpr double kLowest_m = 0.05;  // of the ball below the foot frame

/// The synthetic robot on balls: contacts of kind point, 50 mm below the foot frames.
class PointContact : public testing::Test {
 protected:
  PointContact() {
    for (int side = 0; side < 2; ++side) {
      test::ReplaceInFile(folder_.path() / "robot.urdf",
                          "<origin xyz='0.03 0 -0.03'/><geometry><box size='0.2 0.1 0.04'/></geometry>",
                          "<origin xyz='0.00 0 -0.02'/><geometry><sphere radius='0.03'/></geometry>");
    }
    Declare(-0.02, kRadius_m);
  }

  void Declare(double centre_m, double radius_m) {
    std::string contacts = "contacts:\n";
    for (const std::string name : {"l_foot", "r_foot"}) {
      contacts += "  " + name + ": {link: " + name + ", kind: point, frame: {position: [0, 0, " +
                  std::to_string(centre_m) + "]}, radius_m: " + std::to_string(radius_m) + "}\n";
    }
    const test::SyntheticFolder again(yaml_.path());
    std::string text = test::ReadText(yaml_.path() / "dataset.yaml");
    test::WriteText(folder_.path() / "dataset.yaml", text);
    test::ReplaceInFile(folder_.path() / "dataset.yaml", "format: legopt-dataset/1", "format: legopt-dataset/2");
    test::ReplaceInFile(folder_.path() / "dataset.yaml", "feet: [l_foot, r_foot]\n", contacts);
    test::ReplaceInFile(folder_.path() / "dataset.yaml", "sole_offset_m: 0.051\n", "");
  }

  std::shared_ptr<const Dataset> Load() {
    WriteManifestHashes(folder_.path());
    return Dataset::Load(folder_.path());
  }

  Evaluation Judged(const Eigen::VectorXd& x) {
    const auto dataset = Load();
    return Judge(dataset).Evaluate(Task::kPosture, dataset->problem(Task::kPosture, 0), {&x, 1});
  }

  /// Returns a posture with the centre of mass above the line between the feet, and the balls' lowest points `gap_m`
  /// above the ground.
  Eigen::VectorXd Above(double gap_m) {
    const auto dataset = Load();
    Kinematics kinematics(dataset->robot());
    double back_rad = -0.1, front_rad = 0.1;
    while (front_rad - back_rad > 1e-12) {
      const double middle_rad = 0.5 * (back_rad + front_rad);
      kinematics.Update(test::Leaning(middle_rad));
      (kinematics.com().x() > 0.0 ? front_rad : back_rad) = middle_rad;
    }
    Eigen::VectorXd x = test::Leaning(back_rad);
    x[test::kSyntheticDofs + 2] += kLowest_m + gap_m - test::kSyntheticSoleOffset_m;
    return x;
  }

  test::TemporaryFolder folder_, yaml_;
  test::SyntheticFolder files_{folder_.path()};
};

TEST_F(PointContact, AtItsClearanceItStands) {
  const Evaluation evaluation = Judged(Above(kPointClearance_m));
  EXPECT_EQ(evaluation.solid, Verdict::kSuccess) << evaluation.detail;
  EXPECT_NEAR(evaluation.Largest(Verdict::kFootPose, Rule::kSolid), 0.0, 1e-9);
  EXPECT_NEAR(evaluation.Largest(Verdict::kTouch, Rule::kSolid), kPointClearance_m, 1e-6);
}

TEST_F(PointContact, TheLinkMayTurnAboutIt) {
  const auto dataset = Load();
  const ContactTarget& target = dataset->problem(Task::kPosture, 0).stances[0].contacts[0];
  const Contact& contact = dataset->contact(target.contact);
  Eigen::Isometry3d X_WL = contact.LinkTarget(target);
  const Eigen::Vector3d centre = X_WL * contact.X_LC.translation();
  X_WL.linear() = Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, 2, 3).normalized()).toRotationMatrix() * X_WL.linear();
  X_WL.translation() += centre - X_WL * contact.X_LC.translation();
  EXPECT_NEAR(ComputeContactPoseError(contact, target, X_WL).violation, 0.0, 1e-12);
  X_WL.translation().y() += 2e-3;
  const ContactPoseError error = ComputeContactPoseError(contact, target, X_WL);
  EXPECT_NEAR(error.violation, 2e-3, 1e-12);
  EXPECT_EQ(error.component, 4);
}

TEST_F(PointContact, AGapOfMoreThanAMillimetreFails) {
  Declare(-0.02 - 0.0015, kRadius_m);  // the description is wrong by 1.5 mm: the target is reached, the ball hovers
  const Evaluation evaluation = Judged(Above(kPointClearance_m + 0.0015));
  EXPECT_EQ(evaluation.strict, Verdict::kSuccess) << evaluation.detail;
  EXPECT_EQ(evaluation.solid, Verdict::kTouch);
  EXPECT_THAT(evaluation.detail, HasSubstr("at most 1 mm"));
}

// A sphere's mesh lies inside of it, so that its lowest vertex depends on how the link is turned.
TEST_F(PointContact, ASphereIsMeasuredExactly) {
  const auto dataset = Load();
  const ContactTarget& target = dataset->problem(Task::kPosture, 0).stances[0].contacts[0];
  const Contact& contact = dataset->contact(target.contact);
  ExactCollision collision(dataset->robot(), dataset->scene(), dataset->collision_model());
  TouchProbe probe(*dataset, collision);
  Eigen::Isometry3d X_WL = contact.LinkTarget(target);
  const Eigen::Vector3d centre = X_WL * contact.X_LC.translation();
  for (const double angle_rad : {0.05, 0.1, 0.15, 0.2, 0.25, 0.3}) {
    X_WL.linear() = Eigen::AngleAxisd(angle_rad, Eigen::Vector3d(1, 2, 3).normalized()).toRotationMatrix();
    X_WL.translation() += centre - X_WL * contact.X_LC.translation();
    EXPECT_NEAR(probe.Measure(contact, NormalOf(target), X_WL).gap_m, kPointClearance_m, 1e-6) << angle_rad;
  }
}

TEST_F(PointContact, TwoPointsSupportOnlyTheLineBetweenThem) {
  const Evaluation upright = Judged(Above(kPointClearance_m));
  EXPECT_NEAR(upright.Largest(Verdict::kCom, Rule::kSolid), 0.0, 1e-3);
  const auto dataset = Load();
  const std::vector<Eigen::Vector2d> support =
      TargetSupportPolygon(*dataset, dataset->problem(Task::kPosture, 0).stances[0]);
  ASSERT_EQ(support.size(), 2U);
  EXPECT_NEAR((support[0] - support[1]).norm(), 0.2, 1e-9);
}

TEST_F(PointContact, OnASlopeTheSupportIsBelowTheBallAlongTheNormal) {
  const auto dataset = Load();
  Stance stance = dataset->problem(Task::kPosture, 0).stances[0];
  for (ContactTarget& target : stance.contacts) {
    target.rotation = Eigen::Quaterniond(Eigen::AngleAxisd(0.5, Eigen::Vector3d::UnitY()));
  }
  // With the clearance, the ball's lowest point is beside the target's position by its horizontal part.
  for (const Eigen::Vector2d& corner : TargetSupportPolygon(*dataset, stance)) {
    EXPECT_NEAR(corner.x(), kPointClearance_m * std::sin(0.5), 1e-12);
  }
}

TEST_F(PointContact, ItsKeysAreChecked) {
  const auto message = [&](const std::string& text, const std::string& by) {
    Declare(-0.02, kRadius_m);
    test::ReplaceInFile(folder_.path() / "dataset.yaml", text, by);
    return test::MessageOf([&] { ReadDatasetFile(folder_.path()); });
  };
  EXPECT_THAT(message("radius_m: 0.030000", "points: [[0, 0, 0]]"), HasSubstr("points"));
  EXPECT_THAT(message("radius_m: 0.030000", "radius_m: -1"), HasSubstr("[0, 1]"));
  EXPECT_THAT(message("kind: point", "kind: sole"), HasSubstr("radius_m"));
}

}  // namespace
}  // namespace legopt
