#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "legopt/robot/robot_model.h"

namespace legopt {

/// Named posture of a robot's SRDF (Semantic Robot Description Format).
struct SrdfState {
  std::filesystem::path file;
  std::string name;                      ///< name of the group state
  std::map<std::string, double> joints;  ///< joint -> rad or m; only joints that the robot has
};

/// Two links that an SRDF excludes from collision checking.
struct SrdfPair {
  std::string first, second;  ///< links of the robot
  std::string reason;         ///< reason given by the file, lower case; may be empty
};

/// Content of a robot's SRDF files besides postures.
struct SrdfContent {
  std::filesystem::path file;         ///< first file that has any of these; empty: none
  std::vector<SrdfPair> disabled;     ///< pairs of links that the robot has
  std::vector<std::string> leg_tips;  ///< last links of the chains of groups named like legs or feet
  std::vector<std::string> faults;    ///< files that cannot be read, with the reason
};

/// Reads `disable_collisions` and `group` of the SRDF files that FindStandingState searches.
SrdfContent ReadSrdf(const std::filesystem::path& urdf, const RobotModel& robot);

/// Finds the posture in which the authors let a robot stand: in the SRDF files of the URDF's folder and of the folder
/// `srdf` in it or beside it, the group state whose name begins with the first of half_sitting, standing, stand,
/// stance, home, reference, default and initial (blanks, '-' and '_' are equal; case does not count) and which names at
/// least half of the robot's joints. Files that cannot be read are skipped, because a robot is complete without them.
std::optional<SrdfState> FindStandingState(const std::filesystem::path& urdf, const RobotModel& robot);

}  // namespace legopt
