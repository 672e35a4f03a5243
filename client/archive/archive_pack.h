#pragma once

#include <filesystem>
#include <optional>

#include "client/archive/archive.h"
#include "client/report/result_source.h"

namespace legopt::client {

/// Reads a description of an archive: a YAML mapping with any of `title`, `authors` (a list), `paper`, `licence`,
/// `code` and `notes`. Throws InputError with FILE:LINE, key and remedy.
ArchiveAbout ReadAbout(const std::filesystem::path& file);

/// Makes an archive of the results of an experiment (default: the newest). Throws the errors of FindExperiment, and
/// ClientError: kUsage for an experiment without results, or with results of a build that reported no id;
/// kDatabaseUnusable for damaged rows.
Archive PackExperiment(ResultSource& source, std::optional<std::int64_t> experiment_id, ArchiveAbout about);

}  // namespace legopt::client
