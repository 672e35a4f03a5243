#pragma once

#include <memory>
#include <string>

#include "client/report/result_source.h"
#include "legopt/dataset/dataset.h"

namespace legopt::client {

/// The dataset with this content hash: an embedded one, or the one stored with the results, which is unpacked into a
/// temporary folder that exists as long as the dataset. Null when neither has it. Throws InputError for a stored
/// dataset that cannot be read.
std::shared_ptr<const Dataset> FindResultDataset(ResultSource& source, const std::string& hash);

}  // namespace legopt::client
