// The published problems compared with figures that were computed independently.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <numbers>

#include "legopt/dataset/dataset.h"
#include "legopt/dataset/internal/dataset_content.h"
#include "tests/dataset/test_data.h"
#include "tests/folders.h"

namespace legopt {
namespace {

namespace fs = std::filesystem;

constexpr double kDegrees = 180 / std::numbers::pi;

Eigen::Vector3d Axis(const ContactTarget& target, int axis) { return target.rotation.toRotationMatrix().col(axis); }
double Tilt_deg(const ContactTarget& target) { return std::acos(std::min(1.0, Axis(target, 2).z())) * kDegrees; }
bool IsDouble(const Stance& stance) { return stance.contacts.size() == 2; }

class LegOptDataTest : public testing::Test {
 protected:
  void SetUp() override {
    LEGOPT_SKIP_WITHOUT_TEST_DATA();
    dataset_ = Dataset::Load(test::LegOptFolder());
  }
  /// Returns rows of a reference table whose problem is in the dataset.
  std::vector<std::map<std::string, std::string>> Rows(Task task, const std::string& file) {
    std::vector<std::map<std::string, std::string>> rows;
    for (auto& row : test::ReadCsv(fs::path(ReferenceFolder()) / file)) {
      const int id = std::stoi(row["id"]);
      const auto& problems = dataset_->problems(task);
      if (std::any_of(problems.begin(), problems.end(), [&](const auto& p) { return p.id == id; })) rows.push_back(row);
    }
    return rows;
  }
  std::shared_ptr<const Dataset> dataset_;
};

TEST_F(LegOptDataTest, BareFolderIsADataset) {
  EXPECT_EQ(dataset_->problems(Task::kPosture).size(), 35u);
  EXPECT_EQ(dataset_->problems(Task::kMotion).size(), 35u);
  EXPECT_EQ(dataset_->robot().num_dofs(), 29);
  for (const Contact& contact : dataset_->contacts()) EXPECT_EQ(contact.link_height_m(), 0.082351);
  EXPECT_EQ(dataset_->gravity_m_s2(), 9.797930195020351);
  ASSERT_EQ(dataset_->contacts().size(), 2u);
  EXPECT_EQ(ComputeManifest(test::LegOptFolder()).size(), 36u) << "32 link meshes, URDF, garage, two problem files";
}

TEST_F(LegOptDataTest, FootBoxesOfTheAtlas) {
  const Eigen::AlignedBox3d& left = dataset_->contact("l_foot").box_L;
  const Eigen::AlignedBox3d& right = dataset_->contact("r_foot").box_L;
  EXPECT_NEAR((left.min() - Eigen::Vector3d(-0.083928, -0.065372, -0.080970)).cwiseAbs().maxCoeff(), 0, 1e-6);
  EXPECT_NEAR((left.max() - Eigen::Vector3d(0.179399, 0.064725, -0.027496)).cwiseAbs().maxCoeff(), 0, 1e-6);
  EXPECT_NEAR((right.min() - Eigen::Vector3d(-0.083203, -0.063927, -0.081351)).cwiseAbs().maxCoeff(), 0, 1e-6);
  EXPECT_NEAR((right.max() - Eigen::Vector3d(0.180124, 0.066170, -0.027877)).cwiseAbs().maxCoeff(), 0, 1e-6);
}

TEST_F(LegOptDataTest, PostureStatistics) {
  const auto rows = Rows(Task::kPosture, "posture-stats.csv");
  if (rows.empty()) GTEST_SKIP() << "posture-stats.csv not found in " << ReferenceFolder();
  EXPECT_EQ(rows.size(), 35u);
  for (auto row : rows) {
    const int id = std::stoi(row["id"]);
    SCOPED_TRACE("posture problem " + row["id"]);
    const Stance& stance = dataset_->problem(Task::kPosture, id).stances[0];
    ASSERT_TRUE(IsDouble(stance));
    const ContactTarget& left = stance.contacts[0];
    const ContactTarget& right = stance.contacts[1];
    EXPECT_EQ(left.contact, "l_foot");
    const Eigen::Vector3d difference = right.position - left.position;
    const Eigen::Vector3d middle = (right.position + left.position) / 2;
    EXPECT_NEAR(difference.head<2>().norm(), std::stod(row["horizontal_m"]), 5.1e-5);
    EXPECT_NEAR(difference.z(), std::stod(row["dz_right_minus_left_m"]), 5.1e-5);
    EXPECT_NEAR(Tilt_deg(left), std::stod(row["tilt_left_deg"]), 5.1e-3);
    EXPECT_NEAR(Tilt_deg(right), std::stod(row["tilt_right_deg"]), 5.1e-3);
    // The table's yaw is that of the right foot in the left foot's frame.
    const Eigen::Vector3d forward = left.rotation.toRotationMatrix().transpose() * Axis(right, 0);
    const double yaw = std::atan2(forward.y(), forward.x()) * kDegrees;
    EXPECT_NEAR(yaw, std::stod(row["rel_yaw_deg"]), 5.1e-3);
    EXPECT_NEAR(middle.x(), std::stod(row["mid_x"]), 5.1e-4);
    EXPECT_NEAR(middle.y(), std::stod(row["mid_y"]), 5.1e-4);
    EXPECT_NEAR(middle.z(), std::stod(row["mid_z"]), 5.1e-4);
  }
}

TEST_F(LegOptDataTest, MotionStatistics) {
  const auto rows = Rows(Task::kMotion, "motion-stats.csv");
  if (rows.empty()) GTEST_SKIP() << "motion-stats.csv not found in " << ReferenceFolder();
  EXPECT_EQ(rows.size(), 35u);
  for (auto row : rows) {
    SCOPED_TRACE("motion problem " + row["id"]);
    const ProblemDefinition& problem = dataset_->problem(Task::kMotion, std::stoi(row["id"]));
    int both = 0, left = 0, right = 0;
    double low = 1e9, high = -1e9, tilt = 0, distance = 0, height = 0;
    for (const Stance& stance : problem.stances) {
      for (const ContactTarget& target : stance.contacts) {
        low = std::min(low, target.position.z());
        high = std::max(high, target.position.z());
        tilt = std::max(tilt, Tilt_deg(target));
      }
      if (!IsDouble(stance)) {
        ++(stance.contacts[0].contact == "l_foot" ? left : right);
        continue;
      }
      ++both;
      const Eigen::Vector3d difference = stance.contacts[1].position - stance.contacts[0].position;
      distance += difference.head<2>().norm();
      height = std::max(height, std::abs(difference.z()));
    }
    EXPECT_EQ(problem.stances.size(), std::stoul(row["stances"]));
    EXPECT_EQ(both, std::stoi(row["double"]));
    EXPECT_EQ(left, std::stoi(row["left_only"]));
    EXPECT_EQ(right, std::stoi(row["right_only"]));
    EXPECT_EQ(NumWaypoints(Task::kMotion, static_cast<int>(problem.stances.size())), std::stoi(row["waypoints"]));
    EXPECT_NEAR(low, std::stod(row["z_min"]), 5.1e-4);
    EXPECT_NEAR(high, std::stod(row["z_max"]), 5.1e-4);
    EXPECT_NEAR(tilt, std::stod(row["max_tilt_deg"]), 5.1e-3);
    EXPECT_NEAR(distance / both, std::stod(row["mean_double_horizontal_m"]), 5.1e-4);
    EXPECT_NEAR(height, std::stod(row["max_double_abs_dz_m"]), 5.1e-4);
  }
}

TEST_F(LegOptDataTest, WritingAStanceLosesNothing) {
  for (const Task task : {Task::kPosture, Task::kMotion}) {
    for (const ProblemDefinition& problem : dataset_->problems(task)) {
      for (const Stance& stance : problem.stances) {
        EXPECT_TRUE(ParseStance(FormatStance(stance), {.file = "", .field = ""}) == stance);
      }
    }
  }
}

TEST_F(LegOptDataTest, OneByteOfAMeshChangesTheHash) {
  const test::TemporaryFolder folder;
  fs::copy(test::LegOptFolder(), folder.path() / "copy", fs::copy_options::recursive);
  fs::permissions(folder.path() / "copy" / "atlas" / "meshes", fs::perms::owner_all);
  const fs::path mesh = folder.path() / "copy" / "atlas" / "meshes" / "r_hand.stl";
  fs::permissions(mesh, fs::perms::owner_all);
  EXPECT_EQ(Dataset::Load(folder.path() / "copy")->content_hash(), dataset_->content_hash());
  std::string bytes = test::ReadText(mesh);
  bytes[bytes.size() / 2] = static_cast<char>(bytes[bytes.size() / 2] ^ 1);
  test::WriteText(mesh, bytes);
  EXPECT_NE(Dataset::Load(folder.path() / "copy")->content_hash(), dataset_->content_hash());
}

}  // namespace
}  // namespace legopt
