#pragma once

#include <filesystem>
#include <memory>
#include <vector>

#include "legopt/dataset/dataset.h"
#include "legopt/dataset/stance.h"

namespace legopt::worldgen {

/// Reads the stances of a solution file (solution_file.h, one stance per problem) that have a posture: the judge of
/// `dataset` accepts at least one of the solutions by the literal and the strict rule (the original evaluator's rule,
/// and every listed pair). Unique, in the order of the file. The success flags of the file are ignored.
///
/// Throws InputError: see ReadSolutions; a problem with more than one stance or without its definition; no stance left.
std::vector<Stance> ReadFeasibleStances(const std::shared_ptr<const Dataset>& dataset,
                                        const std::filesystem::path& path);

}  // namespace legopt::worldgen
