#pragma once

#include <Eigen/Geometry>
#include <string>
#include <string_view>
#include <vector>

#include "words/task.h"

namespace legopt {

/// Where one foot has to stand, exactly as written in the problem file.
///
/// `position` is a point on the terrain (world, metres): the *sole* target, not the link frame. `rotation` has the
/// surface normal as z axis and the foot's forward direction as x axis; it is unit within kQuaternionTolerance and is
/// kept with the file's digits so that writing it back changes nothing.
struct Foothold {
  std::string link;             ///< the foot's, by name
  Eigen::Vector3d position;     ///< world, m: the sole target
  Eigen::Quaterniond rotation;  ///< of the foot's link frame at its target, in the world
};

/// The feet that carry the robot at the same time, in file order. Feet that are not listed are free.
struct Stance {
  std::vector<Foothold> footholds;  ///< each of another link; not empty when read from a file
};

/// One problem of a benchmark; its task says how many stances it has.
struct ProblemDefinition {
  int id = 0;                   ///< unique among the problems of a task, >= 0 in a dataset
  std::vector<Stance> stances;  ///< as many as the task wants, when read from a dataset
};

bool operator==(const Foothold& a, const Foothold& b);
bool operator==(const Stance& a, const Stance& b);
bool operator==(const ProblemDefinition& a, const ProblemDefinition& b);

/// The feet that stay where they are from a waypoint of one stance to a waypoint of the next: those that both have at
/// the same target. In the order of `from`; empty when there are none.
Stance PlantedFeet(const Stance& from, const Stance& to);

/// Whether the problem has as many stances as the task wants.
bool Fits(Task task, const ProblemDefinition& problem);

/// How many stances the tasks want, as errors say it: "a posture problem has one stance, a motion problem two or more".
std::string StancesOfTasks();

/// Largest deviation of a file quaternion's norm from 1. LegOpt's own files are unit to 7e-11.
inline constexpr double kQuaternionTolerance = 1e-6;

/// Names the place of a text inside a file, for error messages.
struct TextSource {
  std::string file;   ///< path
  std::string field;  ///< e.g. "problem 3, stance 0"
};

/// Reads a LegOpt stance string: "link,qw qx qy qz px py pz ,link,..." with or without the trailing comma and spaces.
///
/// The quaternion is w x y z (the LegOpt README's "xyzw" is wrong). Throws InputError for an empty stance, a link
/// without pose, a pose that has not 7 finite numbers, a quaternion that is not unit, and a link named twice. Whether
/// the links exist is the dataset's check.
Stance ParseStance(std::string_view text, const TextSource& source);

/// Writes a stance string in LegOpt's form (trailing comma included) with shortest round-trip numbers:
/// ParseStance(FormatStance(s)) == s, bit by bit.
std::string FormatStance(const Stance& stance);

}  // namespace legopt
