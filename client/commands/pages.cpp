#include "client/commands/pages.h"

#include <spawn.h>
#include <sys/wait.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <iterator>
#include <memory>
#include <thread>

#include "app/command_line.h"
#include "app/folder_cache.h"
#include "app/printable.h"
#include "client/client_error.h"
#include "client/commands/commands.h"
#include "client/commands/options.h"
#include "client/page/page.h"
#include "client/report/output.h"
#include "client/report/result_dataset.h"
#include "client/report/result_filter.h"
#include "client/serve/http_server.h"
#include "client/serve/live_page.h"
#include "client/serve/monitoring.h"
#include "client/service/interrupt.h"
#include "client/suite/input_files.h"
#include "db/named_queries.h"
#include "legopt/files/written_file.h"
#include "legopt/types/number_text.h"

namespace legopt::client {
namespace {

std::shared_ptr<const Dataset> DatasetOf(const PageSource& page) {
  try {
    const auto source = OpenResults(page.source);
    return FindResultDataset(*source, FindExperiment(*source, page.experiment).dataset_hash);
  } catch (const ClientError&) {
    return nullptr;  // the page reads the source as well and reports the error
  }
}

}  // namespace

std::vector<std::shared_ptr<const Dataset>> LoadPageDatasets(const std::vector<PageSource>& sources,
                                                             const std::vector<std::string>& folders) {
  std::vector<std::shared_ptr<const Dataset>> datasets;
  for (const std::string& folder : folders) {
    datasets.push_back(Dataset::Load(ChooseDatasetFolder(folder, nullptr), GuardedReader()));
  }
  for (const PageSource& source : sources) {
    const auto found = DatasetOf(source);
    const bool known = !found || std::any_of(datasets.begin(), datasets.end(), [&](const auto& dataset) {
      return dataset->content_hash() == found->content_hash();
    });
    if (!known) datasets.push_back(found);
  }
  if (datasets.empty()) datasets.push_back(Dataset::Load(ChooseDatasetFolder({}, nullptr), GuardedReader()));
  return datasets;
}

namespace {

constexpr double kBytesPerMegabyte = 1e6;

struct ReportOptions {
  std::vector<std::string> experiments, databases, datasets;
  std::string out;
  double max_megabytes = 25.0;
  std::optional<Rule> rule;
  ResultFilter filter;
  NetworkOptions network;
  app::BuildFacts build;
};

// Returns every combination of file and experiment; without a file, the server's experiments.
std::vector<PageSource> SourcesOf(const ReportOptions& options) {
  std::vector<SourceOptions> places;
  for (const std::string& file : options.databases) places.push_back({file, options.network, PrintRemark});
  if (places.empty()) places.push_back({std::nullopt, options.network, PrintRemark});
  std::vector<PageSource> sources;
  for (const SourceOptions& place : places) {
    for (const std::string& experiment : options.experiments)
      sources.push_back({place, *ParseInteger<std::int64_t>(experiment)});
    if (options.experiments.empty()) sources.push_back({place, std::nullopt});
  }
  return sources;
}

ExitCode Report(const ReportOptions& options) {
  ReportRequest request;
  request.sources = SourcesOf(options);
  request.rule = PageRule(request.sources, options.rule);
  request.filter = options.filter;
  request.most_bytes = static_cast<std::size_t>(options.max_megabytes * kBytesPerMegabyte);
  request.build = options.build;
  request.tell = PrintRemark;
  request.datasets = LoadPageDatasets(request.sources, options.datasets);
  const Page page = MakeReport(request);
  ReplaceFile(options.out, page.text);
  for (const std::string& note : page.notes) PrintRemark("note: " + note);
  constexpr double kTenth = 10.0;
  const double megabytes = std::round(kTenth * static_cast<double>(page.text.size()) / kBytesPerMegabyte) / kTenth;
  std::cerr << app::Printable(options.out) << " written, " << megabytes << " MB\n";
  return ExitCode::kOk;
}

}  // namespace

void AddReportCommand(const app::Command& program, Invocation* invocation) {
  constexpr double kLargest_megabytes = 1000.0, kSmallest_megabytes = 1.0;
  const auto command = program.AddCommand("report", "Write one HTML file with tables, figures and solutions");
  const auto options = std::make_shared<ReportOptions>();
  command.AddOption("EXPERIMENT", options->experiments, "Experiments, beside each other (default: the newest)")
      .Check(app::WholeNumber(1));
  command.AddOption("--out", options->out, "File to write, e.g. report.html").Required();
  command.AddList("--db", options->databases,
                  "Read this database file (read-only) instead of asking the server; several: repeat it, or use commas",
                  app::IsExistingPath);
  command.AddList("--dataset", options->datasets,
                  "Dataset folder for the 3D view (default: the embedded one); several: repeat it, or use commas",
                  app::IsExistingPath);
  command
      .AddOption("--max-size", options->max_megabytes,
                 "Largest size of the file in MB; the report names whatever was left out for it (default 25)")
      .Check(app::Number(kSmallest_megabytes, kLargest_megabytes));
  AddResultFilterOptions(command, &options->filter);
  AddRuleOption(command, &options->rule);
  AddNetworkOptions(command, &options->network);
  command.WhenChosen([=] {
    options->build = invocation->build;
    invocation->body = [options] { return Report(*options); };
  });
}

}  // namespace legopt::client

