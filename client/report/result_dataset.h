#pragma once

#include <memory>
#include <string>

#include "client/report/result_source.h"
#include "legopt/dataset/dataset.h"

namespace legopt::client {

/// The dataset with this content hash: an embedded one, one that a worker of this user has fetched into the cache, the
/// one stored with the results, which is unpacked into a temporary folder that exists as long as the dataset, or the
/// folder of this user's last submission with that dataset. Its content is always hashed: a stored archive with other
/// content, or one that cannot be read, is a warning on standard error and not used. Null when no place has the
/// dataset. Throws ClientError where no temporary folder can be made.
std::shared_ptr<const Dataset> FindResultDataset(ResultSource& source, const std::string& hash);

}  // namespace legopt::client
