#pragma once

#include "client/commands/commands.h"

namespace legopt::client {

/// Adds the commands `import-sequence` and `export-sequence` to `dataset`: contact sequences of multicontact-api.
void AddSequenceCommands(const app::Command& dataset, Invocation* invocation);

}  // namespace legopt::client
