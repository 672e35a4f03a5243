#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace legopt {

/// The place of a joint in the tree.
struct UrdfJointElement {
  std::string name,  ///< of the joint
      parent,        ///< link that it hangs from
      child;         ///< link that it carries
};

/// A URDF in which every element and attribute that is read has been looked at.
struct CheckedUrdf {
  std::string source;  ///< names the file in errors
  std::string robot;   ///< name
  /// What is read of the file, written anew: no element or attribute that urdf_rules.h does not name, no material or
  /// visual element, numbers separated by single spaces. Two readers of XML may see different things in one text; this
  /// one holds nothing that they could disagree about, so that what is read is what has been checked.
  std::string text;
  std::vector<std::string> links;        ///< names, in the order of the file
  std::vector<std::size_t> shapes;       ///< collision elements of each link
  std::vector<UrdfJointElement> joints;  ///< in the order of the file
};

/// Looks at every element of a URDF that urdfdom reads, so that it has nothing to complain about: urdfdom drops the
/// rest of a link at its first fault and goes on without it, and prints the faulty text as a format string.
///
/// Refused are attributes and elements that are missing, given twice, of the wrong kind, or spelt so closely to one
/// that is read that it was certainly meant (`<colision>`, xzy); numbers that are not plain, finite and as many as
/// needed; shapes without positive size; masses below 0; what xacro has not expanded; names given twice; links that do
/// not exist, are the child of two joints, or make no tree; more than 2,000 links, or 16 MiB of text. Other elements
/// (sensors, transmissions, simulators' own) are let by: nothing here reads them.
///
/// Throws InputError naming link or joint, element, attribute, line, value and fix. Thread-safe.
CheckedUrdf CheckUrdf(const std::string& xml, const std::string& source);

/// The text of a URDF file. Throws InputError when it cannot be read, is empty, or larger than CheckUrdf takes.
std::string ReadUrdfFile(const std::string& path);

}  // namespace legopt
