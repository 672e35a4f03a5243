#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "client/archive/archive.h"
#include "legopt/dataset/dataset.h"

namespace legopt::client {

/// Datasets that may be used besides those that the user names.
enum class DatasetUse : std::uint8_t {
  kOnlyGiven,  ///< those of this machine only if the user names none
  kAlsoLocal   ///< those of this machine
};

/// Returns the dataset of an archive, by its hash: one of `datasets`, or else one of this machine (FindLocalDataset).
/// Throws ClientError (kDatasetMismatch) if there is none; the message has no paths.
std::shared_ptr<const Dataset> FindArchivedDataset(const Archive& archive,
                                                   const std::vector<std::shared_ptr<const Dataset>>& datasets,
                                                   DatasetUse use);

}  // namespace legopt::client
