// Policy: heights and reach of a robot do not depend on which of its links is the root of the URDF.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>
#include <numbers>
#include <string>

#include "legopt/dataset/dataset.h"
#include "legopt/import/importer.h"
#include "legopt/import/internal/trunk_choice.h"
#include "legopt/problem/terms/initial_guess.h"
#include "legopt/robot/configuration.h"
#include "legopt/worldgen/internal/reach_cloud.h"
#include "legopt/worldgen/internal/stance_probe.h"
#include "tests/dataset/test_data.h"
#include "tests/import/walker.h"

namespace legopt {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::HasSubstr;
using worldgen::ProbeOptions;
using worldgen::ReachCloud;

const std::string kTrunkBox = "<origin xyz='0 0 0.2'/><geometry><box size='0.2 0.1 0.2'/></geometry>";

std::string Fixed(const std::string& parent, const std::string& child, const std::string& place) {
  return "<joint name='" + child + "_mount' type='fixed'><parent link='" + parent + "'/><child link='" + child +
         "'/><origin xyz='" + place + "'/></joint>";
}

/// The walker with a massless sensor as its root, 0.1 m above and 0.05 m before the trunk.
std::string SensorAsRoot() {
  std::string text = test::Walker{}.Urdf();
  text.insert(text.find("<link"), "<link name='imu'/>" + Fixed("imu", "trunk", "-0.05 0 -0.1"));
  return text;
}

/// The walker with its left foot as its root: the joints of the left leg lead upwards.
std::string FootAsRoot() {
  const test::Walker walker;
  std::string text = "<robot name='walker'>" + test::Link("l_foot", 0.5, 0.0, walker.foot) +
                     test::Link("l_shank", 1.0, 0.0, "") + test::Link("l_thigh", 1.0, 0.0, "") +
                     test::Link("l_hip", 0.5, 0.0, "") + "<link name='l_mount'/>" +
                     test::Link("trunk", 10.0, 0.0, kTrunkBox);
  text += test::Joint("l_ankle", "l_foot", "l_shank", "0 0 0", "0 -1 0", "lower='-1' upper='1'");
  text += test::Joint("l_knee", "l_shank", "l_thigh", "0 0 0.3", "0 -1 0", "lower='0' upper='2.5'");
  text += test::Joint("l_pitch", "l_thigh", "l_hip", "0 0 0.3", "0 -1 0", "lower='-1.5' upper='1.5'");
  text += test::Joint("l_roll", "l_hip", "l_mount", "0 0 0", "-1 0 0", "lower='-0.5' upper='0.5'");
  text += Fixed("l_mount", "trunk", "0 -0.1 0");
  const std::string right = test::Walker{.legs = {{"r", "0 -0.1"}}}.Urdf();
  const std::size_t begin = right.find("<link name='r_hip'>");
  return text + right.substr(begin);
}

class TrunkOfImport : public testing::Test {
 protected:
  std::shared_ptr<const Dataset> Import(const std::string& urdf) {
    const fs::path in = folder_.path() / ("in" + std::to_string(number_));
    const fs::path out = folder_.path() / ("out" + std::to_string(number_++));
    test::WriteText(in / "robot.urdf", urdf);
    fs::create_directory(out);
    options_.source = in;
    options_.name = "walker";
    // Both soles are level in it.
    options_.nominal_posture = {{"l_pitch", -0.5}, {"r_pitch", -0.5}, {"l_knee", 1.0},
                                {"r_knee", 1.0},   {"l_ankle", -0.5}, {"r_ankle", -0.5}};
    report_ = ImportDataset(options_, out);
    return Dataset::Load(out);
  }

  test::TemporaryFolder folder_;
  ImportOptions options_;
  ImportReport report_;
  int number_ = 0;
};

TEST_F(TrunkOfImport, IsTheBodyThatTheLegsCarry) {
  const auto plain = Import(test::Walker{}.Urdf());
  EXPECT_EQ(plain->trunk().link, 0);
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(0.5 * std::numbers::pi, Eigen::Vector3d::UnitZ()));
  const auto level = [&](const char* contact, double x_m) {
    return ContactTarget{.contact = contact, .position = {x_m, 1, 0}, .rotation = turn};
  };
  const Stance stance{{level("l_foot", -2.1), level("r_foot", -1.9)}};  // the robot looks along y
  const ReachCloud expected(*plain, 1);
  for (const std::string& urdf : {SensorAsRoot(), FootAsRoot()}) {
    const auto dataset = Import(urdf);
    SCOPED_TRACE(dataset->robot().links().front().name);
    EXPECT_EQ(dataset->robot().links()[static_cast<std::size_t>(dataset->trunk().link)].name, "trunk");
    EXPECT_NEAR(dataset->trunk_height_m(), plain->trunk_height_m(), 1e-9);
    const ReachCloud reach(*dataset, 1);
    for (int c = 0; c < 2; ++c) {
      EXPECT_LT((reach.nominal(c).position - expected.nominal(c).position).norm(), 1e-9) << c;
    }
    EXPECT_LT((reach.com() - expected.com()).norm(), 1e-9);
    EXPECT_NEAR(reach.height_m(), expected.height_m(), 1e-9);
    EXPECT_NEAR(reach.stride_m(), expected.stride_m(), 0.1 * expected.stride_m());
    EXPECT_NEAR(ProbeOptions::For(*dataset).reach_m, ProbeOptions::For(*plain).reach_m, 1e-9);

    // A start has its trunk where the plain robot has its base.
    const Eigen::VectorXd x = InitialGuess(*dataset, stance, Initialization::kGood);
    const Eigen::VectorXd base = InitialGuess(*plain, stance, Initialization::kGood);
    const Eigen::Vector3d trunk = PartsOf(x).base_position() + turn * dataset->trunk().nominal_position_B;
    EXPECT_LT((trunk - PartsOf(base).base_position()).norm(), 1e-9);
  }
}

TEST_F(TrunkOfImport, IsAlsoFoundForLegsOfUnequalLength) {
  const RobotModel robot = RobotModel::FromUrdfText(FootAsRoot(), "robot.urdf", "/");
  const auto feet = [](const std::vector<std::string>& links) { return DescribeSoles(links, 0.0); };
  EXPECT_EQ(FindTrunk(robot, feet({"l_foot", "r_foot"})), "trunk");
  EXPECT_EQ(FindTrunk(robot, feet({"l_foot", "r_thigh"})), "l_hip") << "three joints from both";
  EXPECT_EQ(FindTrunk(robot, feet({"l_foot", "r_hip"})), "l_thigh") << "two and three joints; the hip is lighter";
  EXPECT_EQ(FindTrunk(robot, feet({"r_foot"})), "l_foot") << "the root link";
  EXPECT_EQ(FindTrunk(robot, feet({"trunk", "l_shank", "r_foot"})), "l_foot") << "no body between all three";
}

TEST_F(TrunkOfImport, IsTheOneThatTheUserNames) {
  options_.trunk = "l_thigh";
  const auto dataset = Import(test::Walker{}.Urdf());
  EXPECT_EQ(dataset->trunk().link, dataset->robot().FindLink("l_thigh"));
  options_.trunk = "trunck";
  EXPECT_THAT(test::MessageOf([&] { Import(test::Walker{}.Urdf()); }),
              AllOf(HasSubstr("--trunk"), HasSubstr("did you mean 'trunk'?")));
}

}  // namespace
}  // namespace legopt
