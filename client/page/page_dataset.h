#pragma once

#include <nlohmann/json.hpp>
#include <set>
#include <string>

#include "client/page/page_block.h"
#include "legopt/dataset/dataset.h"
#include "words/task.h"

namespace legopt::client {

/// Problems of a dataset, by task.
using ProblemIds = Per<Task, std::set<int>>;

/// A dataset as a page draws it.
struct PageDataset {
  nlohmann::ordered_json json;  ///< "datasets" of docs/page-data.md
  std::string geometry;         ///< bytes of its block, not yet compressed
};

/// Robot, scene and these problems: exact meshes as the judge has them, convex pieces as solvers have them, link tree,
/// targets and support polygons. Ids that the dataset does not have are left out. `block`: the name of its geometry's
/// block. Throws InputError for a corrupt mesh.
PageDataset DescribeDataset(const Dataset& dataset, const ProblemIds& problems, const std::string& block);

}  // namespace legopt::client
