#pragma once

#include <memory>
#include <string>

#include "client/report/result_source.h"
#include "legopt/dataset/dataset.h"

namespace legopt::client {

/// Finds the dataset with this content hash, in this order: an embedded dataset; one that a worker of this user has
/// fetched into the cache; the one stored with the results, unpacked into a temporary folder that exists as long as the
/// dataset; the folder of this user's last submission with that dataset. The content is always hashed: a stored archive
/// with other content, or an unreadable one, is ignored with a warning on standard error. Returns nullptr if the
/// dataset is not found. Throws ClientError if no temporary folder can be created.
std::shared_ptr<const Dataset> FindResultDataset(ResultSource& source, const std::string& hash);

}  // namespace legopt::client
