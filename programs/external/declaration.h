#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <vector>

namespace legopt::external {

/// How a solver is spoken to.
enum class Level {
  kLines,  ///< JSON lines over its standard streams, as long as it lives
  kFiles   ///< a problem file and the name of a solution file as its last arguments, one process a solve
};

/// A solver of others, as a JSON file declares it (docs/solvers.md):
///
///     {"name": "slsqp", "command": ["python3", "slsqp.py"], "files": ["../common.py"], "settings": {"ftol": 1e-6},
///      "timeout_s": 60}
///
/// A command without a slash is looked for in PATH, another one from the file's folder, where the solver also runs.
struct Declaration {
  std::string file;  ///< where it stands
  std::string name;  ///< the word that suites use as `solver`
  Level level = Level::kLines;
  std::vector<std::string> command;          ///< argv, as written
  std::filesystem::path folder;              ///< of the file, absolute
  std::filesystem::path executable;          ///< what the command's first word leads to, absolute
  std::vector<std::filesystem::path> files;  ///< whose content belongs to it: words of the command, then `files`
  nlohmann::json settings;                   ///< an object, handed to the solver as it is
  double timeout_s = 60.0;                   ///< longest silence
  std::vector<std::string> environment;      ///< variables that it is given beside the usual ones
  bool network = false;                      ///< whether it needs the network, for example for its licence
  /// BLAKE2b-256 of what decides results: the command and settings as written, the contents of executable and files.
  /// The place of the files, the longest silence and the access to variables and network do not count.
  std::string hash;
};

/// Reads a declaration. Throws one InputError of all faults: file, field, value and fix.
Declaration ReadDeclaration(const std::filesystem::path& file);

/// All of them. Throws InputError also where two have one name.
std::vector<Declaration> ReadDeclarations(std::span<const std::filesystem::path> files);

/// The hash as of the files' contents now. Throws InputError when one cannot be read.
std::string CurrentHash(const Declaration& declaration);

}  // namespace legopt::external
