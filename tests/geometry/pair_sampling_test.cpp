#include "legopt/geometry/internal/pair_sampling.h"

#include <gtest/gtest.h>

namespace legopt {
namespace {

// A hand that slides into the trunk although both are apart with all joints at 0, on a joint without limits.
constexpr const char* kRobot = R"(<robot name="r">
<link name="trunk"><inertial><mass value="1"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>
<collision><geometry><box size="0.2 0.3 0.1"/></geometry></collision></link>
<link name="arm"/><link name="hand"><collision><geometry><box size="0.12 0.08 0.06"/></geometry></collision></link>
<joint name="swing" type="continuous"><parent link="trunk"/><child link="arm"/><origin xyz="0.17 0 0"/>
<axis xyz="1 0 0"/></joint>
<joint name="reach" type="prismatic"><parent link="arm"/><child link="hand"/><axis xyz="1 0 0"/>
<limit lower="-0.12" upper="0.1" effort="1" velocity="1"/></joint></robot>)";

TEST(PairSampling, FindsPairsThatTheZeroPoseHides) {
  const RobotModel robot = RobotModel::FromUrdfText(kRobot, "test", ".");
  const SampledPairs pairs = SampleLinkPairs(robot, robot.NeutralConfiguration(), {.samples = 500});
  ASSERT_EQ(pairs.checked.size(), 1U);  // a link without geometry does not make its neighbours adjacent
  EXPECT_EQ(pairs.checked[0], LinkPair(0, 2));
  EXPECT_TRUE(pairs.unchecked.empty());
}

}  // namespace
}  // namespace legopt
