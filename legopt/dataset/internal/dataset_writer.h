#pragma once

#include <filesystem>
#include <span>
#include <string>

#include "legopt/dataset/dataset.h"
#include "legopt/dataset/internal/dataset_file.h"

namespace legopt {

/// Formats a problem file (problem_definition.h). Reading it returns identical numbers.
std::string FormatProblems(std::span<const ProblemDefinition> problems, Task task, const std::string& robot,
                           const std::string& scenario);

/// Formats a dataset.yaml (dataset_file.h) without the hashes; `comment` becomes the comment at its top, line by line.
std::string FormatDatasetFile(const DatasetDescription& description, const std::string& comment);

/// Copies the robot of a dataset with its meshes, keeping relative paths. Throws InputError.
void CopyRobot(const Dataset& source, const DatasetDescription& description, const std::filesystem::path& folder);

/// Copies the scene of a dataset with its meshes, keeping relative paths. Throws InputError.
void CopyScene(const Dataset& source, const DatasetDescription& description, const std::filesystem::path& folder);

}  // namespace legopt
