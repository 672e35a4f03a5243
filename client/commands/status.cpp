#include <chrono>
#include <iostream>
#include <memory>

#include "app/command_line.h"
#include "app/printable.h"
#include "client/client_error.h"
#include "client/commands/commands.h"
#include "client/commands/options.h"
#include "client/report/escaped_text.h"
#include "client/report/output.h"
#include "client/report/progress.h"
#include "client/report/status_table.h"
#include "client/report/watching.h"
#include "client/service/interrupt.h"
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
    text += UnlistedWorkers(status);
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

namespace {

constexpr double kShortestInterval_s = 0.01, kLongestInterval_s = 3600;

struct WatchCommandOptions {
  std::optional<std::int64_t> experiment;
  double patience_s = WatchOptions::kDefaultPatience_s;
  double interval_s = 1;
  std::optional<double> give_up_s;
  bool json = false;
  NetworkOptions network;
};

// Returns the newest active experiment, or else the newest one.
std::int64_t DefaultExperiment(ServerConnection& server) {
  const auto experiments = ParseExperiments(server.Status(0));
  const ExperimentStatus* chosen = nullptr;
  for (const auto& experiment : experiments) {
    const bool better = chosen == nullptr || (chosen->over() && !experiment.over()) ||
                        (chosen->over() == experiment.over() && chosen->id < experiment.id);
    if (better) chosen = &experiment;
  }
  if (chosen == nullptr) {
    throw ClientError(ExitCode::kUsage, "there is no experiment to watch; submit one with 'legopt submit SUITE'");
  }
  return chosen->id;
}

WatchOptions HowToWatch(const WatchCommandOptions& options) {
  return {Seconds(options.patience_s), !options.experiment, {}, false, GiveUpOf(options.give_up_s)};
}

ExitCode WatchAsText(ServerConnection& server, std::int64_t id, const WatchCommandOptions& options) {
  try {
    const auto status = WatchOnTerminal(server, id, HowToWatch(options));
    if (const auto hint = FailureHint(status, ""); !hint.empty()) std::cerr << "legopt: " << hint << "\n";
    return OutcomeOf(status);
  } catch (const ClientError& error) {
    if (error.code() != ExitCode::kInterrupted) throw;
    std::cerr << "\nlegopt: experiment " << id << " continues unwatched; 'legopt watch " << id << "' returns to it\n";
    return ExitCode::kInterrupted;
  }
}

// The last line always reports the end and its reason.
ExitCode WatchAsJson(ServerConnection& server, std::int64_t id, const WatchCommandOptions& options) {
  using std::chrono::microseconds;
  WatchJson view(
      id, Seconds(options.interval_s), [] { return Seconds(std::chrono::steady_clock::now().time_since_epoch()); },
      [] { return std::chrono::system_clock::now().time_since_epoch() / microseconds(1); },
      [](const std::string& line) { std::cout << line << std::endl; });
  try {
    const ExitCode outcome = OutcomeOf(WatchExperiment(server, id, view, HowToWatch(options)));
    view.End(outcome, "");
    return outcome;
  } catch (const ClientError& error) {
    view.End(error.code(), error.what());
    if (error.code() == ExitCode::kInterrupted) return ExitCode::kInterrupted;
    throw;
  }
}

ExitCode Watch(const WatchCommandOptions& options) {
  const InterruptGuard guard;
  ServerConnection server(options.network);
  const std::int64_t id = options.experiment ? *options.experiment : DefaultExperiment(server);
  return options.json ? WatchAsJson(server, id, options) : WatchAsText(server, id, options);
}

}  // namespace

void AddWatchCommand(const app::Command& program, Invocation* invocation) {
  const auto command = program.AddCommand("watch", "Show the progress of an experiment until it ends");
  const auto options = std::make_shared<WatchCommandOptions>();
  command.AddOption("ID", options->experiment, "Experiment (default: the newest that runs)").Check(app::WholeNumber(1));
  AddPatienceOption(command, &options->patience_s);
  AddGiveUpOption(command, &options->give_up_s);
  AddTextOrJsonOption(command, &options->json);
  command.AddOption("--interval", options->interval_s, "With --format json: seconds between two lines (default 1)")
      .Check(app::Number(kShortestInterval_s, kLongestInterval_s));
  AddNetworkOptions(command, &options->network);
  command.SetFooter(
      "Exit codes: 0 done, 3 the server did not come back, 4 jobs died or could not run, "
      "6 it came back with another database, 8 cancelled or interrupted, 15 nothing moved for --give-up seconds.\n"
      "--format json writes one object per line; the last one has the event \"end\". Fields: "
      "docs/how-to/watching.md");
  command.WhenChosen([=] { invocation->body = [options] { return Watch(*options); }; });
}

}  // namespace legopt::client
