#pragma once

#include <memory>
#include <string>
#include <vector>

#include "client/page/page.h"
#include "legopt/dataset/dataset.h"

namespace legopt::client {

/// Returns the datasets to draw: those in `folders` (or embedded names), and the datasets of the shown results that are
/// embedded or stored with them. If there are none, because a source is unreadable or has no experiment yet, returns
/// the embedded default. Throws InputError for a folder that is not a dataset.
std::vector<std::shared_ptr<const Dataset>> LoadPageDatasets(const std::vector<PageSource>& sources,
                                                             const std::vector<std::string>& folders);

}  // namespace legopt::client
