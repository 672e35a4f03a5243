#include <iostream>
#include <memory>

#include "app/checks.h"
#include "app/command_line.h"
#include "app/printable.h"
#include "client/client_error.h"
#include "client/commands/commands.h"
#include "client/commands/options.h"
#include "client/report/json_text.h"
#include "client/report/progress.h"
#include "client/report/status_table.h"
#include "client/report/terminal.h"
#include "db/named_queries.h"

namespace legopt::client {
namespace {

struct StatusOptions {
  bool counters = false;
  std::optional<std::int64_t> experiment;
  SourceOptions source;
  TableFormat format = TableFormat::kText;
  OutputOptions output;
};

Listing RunningListing(const std::vector<ExperimentStatus>& experiments) {
  Listing listing;
  listing.columns = {"experiment", "job", "task", "worker", "done", "total", "unit"};
  for (const auto& e : experiments) {
    for (const auto& job : e.running) {
      listing.rows.push_back({e.id, job.job, ToString(job.task), job.worker, job.done, job.total,
                              DescriptionOf(job.task).windowed ? "windows" : "attempts"});
    }
  }
  return listing;
}

void RequireFound(const Listing& experiments, const StatusOptions& options) {
  if (options.experiment && experiments.rows.empty()) {
    throw ClientError(ExitCode::kUsage, "there is no experiment " + std::to_string(*options.experiment) +
                                            "; 'legopt status' without an id lists all");
  }
}

ExitCode StatusOfFile(const StatusOptions& options) {
  const auto source = OpenResults(options.source);
  const Listing experiments =
      source->Query(db::Sql(db::Query::kExperimentListing, {{"experiment_id", options.experiment}}));
  RequireFound(experiments, options);
  Print(RenderListing(experiments, options.format, LayoutOf(options.output)), options.output);
  return ExitCode::kOk;
}

// Returns one line per requirement of queued jobs that no worker satisfies.
std::string MissingText(const std::vector<ExperimentStatus>& experiments) {
  std::string text;
  for (const ExperimentStatus& experiment : experiments) {
    for (const std::string& missing : experiment.missing) {
      text += "experiment " + std::to_string(experiment.id) + ": " + app::Printable(missing) + "\n";
    }
  }
  return text.empty() ? text : "\n" + text;
}

// Returns the counters of the server since its start: requests by type, and datagrams by cause.
std::string CountersText(const nlohmann::json& status, const TextLayout& layout) {
  const nlohmann::json server = status.value("server", nlohmann::json::object());
  Listing requests;
  requests.columns = {"request", "received", "bytes"};
  const nlohmann::json received = server.value("requests", nlohmann::json::object());
  for (const auto& [type, count] : received.items()) {
    requests.rows.push_back({type, count.at("requests"), count.at("bytes")});
  }
  Listing counters;
  counters.columns = {"counter", "value"};
  for (const char* group : {"scheduler", "transport"}) {
    const nlohmann::json values = server.value(group, nlohmann::json::object());
    for (const auto& [name, value] : values.items()) {
      if (value != 0) counters.rows.push_back({name, value});
    }
  }
  return "\nRequests since the server's start:\n" + RenderListing(requests, TableFormat::kText, layout) +
         "\nOther counters (zeros are omitted):\n" + RenderListing(counters, TableFormat::kText, layout);
}

std::string TextForPeople(const std::vector<ExperimentStatus>& experiments, const nlohmann::json& status,
                          const StatusOptions& options) {
  const TextLayout layout = LayoutOf(options.output);
  std::string text = experiments.empty() ? "No experiments yet; submit one with 'legopt submit SUITE'\n"
                                         : RenderTable(ExperimentTable(experiments), TableFormat::kText, layout);
  if (const Listing running = RunningListing(experiments); !running.rows.empty()) {
    text += "\n" + RenderListing(running, options.format, layout);
  }
  text += MissingText(experiments);
  if (!options.experiment) {
    const auto workers = status.value("workers", nlohmann::json::array());
    text += "\n";
    text += workers.empty() ? "No workers; start some with 'legopt-worker'\n"
                            : RenderTable(WorkerTable(workers), TableFormat::kText, layout);
  }
  return options.counters ? text + CountersText(status, layout) : text;
}

void PrintListings(const std::vector<ExperimentStatus>& experiments, const nlohmann::json& status,
                   const StatusOptions& options) {
  std::cout << RenderListing(ExperimentListing(experiments), options.format);
  if (const Listing running = RunningListing(experiments); !running.rows.empty()) {
    std::cout << "\n" << RenderListing(running, options.format);
  }
  const Listing workers =
      ListingFromJson(status.value("workers", nlohmann::json::array()),
                      {"id", "name", "hostname", "pid", "slots", "leases", "online", "silent_s", "datasets", "solvers",
                       "build", "build_id", "processor", "processors", "memory_bytes", "load"});
  if (!options.experiment && !workers.rows.empty()) std::cout << "\n" << RenderListing(workers, options.format);
}

ExitCode StatusOfServer(const StatusOptions& options) {
  ServerConnection server(options.source.network);
  const auto probe = server.Probe();
  const auto status = server.Status(options.experiment.value_or(0));
  const auto experiments = ParseExperiments(status);
  const Listing listing = ExperimentListing(experiments);
  RequireFound(listing, options);
  if (const std::string error = StoreError(status); !error.empty()) {
    std::cerr << "legopt: warning: the server cannot write its database: " << app::Printable(error) << "\n";
  }
  if (status.value(nlohmann::json::json_pointer("/server/disk_low"), false)) {
    constexpr std::int64_t kMegabyte = 1'000'000;
    const auto free = status.at("server").value("disk_free_bytes", std::int64_t{0}) / kMegabyte;
    std::cerr << "legopt: warning: the disk with the server's database is nearly full: " << free << " MB are free\n";
  }
  switch (options.format) {
    case TableFormat::kJson:
      std::cout << JsonText(status) << "\n";
      break;
    case TableFormat::kText:
      Print("Server " + app::Printable(probe.server_version) + " at " + server.address() + " on " +
                app::Printable(probe.hostname) + " (pid " + std::to_string(probe.pid) + ", up " +
                FormatDuration(std::chrono::microseconds(probe.uptime_us)) + "), database " +
                app::Printable(probe.database) + "\n\n" + TextForPeople(experiments, status, options),
            options.output);
      break;
    case TableFormat::kMarkdown:
    case TableFormat::kLatex:
      PrintListings(experiments, status, options);
      break;
    case TableFormat::kCsv:
      std::cout << CsvFor(StandardOutput(), RenderListing(listing, options.format));
  }
  return ExitCode::kOk;
}

}  // namespace

void AddStatusCommand(const app::Command& program, Invocation* invocation) {
  const auto command = program.AddCommand("status", "Show the experiments and workers of the server");
  const auto options = std::make_shared<StatusOptions>();
  command.AddOption("ID", options->experiment, "Only this experiment").Check(app::WholeNumber(1));
  AddFormatOption(command, &options->format);
  AddOutputOptions(command, &options->output);
  AddSourceOptions(command, &options->source);
  command.SetFooter(
      "With --verbose, the text includes the server's counters of requests and datagrams; JSON always does.");
  command.WhenChosen([=] {
    options->counters = invocation->verbose;
    invocation->body = [options] { return options->source.db ? StatusOfFile(*options) : StatusOfServer(*options); };
  });
}

}  // namespace legopt::client
