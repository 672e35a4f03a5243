#pragma once

#include <filesystem>
#include <memory>
#include <vector>

#include "legopt/dataset/dataset.h"
#include "legopt/dataset/stance.h"

namespace legopt::generate {

/// Stances of a solution file (solution_file.h, one stance per problem) that have a posture: those for which the judge
/// of `dataset` accepts at least one of the solutions, by the literal and the strict rule; in the order of the file,
/// each once. What the file itself says of success is not asked.
///
/// Throws InputError: see ReadSolutions; a problem with more than one stance or without its definition; no stance left.
std::vector<Stance> ReadProvenStances(const std::shared_ptr<const Dataset>& dataset, const std::filesystem::path& path);

}  // namespace legopt::generate
