#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "app/build_identity.h"
#include "client/benchmark/benchmark_file.h"
#include "legopt/dataset/dataset.h"

namespace legopt::client {

/// Arguments of `legopt archive site`.
struct SiteRequest {
  std::vector<std::filesystem::path> archives;           ///< files, in the order of the site
  std::vector<std::shared_ptr<const Dataset>> datasets;  ///< besides those of this machine
  Benchmark benchmark;
  std::filesystem::path out;  ///< folder to write (SiteFolder)
  app::BuildFacts build;
  std::size_t most_page_bytes = 25'000'000;           ///< size limit of an archive's page
  std::function<void(const std::string&)> tell = {};  ///< receives progress messages
};

/// A file that a site leaves out.
struct RefusedArchive {
  std::string file;
  std::string reason;
};

/// Judges all archives and writes a folder of static files (docs/how-to/publish-results.md): `index.html` with the
/// leaderboard of each tier and a page for each problem, `viewer.html`, `leaderboard.csv`, and for each archive
/// `archives/NAME.html` (the page of `legopt report`, by the rule of its tier), `.judged.json` and the archive itself.
/// The folder appears complete or not at all; if every archive is left out, nothing is written. Returns the archives
/// that were left out, with reasons: unreadable, a dataset that is not on this machine, the same content as another.
/// Throws ClientError (kUsage) for another `out`, FileError, and InputError for a corrupt mesh.
std::vector<RefusedArchive> WriteSite(const SiteRequest& request);

}  // namespace legopt::client
