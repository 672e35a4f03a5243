#pragma once

#include <string>

/// Folders that the tests read and run. They are functions rather than compile definitions: paths on compiler command
/// lines would force every clone to recompile all tests, even with a compiler cache.
namespace legopt {

std::string SourceFolder();     ///< root of this source tree
std::string BuildFolder();      ///< build folder, which contains the programs
std::string TestDataFolder();   ///< LegOpt's own data, if present
std::string ReferenceFolder();  ///< figures of the reference implementation, if present

}  // namespace legopt
