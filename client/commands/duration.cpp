#include <algorithm>
#include <memory>
#include <thread>

#include "app/command_line.h"
#include "app/folder_cache.h"
#include "client/client_error.h"
#include "client/commands/commands.h"
#include "client/commands/options.h"
#include "client/report/timing_report.h"
#include "client/suite/input_files.h"

namespace legopt::client {
namespace {

struct DurationOptions {
  std::string file;
  std::optional<std::string> dataset;
  bool motions = false;
  ListingOptions listing;
};

ExitCode ComputeDurations(const DurationOptions& options) {
  const SolutionFile file = ReadSolutions(InputFile(options.file));
  const auto dataset = Dataset::Load(ChooseDatasetFolder(options.dataset, nullptr), GuardedReader());
  const int threads = std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
  const std::vector<TimedSolution> timed = TimeSolutions(file, *dataset, threads);
  if (timed.empty()) {
    throw ClientError(ExitCode::kUsage, options.file + ": no problem has a 'solution'; is it a problem file?");
  }
  PrintListing(options.motions ? ListingOf(timed) : SummaryOf(timed), options.listing);
  return ExitCode::kOk;
}

}  // namespace

void AddDurationCommand(const app::Command& program, Invocation* invocation) {
  const auto command = program.AddCommand(
      "duration",
      "Compute the shortest durations of motions in a LegOpt solution file, within velocity, torque and friction");
  const auto options = std::make_shared<DurationOptions>();
  command.AddOption("FILE", options->file, "LegOpt solution JSON with motions, - for standard input").Required();
  AddDatasetOption(command, &options->dataset);
  command.AddFlag("--motions", options->motions,
                  "One row per motion, with its limits and the point that blocks it, instead of one per method");
  AddListingOptions(command, &options->listing);
  command.WhenChosen([=] { invocation->body = [options] { return ComputeDurations(*options); }; });
}

}  // namespace legopt::client
