#pragma once

#include <string>

/// Where the tests find what they read and run. Functions, not definitions: paths in their command lines would make
/// every clone compile all tests anew, whatever a compiler cache holds.
namespace legopt {

std::string SourceFolder();     ///< of this tree
std::string BuildFolder();      ///< has the programs
std::string TestDataFolder();   ///< LegOpt's own data, when present
std::string ReferenceFolder();  ///< figures of the reference implementation, when present

}  // namespace legopt
