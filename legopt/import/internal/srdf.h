#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>

#include "legopt/robot/robot_model.h"

namespace legopt {

/// Named posture of a robot's SRDF (Semantic Robot Description Format).
struct SrdfState {
  std::filesystem::path file;
  std::string name;                      ///< name of the group state
  std::map<std::string, double> joints;  ///< joint -> rad or m; only joints that the robot has
};

/// Finds the posture in which the authors let a robot stand: in the SRDF files of the URDF's folder and of the folder
/// `srdf` in it or beside it, the group state whose name begins with the first of half_sitting, standing, stand,
/// stance, home, reference, default and initial (blanks, '-' and '_' are equal; case does not count) and which names at
/// least half of the robot's joints. Files that cannot be read are skipped, because a robot is complete without them.
std::optional<SrdfState> FindStandingState(const std::filesystem::path& urdf, const RobotModel& robot);

}  // namespace legopt
