#pragma once

#include <memory>
#include <string>
#include <vector>

#include "client/archive/archive.h"
#include "legopt/dataset/dataset.h"

namespace legopt::client {

/// Returns the dataset of an archive, by its hash: one of `datasets`, or else one of this machine (FindLocalDataset).
/// Throws ClientError (kDatasetMismatch) if there is none.
std::shared_ptr<const Dataset> FindArchivedDataset(const Archive& archive,
                                                   const std::vector<std::shared_ptr<const Dataset>>& datasets);

}  // namespace legopt::client