extern char** environ;

namespace legopt::client {
namespace {

struct ViewOptions {
  std::optional<std::int64_t> job, ghost;
  JobChoice choice;  ///< its problem is also that of a page without a solution
  std::optional<std::string> dataset, out;
  bool open = false;
  SourceOptions source;
  app::BuildFacts build;
};

std::string DefaultStem(const ViewOptions& options) {
  return options.job ? "job-" + std::to_string(*options.job)
                     : "problem-" + std::to_string(options.choice.problem.value_or(0));
}

bool HasContent(const std::string& file, const std::string& text) {
  std::ifstream stream(file, std::ios::binary);
  return stream && std::string{std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()} == text;
}

// Writes a file whose name nothing has, or leaves one that holds this text: "STEM.html", "STEM-2.html", ... Returns its
// name.
std::string WriteUnderFreeName(const std::string& stem, const std::string& text) {
  for (int i = 1;; ++i) {
    const std::string name = stem + (i == 1 ? "" : "-" + std::to_string(i)) + ".html";
    if (HasContent(name, text)) return name;
    try {
      files::CreateFile(name, text);
      return name;
    } catch (const files::FileError& error) {
      if (error.error() != EEXIST)
        throw ClientError(error.shortage() ? ExitCode::kMachine : ExitCode::kUsage, error.what());
    }
  }
}

// Opens the file in the desktop's default browser.
void Open(const std::string& file) {
  std::string program = "xdg-open", argument = std::filesystem::absolute(file).string();
  const std::array<char*, 3> arguments = {program.data(), argument.data(), nullptr};
  pid_t child = 0;
  int status = 0;
  const bool started = posix_spawnp(&child, program.c_str(), nullptr, nullptr, arguments.data(), environ) == 0;
  if (started && waitpid(child, &status, 0) == child && status == 0) return;
  throw ClientError(ExitCode::kMachine, "xdg-open could not show " + file + "; open it in a browser");
}

// Returns the dataset of the job's results if no folder is given.
std::shared_ptr<const Dataset> DatasetToShow(const ViewOptions& options) {
  if (options.job && !options.dataset) {
    const auto source = OpenResults(options.source);
    const Listing found = source->Query(db::Sql(db::Query::kDatasetOfJob, {{"job_id", *options.job}}));
    if (!found.rows.empty()) {
      if (auto dataset = FindResultDataset(*source, found.Text(0, "hash"))) return dataset;
    }
  }
  return Dataset::Load(ChooseDatasetFolder(options.dataset, nullptr), GuardedReader());
}

// Returns whether options choose a job of an experiment. --problem and --tasks alone choose a problem of the dataset.
bool ChoosesJob(const JobChoice& choice) {
  ResultFilter of_jobs = choice.filter;
  of_jobs.tasks.clear();
  return choice.experiment || !of_jobs.empty();
}

// Returns the task of a problem without a job.
Task TaskOf(const JobChoice& choice) {
  if (choice.filter.tasks.size() > 1) {
    throw ClientError(ExitCode::kUsage, Describe(choice.filter) + ": a problem has one task");
  }
  return choice.filter.tasks.empty() ? Task::kPosture : *ParseEnum<Task>(choice.filter.tasks.front());
}

// Returns the options with the job that they choose, if any.
ViewOptions WithJob(ViewOptions options) {
  const JobChoice& choice = options.choice;
  if (options.job && (choice.problem || ChoosesJob(choice) || !choice.filter.empty())) {
    throw ClientError(ExitCode::kUsage, "name a job or choose one by options, not both: 'legopt view 12'");
  }
  if (ChoosesJob(choice)) options.job = ChooseJob(*OpenResults(options.source), choice);
  if (!options.job && !choice.problem) {
    throw ClientError(ExitCode::kUsage, "name a job or a problem: 'legopt view 12' or 'legopt view --problem 3'");
  }
  return options;
}

ExitCode View(const ViewOptions& given) {
  const ViewOptions options = WithJob(given);
  ViewRequest request;
  request.source = options.source;
  request.job = options.job;
  request.ghost = options.ghost;
  request.task = options.job ? Task::kPosture : TaskOf(options.choice);
  request.problem = options.choice.problem;
  request.build = options.build;
  request.dataset = DatasetToShow(options);
  const Page page = MakeView(request);
  if (options.out) ReplaceFile(*options.out, page.text);
  const std::string written = options.out ? *options.out : WriteUnderFreeName(DefaultStem(options), page.text);
  std::cerr << app::Printable(written) << " written\n";
  if (options.open) Open(written);
  return ExitCode::kOk;
}

}  // namespace

void AddViewCommand(const app::Command& program, Invocation* invocation) {
  const auto command = program.AddCommand("view", "Write a page that shows a job's solution, or a problem, in 3D");
  const auto options = std::make_shared<ViewOptions>();
  command.AddOption("JOB", options->job, "Job, as 'legopt list' shows it").Check(app::WholeNumber(1));
  command
      .AddOption("--problem", options->choice.problem,
                 "Show a problem of the dataset, without a solution (task: --tasks, default posture), or a job of it")
      .Check(app::WholeNumber(0));
  AddJobChoiceOptions(command, &options->choice);
  command.AddOption("--ghost", options->ghost, "Draw another job of the same problem transparently")
      .Check(app::WholeNumber(1));
  command.AddOption("--out", options->out,
                    "File to write or replace (default: job-JOB.html, or the next free name: job-JOB-2.html)");
  command.AddFlag("--open", options->open, "Open the file in a browser");
  AddDatasetOption(command, &options->dataset);
  AddSourceOptions(command, &options->source);
  command.WhenChosen([=] {
    options->build = invocation->build;
    invocation->body = [options] { return View(*options); };
  });
}

namespace {

constexpr int kDefaultPort = 8711;
constexpr int kLargestPort = 65535;
constexpr char kState[] = "/state";

struct ServeOptions {
  std::vector<std::string> experiments, datasets;
  std::string address = "127.0.0.1";
  int port = kDefaultPort;
  std::vector<std::string> hosts;
  std::optional<Rule> rule;
  ResultFilter filter;
  SourceOptions source;
  app::BuildFacts build;
};

FigureRequest FiguresOf(const ServeOptions& options) {
  FigureRequest request;
  request.build = options.build;
  request.filter = options.filter;
  for (const std::string& experiment : options.experiments) {
    request.sources.push_back({options.source, *ParseInteger<std::int64_t>(experiment)});
  }
  if (request.sources.empty()) request.sources.push_back({options.source, std::nullopt});
  for (PageSource& place : request.sources) place.source.announce = nullptr;  // else at every update
  request.datasets = LoadPageDatasets(request.sources, options.datasets);
  request.rule = PageRule(request.sources, options.rule);
  return request;
}

// Throws the errors of KeptCells now, not only to browsers later. A database without experiments may get some.
void CheckFilter(const FigureRequest& figures) {
  if (figures.filter.empty()) return;
  for (const PageSource& place : figures.sources) {
    const auto source = OpenResults(place.source);
    if (!place.experiment && !HasExperiments(*source)) continue;
    const KeptCells kept(*source, FindExperiment(*source, place.experiment).id, figures.filter);
  }
}

HttpReply StateReply(const LiveState& state) {
  HttpReply reply;
  reply.type = "application/json";
  reply.body = state.text();
  return reply;
}

// Reads the state while it is watched, using at most a twentieth of the time. A request counts as watching for 10 s.
class Watching {
 public:
  Watching(LiveState* state, HttpServer* server) : state_(state), server_(server) {}

