#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "legopt/dataset/stance.h"
#include "words/task.h"

namespace legopt {

/// A LegOpt problem file (docs/readings.md#problem-and-solution-files):
///
///     {"robot": "atlas", "scenario": "garage", "task": "posture",
///      "problems": [{"id": 0, "definition": ["l_foot,qw qx qy qz px py pz ,r_foot,... ,"]}, ...]}
///
/// `definition` holds one stance string (stance.h) per stance. Keys this program does not know are left alone, so that
/// solution files are problem files, too.
struct ProblemFile {
  std::string robot;                        ///< free text, may be empty
  std::string scenario;                     ///< free text, may be empty
  std::optional<Task> task;                 ///< as stated; nullopt when the key is missing
  std::vector<ProblemDefinition> problems;  ///< in the order of the file
};

/// Reads the problems. Throws InputError naming file and problem: no `problems` array, missing or repeated `id`,
/// missing `definition`, a stance that is not well formed.
ProblemFile ReadProblemFile(const std::filesystem::path& path);

/// The same from JSON that is already parsed; a problem may lack its `definition` when `definition_optional`.
ProblemFile ParseProblemFile(const nlohmann::json& root, const std::string& file_for_errors, bool definition_optional);

}  // namespace legopt
