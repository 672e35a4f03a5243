#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <vector>

namespace legopt::external {

/// Type of communication with an external solver.
enum class ChannelType {
  kLines,  ///< JSON lines over its standard streams, during its whole lifetime
  kFiles   ///< a problem file and the name of a solution file as last arguments; one process per solve
};

/// External solver, declared by a JSON file (docs/reference/external-solvers.md):
///
///     {"name": "slsqp", "command": ["python3", "slsqp.py"], "files": ["../common.py"], "settings": {"ftol": 1e-6},
///      "timeout_s": 60}
///
/// A command without a slash is searched in PATH; another one is relative to the file's folder, where the solver also
/// runs.
struct Declaration {
  std::string file;  ///< path of the declaration
  std::string name;  ///< name used as `solver` in suites
  ChannelType level = ChannelType::kLines;
  std::vector<std::string> command;          ///< argv, as written
  std::filesystem::path folder;              ///< folder of the declaration, absolute
  std::filesystem::path executable;          ///< file of the command's first word, absolute
  std::vector<std::filesystem::path> files;  ///< files of the solver: words of the command, then `files`
  nlohmann::json settings;                   ///< object passed to the solver unchanged
  double timeout_s = 60.0;                   ///< maximum time without output
  std::vector<std::string> environment;      ///< variables passed on in addition to the usual ones
  bool network = false;                      ///< whether the solver needs the network, for example for its licence
  /// BLAKE2b-256 of everything that determines results: command and settings as written, contents of executable and
  /// files. Excludes the location of the files, the time-out, and access to variables and network.
  std::string hash;
};

/// Reads a declaration. Throws one InputError with all faults: file, field, value and fix.
Declaration ReadDeclaration(const std::filesystem::path& file);

/// Reads all declarations. Throws InputError also if two have the same name.
std::vector<Declaration> ReadDeclarations(std::span<const std::filesystem::path> files);

/// Returns the hash for the current contents of the files. Throws InputError if one cannot be read.
std::string CurrentHash(const Declaration& declaration);

}  // namespace legopt::external
