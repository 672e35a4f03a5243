#include <CLI/CLI.hpp>
#include <iostream>
#include <memory>

#include "client/client_error.h"
#include "client/commands.h"
#include "client/options.h"
#include "client/progress.h"

namespace legopt::client {
namespace {

struct Options {
  std::optional<std::int64_t> experiment;
  SourceOptions source;
  ListingFormat format = ListingFormat::kText;
};

Listing ExperimentListing(const std::vector<ExperimentStatus>& experiments) {
  Listing listing;
  listing.columns = {"experiment", "name", "state",  "priority", "jobs",      "queued",
                     "leased",     "done", "failed", "dead",     "cancelled", "solved"};
  for (const auto& e : experiments) {
    listing.rows.push_back({e.id, e.name, StateText(e), e.priority, e.total, e.queued, e.leased, e.done, e.failed,
                            e.dead, e.cancelled, e.solved});
  }
  return listing;
}

Listing RunningListing(const std::vector<ExperimentStatus>& experiments) {
  Listing listing;
  listing.columns = {"experiment", "job", "task", "worker", "done", "total", "unit"};
  for (const auto& e : experiments) {
    for (const auto& job : e.running) {
      listing.rows.push_back(
          {e.id, job.job, job.task, job.worker, job.done, job.total, job.task == "motion" ? "windows" : "attempts"});
    }
  }
  return listing;
}

void RequireFound(const Listing& experiments, const Options& options) {
  if (options.experiment && experiments.rows.empty()) {
    throw ClientError(ExitCode::kUsage, "there is no experiment " + std::to_string(*options.experiment) +
                                            "; 'legopt status' without an id lists all");
  }
}

ExitCode StatusOfFile(const Options& options) {
  const auto source = OpenResults(options.source);
  std::string sql =
      "SELECT experiment_id AS experiment, name, iif(state <> 'active' OR hold = 'none', state, "
      "iif(hold = 'held', 'held: ' || hold_reason, hold)) AS state, priority, jobs, queued, leased, done, failed, "
      "dead, cancelled, solved FROM experiment_list";
  if (options.experiment) sql += " WHERE experiment_id = " + std::to_string(*options.experiment);
  const Listing experiments = source->Query(sql + " ORDER BY experiment_id");
  RequireFound(experiments, options);
  std::cout << RenderListing(experiments, options.format);
  return ExitCode::kOk;
}

ExitCode StatusOfServer(const Options& options) {
  ServerConnection server(options.source.network);
  const auto probe = server.Probe();
  const auto status = server.Status(options.experiment.value_or(0));
  const auto parsed = ParseExperiments(status);
  const Listing experiments = ExperimentListing(parsed);
  RequireFound(experiments, options);
  if (const std::string error = StoreError(status); !error.empty()) {
    std::cerr << "legopt: warning: the server cannot write its database: " << error << "\n";
  }
  if (options.format == ListingFormat::kJson) {
    std::cout << status.dump(2) << "\n";
    return ExitCode::kOk;
  }
  if (options.format == ListingFormat::kText) {
    std::cout << "Server " << probe.server_version << " at " << server.address() << " on " << probe.hostname << " (pid "
              << probe.pid << ", up " << FormatDuration(std::chrono::microseconds(probe.uptime_us)) << "), database "
              << probe.database << "\n\n";
  }
  if (experiments.rows.empty() && options.format == ListingFormat::kText) {
    std::cout << "No experiments yet; submit one with 'legopt submit SUITE'\n";
  } else {
    std::cout << RenderListing(experiments, options.format);
  }
  const Listing running = RunningListing(parsed);
  if (!running.rows.empty() && options.format != ListingFormat::kCsv) {
    std::cout << "\n" << RenderListing(running, options.format);
  }
  const Listing workers =
      ListingFromJson(status.value("workers", nlohmann::json::array()),
                      {"id", "name", "hostname", "pid", "slots", "leases", "online", "silent_s", "datasets", "build"});
  if (!options.experiment && options.format != ListingFormat::kCsv) {
    std::cout << (workers.rows.empty() ? "\nNo workers; start some with 'legopt-worker --slots 2'\n"
                                       : "\n" + RenderListing(workers, options.format));
  }
  return ExitCode::kOk;
}

}  // namespace

void AddStatusCommand(CLI::App& app, Invocation* invocation) {
  auto* command = app.add_subcommand("status", "Show the experiments and workers of the server");
  const auto options = std::make_shared<Options>();
  command->add_option("ID", options->experiment, "Only this experiment");
  AddFormatOption(*command, &options->format);
  AddSourceOptions(*command, &options->source);
  command->callback([=] {
    invocation->body = [options] { return options->source.db ? StatusOfFile(*options) : StatusOfServer(*options); };
  });
}

}  // namespace legopt::client
