// Policy: an import changes neither masses, degrees of freedom nor limits of a robot: they are those that urdfdom reads
// in the source. Run with LEGOPT_URDFS, a file of paths, for other robots than those of this repository.
#include <gtest/gtest.h>
#include <urdf_parser/urdf_parser.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <limits>
#include <set>
#include <string>
#include <vector>

#include "app/isolated_call.h"
#include "legopt/import/internal/copied_robot.h"
#include "legopt/robot/robot_model.h"
#include "tests/folders.h"
#include "tests/temporary_folder.h"

namespace legopt {
namespace {

namespace fs = std::filesystem;

std::vector<fs::path> Urdfs() {
  std::vector<fs::path> files;
  if (const char* list = std::getenv("LEGOPT_URDFS")) {
    std::ifstream lines(list);
    for (std::string line; std::getline(lines, line);) files.emplace_back(line);
    return files;
  }
  for (const auto& entry : fs::recursive_directory_iterator(fs::path(SourceFolder()) / "data")) {
    if (entry.path().extension() == ".urdf") files.push_back(entry.path());
  }
  return files;
}

RobotModel Imported(const fs::path& urdf) {
  const test::TemporaryFolder folder;
  CopyUrdfRobot(urdf, folder.path(), {.meshes = {.allow_missing = true}, .read_guard = CallIsolated});
  return RobotModel::FromUrdfFile((folder.path() / kRobotFileName).string(), CallIsolated);
}

/// The joints that urdfdom finds to move independently: not those of a floating base, and no followers.
std::set<std::string> IndependentJoints(const urdf::ModelInterface& model) {
  std::set<std::string> names;
  for (const auto& [name, joint] : model.joints_) {
    const bool moves = joint->type == urdf::Joint::REVOLUTE || joint->type == urdf::Joint::CONTINUOUS ||
                       joint->type == urdf::Joint::PRISMATIC;
    if (moves && !joint->mimic) names.insert(name);
  }
  return names;
}

void ExpectLimitsOf(const Joint& joint, const urdf::Joint& source) {
  const bool free = source.type == urdf::Joint::CONTINUOUS || !source.limits;
  EXPECT_EQ(joint.lower, free ? -std::numeric_limits<double>::infinity() : source.limits->lower) << joint.name;
  EXPECT_EQ(joint.upper, free ? std::numeric_limits<double>::infinity() : source.limits->upper) << joint.name;
}

TEST(Urdfdom, ReadsTheSameMassesDegreesOfFreedomAndLimits) {
  const std::vector<fs::path> files = Urdfs();
  ASSERT_FALSE(files.empty());
  for (const fs::path& file : files) {
    SCOPED_TRACE(file);
    const urdf::ModelInterfaceSharedPtr model = urdf::parseURDFFile(file.string());
    ASSERT_TRUE(model);
    const RobotModel robot = Imported(file);
    double mass_kg = 0.0;
    for (const auto& [name, link] : model->links_) {
      if (link->inertial) mass_kg += link->inertial->mass;
      if (const int own = robot.FindLink(name); own >= 0) {
        EXPECT_EQ(robot.links()[static_cast<std::size_t>(own)].mass, link->inertial ? link->inertial->mass : 0.0)
            << name;
      }
    }
    EXPECT_NEAR(robot.total_mass(), mass_kg, 1e-9 * mass_kg);
    std::set<std::string> dofs;
    for (const std::string& name : DofNames(robot)) dofs.insert(name);
    EXPECT_EQ(dofs, IndependentJoints(*model));
    for (const Joint& joint : robot.joints()) {
      if (joint.type != JointType::kFixed) ExpectLimitsOf(joint, *model->getJoint(joint.name));
    }
  }
}

}  // namespace
}  // namespace legopt
