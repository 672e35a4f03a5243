#pragma once

#include <Eigen/Geometry>
#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "legopt/types/task.h"

namespace legopt {

/// Target of one contact of the robot (contact.h), exactly as in the problem file.
///
/// `position` is a point on the touched surface, the target of the *contact frame's* origin. `rotation` has the surface
/// normal as z axis and the forward direction as x axis. It is unit within kQuaternionTolerance and keeps the digits of
/// the file, so that writing it again changes nothing.
struct ContactTarget {
  std::string contact;          ///< name of the contact
  Eigen::Vector3d position;     ///< position of the contact frame in the world, m
  Eigen::Quaterniond rotation;  ///< orientation of the contact frame in the world

  // The rest is only in stances that are JSON objects (ProblemFile).
  std::optional<double> friction = {};  ///< Coulomb coefficient of the surface, in (0, 2]; default: Contact::friction
  std::optional<double> slide_m = {};   ///< largest distance from a rail's target, m, >= 0; default: Contact::slide_m
  bool carries = true;                  ///< false: the contact only touches, without force

  /// Returns true if the target is only a pose, which a stance string expresses.
  bool only_pose() const { return !friction && !slide_m && carries; }
};

/// Returns true for a Coulomb coefficient that files may state: (0, 2].
constexpr bool IsFriction(double value) { return value > 0.0 && value <= 2.0; }

/// Contacts that exist at the same time, in file order. The robot's other contacts are free.
struct Stance {
  std::vector<ContactTarget> contacts;  ///< one per name; not empty when read from a file
  std::optional<double> push_N = {};    ///< horizontal push that a posture must resist (judge.md#physical-rule), > 0

  /// Returns true if a stance string expresses the stance.
  bool only_poses() const;
};

/// One problem of a benchmark. Its task defines the number of stances.
struct ProblemDefinition {
  int id = 0;                   ///< unique per task, >= 0 in a dataset
  std::vector<Stance> stances;  ///< size required by the task, when read from a dataset
};

bool operator==(const ContactTarget& a, const ContactTarget& b);
/// Returns true if contact and pose are equal, whatever else differs.
bool HaveSamePose(const ContactTarget& a, const ContactTarget& b);
bool operator==(const Stance& a, const Stance& b);
bool operator==(const ProblemDefinition& a, const ProblemDefinition& b);

/// Returns true if the problem has the number of stances that the task requires.
bool Fits(Task task, const ProblemDefinition& problem);

/// Text for errors: "a posture problem has one stance, a motion problem two or more".
std::string DescribeStanceCounts();

/// Maximum deviation of a file quaternion's norm from 1. LegOpt's own files are unit to 7e-11.
inline constexpr double kQuaternionTolerance = 1e-6;

/// Location of a text inside a file, for error messages.
struct TextSource {
  std::string file;   ///< path
  std::string field;  ///< e.g. "problem 3, stance 0"
};

/// Reads a stance: a string or an object (ProblemFile). Throws InputError as ParseStance, and for unknown keys,
/// contacts and values.
Stance ReadStance(const nlohmann::json& json, const TextSource& source);

/// Returns the stance as ReadStance reads it: a string if that expresses it, else an object.
nlohmann::json StanceJson(const Stance& stance);

/// Parses a LegOpt stance string: "contact,qw qx qy qz px py pz ,contact,..."; the trailing comma and spaces are
/// optional.
///
/// The order of the quaternion is w x y z (the LegOpt README's "xyzw" is wrong). Throws InputError for an empty stance,
/// a contact without pose, a pose without exactly 7 finite numbers, a quaternion that is not unit, and a duplicate
/// contact. Dataset checks that the contacts exist. In LegOpt's own files, contacts are named like links.
Stance ParseStance(std::string_view text, const TextSource& source);

/// Formats a stance in LegOpt's form (with a trailing comma) and shortest round-trip numbers:
/// ParseStance(FormatStance(s)) == s, bit by bit, if s has only poses.
std::string FormatStance(const Stance& stance);

/// Returns a text that is the same for equal stances only: FormatStance, or StanceJson if the stance has more than
/// poses.
std::string StanceKey(const Stance& stance);

/// A LegOpt problem file (docs/explanation/paper.md#problem-and-solution-files):
///
///     {"robot": "atlas", "scenario": "garage", "task": "posture",
///      "problems": [{"id": 0, "definition": ["l_foot,qw qx qy qz px py pz ,r_foot,... ,"]}, ...]}
///
/// `definition` holds one stance string per stance, or an object where a problem needs more:
///
///     {"contacts": "l_foot,... ,l_palm,... ,", "friction": {"l_palm": 0.3}, "load": {"l_palm": "touch"},
///      "slide_m": {"l_grip": 0.2}, "push_N": 45}
///
/// `load` is "carry" (default) or "touch". Unknown keys of files and problems are ignored, so that solution files are
/// valid problem files; those of stances are not, because they would change the problem.
struct ProblemFile {
  std::string robot;                        ///< free text, may be empty
  std::string scenario;                     ///< free text, may be empty
  std::optional<Task> task;                 ///< nullopt if the key is missing
  std::vector<ProblemDefinition> problems;  ///< ordered as in the file
};

/// Returns the task that the file names. LegOpt's own files name none and have two kinds of problems: motions if the
/// first problem with stances has several, else postures.
Task TaskOf(const ProblemFile& file);

/// Reads a problem file. Throws InputError with file and problem: no `problems` array, missing or duplicate `id`,
/// missing `definition`, invalid stance.
ProblemFile ReadProblemFile(const std::filesystem::path& path);

/// Reads a problem file from parsed JSON. If `definition_optional`, a problem may omit its `definition`.
ProblemFile ParseProblemFile(const nlohmann::json& root, const std::string& file_for_errors, bool definition_optional);

}  // namespace legopt
