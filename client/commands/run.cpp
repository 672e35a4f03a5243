#include "client/commands/run.h"

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <ctime>
#include <exception>
#include <iostream>
#include <memory>
#include <span>
#include <system_error>

#include "app/build_identity.h"
#include "app/command_line.h"
#include "app/data_folder.h"
#include "app/host_resources.h"
#include "app/printable.h"
#include "client/client_error.h"
#include "client/commands/commands.h"
#include "client/commands/dry_run.h"
#include "client/commands/submission.h"
#include "client/pool/packed_dataset.h"
#include "client/pool/slurm_pool.h"
#include "client/report/certificate_report.h"
#include "client/report/reading.h"
#include "client/report/result_source.h"
#include "client/report/watching.h"
#include "client/service/interrupt.h"
#include "client/service/managed_pool.h"
#include "client/suite/input_files.h"
#include "db/database_file.h"
#include "legopt/files/written_file.h"
#include "legopt/input/json.h"
#include "legopt/types/input_error.h"
#include "legopt/types/reply.h"

namespace legopt::client {
namespace {

bool HoldsExperiments(const std::filesystem::path& file) {
  try {
    return HasExperiments(*OpenResults({file.string(), {}}));
  } catch (const std::exception&) {
    return false;  // no database was created
  }
}

}  // namespace

NewDatabase::NewDatabase(const std::optional<std::string>& named, const std::string& stem)
    : path_(named.value_or(stem + ".sqlite")) {
  std::error_code error;
  if (named) {
    // The server reports a missing or unwritable folder.
    created_ = !std::filesystem::exists(path_, error) && !error;
    return;
  }
  for (int i = 2; !files::ReserveFileName(path_); ++i) path_ = stem + "-" + std::to_string(i) + ".sqlite";
  created_ = true;
}

NewDatabase::~NewDatabase() {
  std::error_code error;
  if (!created_ || !std::filesystem::exists(path_, error)) return;
  try {
    const db::LockFile lock(path_);
    if (HoldsExperiments(path_)) return;
    for (const char* suffix : {"", "-wal", "-shm", "-journal"}) std::filesystem::remove(path_.string() + suffix, error);
  } catch (const std::exception&) {
    return;  // a server uses it
  }
}

namespace {

using std::chrono::milliseconds;

constexpr int kMaxWorkers = 1024;
// A server of this command that was killed restarts within two seconds.
constexpr Seconds kServerPatience{60};
constexpr milliseconds kCallTimeout{2000};
constexpr milliseconds kStopPatience{3000};

struct RunOptions {
  SuiteOptions suite;
  NetworkOptions network;
  std::optional<std::string> db;
  bool dry_run = false;
  bool any_build = false;
  std::optional<double> give_up_s;
  bool no_dataset = false;
  std::optional<std::string> slurm;
  std::optional<PoolFile> pool;  // its contents
  app::BuildFacts build;
  int workers = 0;  // 0 until ResolveWorkerCount
  std::string workers_reason;
  TableFormat format = TableFormat::kText;
  std::optional<Rule> rule;
  TimeUnit time_unit = kMilliseconds;
  OutputOptions output;
};

// e.g. quick-20261121-103000
std::string NewDatabaseStem(const std::string& suite) {
  std::string stem;
  for (const char c : suite) stem += std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '-' || c == '_' ? c : '-';
  const std::time_t now = std::time(nullptr);
  std::tm local{};
  ::localtime_r(&now, &local);
  char time[32];
  std::strftime(time, sizeof(time), "-%Y%m%d-%H%M%S", &local);
  return stem + time;
}

void PrintStart(const Submission& submission, const legopt_msg::submit_reply& reply, const std::filesystem::path& db) {
  std::cerr << "experiment " << reply.experiment_id << " in " << app::Printable(db.string()) << ", dataset "
            << app::Printable(submission.dataset_folder.string()) << "\n"
            << DescribeJobs(submission.spec) << "\n";
  if (SubmitStatus{reply.status} == SubmitStatus::kAlreadyKnown) {
    std::cerr
        << "this experiment is in the database already: finished jobs are kept (--again makes another experiment)\n";
  }
}

struct Outcome {
  std::int64_t experiment_id = 0;
  bool interrupted = false;
  ExperimentStatus status;
};

// A server that is too busy to report its status may still be storing the experiment.
void LookAt(ServerConnection& server, StoreOutageMonitor& trouble) {
  server.set_timeout(kCallTimeout);
  try {
    trouble.Look(server.Status(0), nullptr);
  } catch (const ClientError& error) {
    if (error.code() != ExitCode::kUnreachable) throw;
  }
}

// Throws if another build started the experiment: all local workers have this build, so it would wait forever.
void RequireBuild(ServerConnection& server, std::int64_t experiment_id, const RunOptions& options) {
  const auto experiments = ParseExperiments(server.Status(experiment_id));
  if (experiments.empty() || experiments.front().over()) return;
  const ExperimentStatus& experiment = experiments.front();
  const std::string mine = app::BuildId(options.build);
  if (experiment.builds == BuildPolicy::kAny || experiment.build_id.empty() || experiment.build_id == mine) return;
  if (options.any_build) {
    legopt_msg::control_request request{};
    request.experiment_id = experiment_id;
    request.action = EnumNumber(ControlAction::kResumeAnyBuild);
    server.Control(request);
    return;
  }
  throw ClientError(ExitCode::kUsage, "experiment " + std::to_string(experiment_id) + " was begun by build " +
                                          experiment.build_id + ", and this is build " + mine + " (" +
                                          app::BuildName(options.build) +
                                          "); finish it with that build, give --any-build to mix their results, or "
                                          "--again for another experiment");
}

Outcome RunExperiment(const Submission& submission, const RunOptions& options, ManagedPool& pool,
                      const std::filesystem::path& db) {
  Outcome outcome;
  StoreOutageMonitor trouble;
  try {
    ServerConnection server(pool.network());
    const auto reply = server.Submit(submission.id, Dump(submission.spec), [&] {
      pool.Supervise();
      LookAt(server, trouble);
    });
    server.set_timeout(kCallTimeout);
    outcome.experiment_id = reply.experiment_id;
    PrintStart(submission, reply, db);
    if (SubmitStatus{reply.status} == SubmitStatus::kAlreadyKnown) RequireBuild(server, reply.experiment_id, options);
    if (!options.pool) {
      std::cerr << options.workers << (options.workers == 1 ? " worker" : " workers") << options.workers_reason << "; ";
    }
    std::cerr << "Ctrl-C stops and keeps all results\n";
    outcome.status = WatchOnTerminal(
        server, reply.experiment_id,
        {kServerPatience, true, [&pool] { pool.Supervise(); }, !options.pool, GiveUpOf(options.give_up_s)});
  } catch (const ClientError& error) {
    if (error.code() != ExitCode::kInterrupted) throw;
    trouble.ThrowIfAny();
    outcome.interrupted = true;
    if (!Interrupted()) std::cerr << "\nlegopt: " << error.what() << "\n";
    std::cerr << "\nlegopt: interrupted; running jobs are re-queued (again: stop at once)\n";
  }
  return outcome;
}

// For suggested commands that need the problem definitions; empty for their default, the embedded dataset.
std::string DatasetFlag(const std::filesystem::path& folder) {
  std::error_code ignored;
  return std::filesystem::equivalent(folder, app::DefaultDatasetFolder(), ignored)
             ? ""
             : " --dataset " + app::ShellWord(folder);
}

void PrintNextSteps(const std::string& db, const std::filesystem::path& dataset, const Outcome& outcome) {
  const std::string id = std::to_string(outcome.experiment_id);
  const std::string flags = app::Printable(" --db " + app::ShellWord(db));
  const std::string dataset_flag = app::Printable(DatasetFlag(dataset));
  std::cerr << "\nResults: " << app::Printable(db) << "\n"
            << "  legopt table " << id << flags << " --format latex\n"
            << "  legopt report " << id << flags << dataset_flag << " --out report.html\n"
            << "  legopt list " << id << flags << " --unsolved\n"
            << "  legopt query \"SELECT * FROM benchmark_table\"" << flags << "\n"
            << "  legopt export " << id << flags << dataset_flag << " --out solutions.json\n";
}

ExitCode Finish(const RunOptions& options, const std::string& db, const std::filesystem::path& dataset,
                const Outcome& outcome) {
  if (outcome.experiment_id == 0) return ExitCode::kInterrupted;
  const auto source = OpenResults({db, {}});
  const TableSelection selection{outcome.experiment_id, RuleFor(*source, outcome.experiment_id, options.rule)};
  BenchmarkTable table = ReadBenchmarkTable(*source, selection);
  if (const auto certificate = FindCertificate(dataset, FindExperiment(*source, outcome.experiment_id))) {
    AddCertifiedCounts(*source, *certificate, &table);
  }
  std::cout << (options.format == TableFormat::kText ? "\n" : "")
            << RenderBenchmarkTable(table, options.format, {options.time_unit, LayoutOf(options.output)}) << std::flush;
  if (outcome.interrupted) {
    std::cerr << "\nStopped before the end. To go on, give the same command with --db "
              << app::Printable(app::ShellWord(db)) << "\n";
    return ExitCode::kInterrupted;
  }
  if (outcome.status.state == ExperimentState::kCancelled) {
    std::cerr << "\nlegopt: this experiment was cancelled; --again runs it anew\n";
  }
  if (const auto hint = FailureHint(outcome.status, source->flags()); !hint.empty()) {
    std::cerr << "\nlegopt: " << hint << "\n";
  }
  PrintNextSteps(db, dataset, outcome);
  return OutcomeOf(outcome.status);
}

SlurmPoolOptions PoolOptionsOf(const RunOptions& options, const Submission& submission,
                               const std::filesystem::path& db) {
  return {*options.pool, db, submission.dataset_folder, options.network, options.suite.solvers, !options.no_dataset};
}

ExitCode DryRun(const Submission& submission, const RunOptions& options, const std::filesystem::path& db) {
  const bool exists = std::filesystem::exists(db);
  const auto known = exists ? OpenResults({db.string(), {}}) : nullptr;
  if (options.format == TableFormat::kJson) {
    PrintDryRunJson(submission, known.get());
    return ExitCode::kOk;
  }
  const std::string server = "legopt-server --db " + app::ShellWord(db.string()) + (exists ? " (existing)" : " (new)");
  const std::string workers = options.pool
                                  ? "and have Slurm take in the script below; nothing"
                                  : "legopt-worker --slots " + std::to_string(options.workers) + " --dataset " +
                                        app::ShellWord(submission.dataset_folder.string()) + "; nothing";
  PrintDryRun(submission, known.get(), options.workers, "would start: " + server + ", " + workers + " was started");
  if (options.pool) std::cout << "\n" << PreviewScript(PoolOptionsOf(options, submission, db)) << std::flush;
  return ExitCode::kOk;
}

// Lets the server store the dataset with the results, so that the database is self-contained. Returns nullptr if this
// is not wanted or not possible.
std::unique_ptr<OfferedFolder> OfferDataset(const RunOptions& options, const Submission& submission) {
  if (options.no_dataset || options.pool) return nullptr;
  try {
    return std::make_unique<OfferedFolder>(submission.dataset_folder);
  } catch (const InputError& error) {
    std::cerr << "legopt: warning: the dataset is not stored with the results: " << error.what() << "\n";
    return nullptr;
  }
}

std::unique_ptr<ManagedPool> StartPool(const RunOptions& options, const Submission& submission,
                                       const std::filesystem::path& db, const std::filesystem::path& offered,
                                       bool verbose) {
  const std::filesystem::path& dataset = submission.dataset_folder;
  if (options.pool) {
    SlurmPoolOptions pool = PoolOptionsOf(options, submission, db);
    pool.verbose = verbose;
    return std::make_unique<SlurmPool>(std::move(pool));
  }
  return std::make_unique<LocalPool>(
      LocalPoolOptions{db, dataset, options.workers, options.network, options.suite.solvers, offered, verbose});
}

std::vector<std::filesystem::path> InputsOf(const SuiteOptions& options) {
  std::vector<std::filesystem::path> names = options.solvers;
  names.emplace_back(options.suite);
  return names;
}

Submission PrepareFrom(const SuiteOptions& options, std::span<const std::unique_ptr<RereadableFile>> copies) {
  try {
    return PrepareSubmission(options);
  } catch (const InputError& error) {
    throw WithGivenNames(error, copies);
  }
}

ExitCode Run(RunOptions& options, bool verbose) {
  if (options.slurm) options.pool = ReadPoolFile(*options.slurm, Engine::kSlurm);
  RequireOneStandardInput(InputsOf(options.suite));
  const auto solver_copies = MakeRereadable(options.suite.solvers);  // the workers read them again
  const Submission submission = PrepareFrom(options.suite, solver_copies);
  WarnAboutOmittedProblems(submission);
  const std::string stem = options.db ? "" : NewDatabaseStem(submission.spec.at("name").get<std::string>());
  if (options.dry_run) return DryRun(submission, options, options.db.value_or(stem + ".sqlite"));
  const NewDatabase database(options.db, stem);
  const std::filesystem::path& db = database.path();
  const InterruptGuard guard;
  Outcome outcome;
  {
    const std::unique_ptr<OfferedFolder> offered = OfferDataset(options, submission);
    const std::unique_ptr<ManagedPool> pool =
        StartPool(options, submission, db, offered ? offered->path() : std::filesystem::path(), verbose);
    RecordDataset(submission);
    outcome = RunExperiment(submission, options, *pool, db);
    pool->Stop(kStopPatience);
  }
  return Finish(options, db.string(), submission.dataset_folder, outcome);
}

// Uses the rule for legopt-worker's slots.
void ResolveWorkerCount(RunOptions& options) {
  const app::ProcessorGrant grant = app::GrantedProcessors(app::ReadProcessorFacts());
  if (options.workers > grant.processors) {
    std::cerr << "legopt: warning: --workers " << options.workers << " is more than was granted: " << grant.reason
              << ". Jobs will take turns, and their wall times tell nothing\n";
  } else if (options.workers == 0) {
    options.workers = std::min(grant.processors, kMaxWorkers);
    options.workers_reason = " (" + grant.reason + ")";
  }
}

}  // namespace

void AddRunCommand(const app::Command& program, Invocation* invocation) {
  const auto command = program.AddCommand(
      "run", "Run an experiment on this machine: server, workers, progress and table in one command");
  const auto options = std::make_shared<RunOptions>();
  AddSuiteOptions(command, &options->suite);
  command.AddOption(
      "--db", options->db,
      "Database file (default: made from suite and time). An unfinished experiment of the same content in "
      "it is continued");
  const auto workers = command
                           .AddOption("--workers", options->workers,
                                      "Number of parallel jobs (default: the processors granted to this process)")
                           .Check(app::WholeNumber(1, kMaxWorkers));
  command
      .AddOption("--slurm", options->slurm,
                 "Workers on nodes of Slurm, as this pool file says (docs/how-to/clusters.md), with the server here")
      .ValueName("FILE")
      .Excludes(workers);
  command.AddFlag("--dry-run", options->dry_run, "Check everything and print counts, but start nothing");
  command.AddFlag("--no-dataset", options->no_dataset,
                  "Do not store the dataset in the database (default: stored if its archive has up to 16 MiB)");
  command.AddFlag("--any-build", options->any_build,
                  "Continue an experiment that another build started; tables then name both builds");
  AddGiveUpOption(command, &options->give_up_s);
  AddFormatOption(command, &options->format);
  AddRuleOption(command, &options->rule);
  AddTimeUnitOption(command, &options->time_unit);
  AddLayoutOptions(command, &options->output);
  command.AddOption("--port", options->network.port, "Control port (default: a free pair of ports)").Group("Network");
  command.AddOption("--group", options->network.group, "Multicast group").Group("Network");
  command.WhenChosen([=] {
    if (!options->slurm) ResolveWorkerCount(*options);
    options->build = invocation->build;
    invocation->body = [options, invocation] { return Run(*options, invocation->verbose); };
  });
}

}  // namespace legopt::client
