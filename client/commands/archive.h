#pragma once

#include <memory>
#include <string>
#include <vector>

#include "app/command_line.h"
#include "client/commands/commands.h"
#include "legopt/dataset/dataset.h"

namespace legopt::client {

/// Adds --dataset: folders of the datasets of archives.
void AddArchiveDatasetOption(const app::Command& command, std::vector<std::string>* folders);

/// Loads the datasets of --dataset. Throws InputError.
std::vector<std::shared_ptr<const Dataset>> LoadArchiveDatasets(const std::vector<std::string>& folders);

/// Adds `legopt archive site`.
void AddSiteCommand(const app::Command& archive, Invocation* invocation);

}  // namespace legopt::client
