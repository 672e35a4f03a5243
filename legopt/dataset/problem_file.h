#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "legopt/dataset/stance.h"
#include "legopt/types/task.h"

namespace legopt {

/// A LegOpt problem file (docs/explanation/paper.md#problem-and-solution-files):
///
///     {"robot": "atlas", "scenario": "garage", "task": "posture",
///      "problems": [{"id": 0, "definition": ["l_foot,qw qx qy qz px py pz ,r_foot,... ,"]}, ...]}
///
/// `definition` holds one stance string (stance.h) per stance. Unknown keys are ignored, so that solution files are
/// valid problem files.
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
