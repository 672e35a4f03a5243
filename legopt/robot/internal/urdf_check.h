#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "legopt/robot/internal/mesh_lookup.h"
#include "legopt/robot/internal/urdf_walk.h"

namespace legopt {

/// A joint with the links it connects.
struct UrdfJointElement {
  std::string name, parent, child;
  std::string leader = {};  ///< name of the joint that it follows; empty: none
};

/// A URDF whose elements and attributes have all been checked, as far as they are read.
struct CheckedUrdf {
  std::string source;  ///< file name for errors
  std::string robot;   ///< name of the robot
  /// The checked content as a new document: only elements and attributes of urdf_rules.h, no material or visual
  /// elements, numbers separated by single spaces. Two XML parsers may interpret a text differently; this text contains
  /// nothing they could disagree about, so that urdfdom reads exactly what was checked.
  std::string text;
  std::vector<std::string> links;                  ///< names, ordered as in the file
  std::vector<std::size_t> shapes;                 ///< number of collision elements per link
  std::vector<std::vector<std::size_t>> capsules;  ///< per link, positions of capsules among its collision elements
  std::vector<UrdfJointElement> joints;            ///< ordered as in the file
  std::vector<UrdfDiagnostic> notes;               ///< faults that do not prevent the use of the robot, and repairs
};

/// Checks every element of a URDF that urdfdom reads, so that urdfdom finds no faults itself: at the first fault of a
/// link urdfdom silently drops the rest of the link, and it prints the faulty text as a format string.
///
/// Refused is what would make results meaningless: elements and attributes that are missing, of the wrong kind, or
/// obvious misspellings (`<colision>`, xzy); numbers that are not plain, or of the wrong count; shapes of negative
/// size; negative masses; unexpanded xacro; duplicate names; links that do not exist, are the child of two joints, or
/// do not form a tree; more than 2,000 links, or 16 MiB of text. Repaired, with a note: a missing name of the robot,
/// effort or inertia; repeated elements; empty collision elements; flat boxes and spheres without radius, which get 1
/// and 0.1 mm; infinite limits; root links on a floating joint; a mesh's scale of one number. Faults of parts that
/// nothing reads (visuals, materials, dynamics) are notes. Other elements (sensors, transmissions, simulator
/// extensions) are ignored.
///
/// Throws InputError with all faults, each with link or joint, element, attribute, line, value and fix. `meshes`: null,
/// or where collision meshes are looked for if there are other faults, so that missing ones are reported with them.
/// Thread-safe.
CheckedUrdf CheckUrdf(const std::string& xml, const std::string& source, const MeshPlaces* meshes = nullptr);

/// Returns the path of a link's mesh file. One that does not exist is refused, or empty if the search permits that; a
/// fallback is noted.
std::string ResolveMesh(const std::string& name, const std::string& link, const MeshPlaces& places, UrdfFaults* faults);

/// Reads a URDF file. Throws InputError if it cannot be read, is empty, or exceeds the size limit of CheckUrdf.
std::string ReadUrdfFile(const std::string& path);

/// Finds moving joints without `<axis>`, which rotate about x, and physically impossible inertias (not positive
/// definite, or one principal moment more than 1 % larger than the sum of the others). One remark per kind.
std::vector<UrdfDiagnostic> ReviewUrdf(const CheckedUrdf& urdf);

}  // namespace legopt
