#pragma once

#include <memory>
#include <string>
#include <vector>

#include "client/page/page_figures.h"
#include "legopt/dataset/dataset.h"

namespace legopt::client {

/// The datasets that a page draws: those of `folders` (or embedded names), and those of the shown results that are
/// embedded or stored with them. With neither, because a source cannot be read now or has no experiment yet, the
/// embedded default. Throws InputError for a folder that is no dataset.
std::vector<std::shared_ptr<const Dataset>> LoadPageDatasets(const std::vector<PageSource>& sources,
                                                             const std::vector<std::string>& folders);

}  // namespace legopt::client
