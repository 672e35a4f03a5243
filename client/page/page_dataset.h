#pragma once

#include <nlohmann/json.hpp>
#include <set>
#include <string>

#include "client/page/page_file.h"
#include "legopt/dataset/dataset.h"
#include "legopt/types/task.h"

namespace legopt::client {

/// Problem ids of a dataset, by task.
using ProblemIds = EnumArray<Task, std::set<int>>;

/// A dataset prepared for drawing.
struct PageDataset {
  nlohmann::ordered_json json;  ///< element of "datasets" in docs/reference/page-data.md
  std::string geometry;         ///< bytes of its geometry block, uncompressed
};

/// Describes a robot, its scene and the given problems: exact meshes used by the judge, convex pieces used by solvers,
/// link tree, targets and support polygons. Unknown problem ids are ignored. `block`: name of the geometry block.
/// Throws InputError for a corrupt mesh.
PageDataset DescribeDataset(const Dataset& dataset, const ProblemIds& problems, const std::string& block);

}  // namespace legopt::client
