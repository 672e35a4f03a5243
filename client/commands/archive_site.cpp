#include <algorithm>
#include <filesystem>
#include <iostream>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "app/command_line.h"
#include "app/printable.h"
#include "client/benchmark/site.h"
#include "client/client_error.h"
#include "client/commands/archive.h"
#include "client/commands/options.h"
#include "client/report/output.h"
#include "client/suite/input_files.h"

namespace legopt::client {
namespace {

namespace fs = std::filesystem;

constexpr char kExtension[] = ".legopt-archive";

struct ArchiveSiteOptions {
  std::vector<std::string> places, datasets;
  std::optional<std::string> benchmark;
  fs::path out;
  app::BuildFacts build;
};

// Files, and the archives of folders in the order of their names.
std::vector<fs::path> ArchivesIn(const std::vector<std::string>& places) {
  std::vector<fs::path> files;
  for (const std::string& place : places) {
    if (!fs::is_directory(place)) {
      files.emplace_back(place);
      continue;
    }
    std::vector<fs::path> inside;
    for (const auto& entry : fs::directory_iterator(place)) {
      if (entry.path().extension() == kExtension) inside.push_back(entry.path());
    }
    if (inside.empty()) {
      throw ClientError(ExitCode::kUsage, place + " has no file *" + kExtension + "; 'legopt archive pack' writes one");
    }
    std::ranges::sort(inside);
    files.insert(files.end(), inside.begin(), inside.end());
  }
  return files;
}

ExitCode WriteArchiveSite(const ArchiveSiteOptions& options) {
  SiteRequest request;
  request.archives = ArchivesIn(options.places);
  request.datasets = LoadArchiveDatasets(options.datasets);
  request.benchmark = ReadBenchmark(options.benchmark ? InputFile(*options.benchmark) : EmbeddedBenchmark());
  request.out = options.out;
  request.build = options.build;
  request.tell = PrintRemark;
  const std::vector<RefusedArchive> refused = WriteSite(request);
  const bool written = refused.size() < request.archives.size();
  if (written)
    std::cerr << app::Printable((options.out / "index.html").string()) << " written, "
              << request.archives.size() - refused.size() << " archives\n";
  if (refused.empty()) return ExitCode::kOk;
  std::string reasons;
  for (const RefusedArchive& archive : refused) {
    reasons += (reasons.empty() ? "" : "; ") + archive.file + ": " + archive.reason;
  }
  throw ClientError(ExitCode::kJobsFailed, "left out: " + reasons);
}

}  // namespace

void AddSiteCommand(const app::Command& archive, Invocation* invocation) {
  const auto site = archive.AddCommand("site", "Judge archives and write a website: leaderboards, problems, 3D");
  const auto options = std::make_shared<ArchiveSiteOptions>();
  site.AddOption("PLACE", options->places, "Archives, or folders of them").Required();
  AddArchiveDatasetOption(site, &options->datasets);
  site.AddOption("--benchmark", options->benchmark, "Definition of the tiers (default: the embedded benchmark.yaml)");
  site.AddOption("--out", options->out, "Folder to write; a former site there is replaced").Required();
  site.WhenChosen([=] {
    options->build = invocation->build;
    invocation->body = [options] { return WriteArchiveSite(*options); };
  });
}

}  // namespace legopt::client
