#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "client/suite/suite.h"

namespace legopt::client {

/// Returns the path of the suite that the user named: a readable file or pipe, "-" for standard input, or the bare name
/// of an embedded suite ("quick" for data/suites/quick.yaml). Throws ClientError (kUsage) that lists the embedded
/// suites.
std::filesystem::path FindSuite(const std::string& name);

/// Returns the dataset to use: `flag` if given (a folder, or the bare name of an embedded dataset such as
/// "garage-hard"), else the suite's, else the embedded default.
std::filesystem::path ChooseDatasetFolder(const std::optional<std::string>& flag, const Suite* suite);

}  // namespace legopt::client