  void Step() {
    using namespace std::chrono_literals;
    const auto now = Clock::now();
    if (server_->requests() != requests_) {
      requests_ = server_->requests();
      last_request_ = now;
    }
    const bool watched = server_->streams() > 0 || now - last_request_ < 10s;
    if (watched && now >= next_read_) {
      const double now_s = std::chrono::duration<double>(now.time_since_epoch()).count();
      if (state_->Read(now_s)) server_->Publish(state_->version(), *state_->text());
      const auto took = Clock::now() - now;
      next_read_ = now + std::max<Clock::duration>(1s, 20 * took);
    }
    if (now >= next_beat_) {
      server_->Beat();
      next_beat_ = now + 15s;
    }
  }

 private:
  using Clock = std::chrono::steady_clock;
  LiveState* state_;
  HttpServer* server_;
  std::uint64_t requests_ = 0;
  Clock::time_point last_request_{}, next_read_{}, next_beat_{};
};

ExitCode Serve(const ServeOptions& options) {
  using namespace std::chrono_literals;
  const InterruptGuard guard;
  const FigureRequest figures = FiguresOf(options);
  CheckFilter(figures);
  // All experiments have verdicts by the solid rule, but not by the physical one.
  LiveState state(options.source, options.rule.value_or(std::min(Rule::kSolid, figures.rule)));
  state.Read(0);
  LiveBlocks blocks(figures, options.rule);
  HttpOptions http;
  http.address = options.address;
  http.port = static_cast<std::uint16_t>(options.port);
  http.hosts = options.hosts;
  HttpServer server(
      http,
      [&](const HttpRequest& request) {
        if (Monitoring::Answers(request.path)) return std::optional<HttpReply>();  // slow: calls the server
        return request.path == kState ? std::optional(StateReply(state)) : blocks.TryAnswer(request);
      },
      [&](const HttpRequest& request) {
        return Monitoring::Answers(request.path) ? Monitoring(options.source).Answer(request) : blocks.Make(request);
      });
  server.Publish(state.version(), *state.text());
  std::cout << server.url() << std::endl;
  std::cerr << "legopt: serves " << (options.source.db ? app::Printable(*options.source.db) : "the server")
            << " until interrupted (Ctrl-C)\n";
  Watching watching(&state, &server);
  while (!Interrupted()) {
    watching.Step();
    std::this_thread::sleep_for(100ms);
  }
  return ExitCode::kOk;
}

}  // namespace

void AddServeCommand(const app::Command& program, Invocation* invocation) {
  const auto command = program.AddCommand("serve", "Serve the page of 'legopt report' to browsers, with live data");
  const auto options = std::make_shared<ServeOptions>();
  command.AddOption("EXPERIMENT", options->experiments, "Shown first, beside each other (default: the newest)")
      .Check(app::WholeNumber(1));
  command
      .AddOption("--http-port", options->port, "TCP port (default " + std::to_string(kDefaultPort) + "; 0: a free one)")
      .Check(app::WholeNumber(0, kLargestPort));
  command.AddOption(
      "--http-address", options->address,
      "Address to listen on (default 127.0.0.1: only this machine). Any host that can reach it can read all results");
  command.AddList(
      "--http-host", options->hosts,
      "Host names that browsers may use in addition to the address and localhost; repeat it, or use commas");
  command.AddList("--dataset", options->datasets,
                  "Dataset folder for the 3D view (default: the embedded one); several: repeat it, or use commas",
                  app::IsExistingPath);
  AddResultFilterOptions(command, &options->filter);
  AddRuleOption(command, &options->rule);
  AddSourceOptions(command, &options->source);
  command.SetFooter(
      "Prints its address; Ctrl-C ends it with exit code 0. How to read the page: docs/how-to/page.md. /healthz and "
      "/metrics are for monitoring: docs/how-to/monitoring.md");
  command.WhenChosen([=] {
    options->build = invocation->build;
    invocation->body = [options] { return Serve(*options); };
  });
}

}  // namespace legopt::client
