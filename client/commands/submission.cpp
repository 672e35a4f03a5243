#include "client/commands/submission.h"

#include <algorithm>
#include <iostream>
#include <memory>

#include "app/command_line.h"
#include "app/folder_cache.h"
#include "app/printable.h"
#include "bus/bus_error.h"
#include "bus/field_check.h"
#include "bus/message_limits.h"
#include "client/client_error.h"
#include "client/commands/commands.h"
#include "client/commands/dry_run.h"
#include "client/report/result_dataset.h"
#include "client/report/watching.h"
#include "client/service/interrupt.h"
#include "client/suite/experiment_spec.h"
#include "client/suite/input_files.h"
#include "db/named_queries.h"
#include "legopt/dataset/dataset.h"
#include "legopt/dataset/internal/dataset_content.h"
#include "legopt/dataset/internal/dataset_file.h"
#include "legopt/files/written_file.h"
#include "legopt/import/internal/balance_check.h"
#include "legopt/import/internal/dataset_check.h"
#include "legopt/input/json.h"
#include "legopt/input/text.h"
#include "legopt/types/input_error.h"
#include "legopt/types/reply.h"
#include "worker/external/external_solvers.h"

namespace legopt::client {
namespace {

namespace limits = bus::spec_limits;

std::string Plural(std::int64_t count, const std::string& word) {
  return std::to_string(count) + " " + word + (count == 1 ? "" : "s");
}

/// Warns about implausible values before hours are spent on them.
void WarnAbout(const Dataset& dataset) {
  for (const DatasetDiagnostic& finding : CheckPlausibility(dataset)) {
    const std::string text = dataset.folder().string() + ": " + finding.field +
                             (finding.value.empty() ? "" : " (" + finding.value + ")") + ": " + finding.message + "; " +
                             finding.fix;
    std::cerr << "legopt: warning: " << app::Printable(text) << "\n";
  }
}

/// Refuses stances at which every posture counts as held.
void RequireBalance(const Dataset& dataset) {
  for (const DatasetDiagnostic& finding : CheckBalance(dataset)) {
    if (finding.severity != DatasetDiagnostic::Severity::kError) continue;
    throw InputError(
        {(dataset.folder() / finding.file).string(), finding.field, finding.value, finding.message, finding.fix});
  }
}

// A suite checks its own names; a name may also come from a file or folder.
void CheckName(const std::string& name, const std::string& file, const std::string& fix) {
  if (const auto fault = DiagnoseName(name)) throw InputError({file, "name", name, fault->message, fix});
  if (name.size() <= limits::kMostNameBytes) return;
  throw InputError({file, "name", name,
                    "must be UTF-8 of 1 to " + std::to_string(limits::kMostNameBytes) + " bytes, it has " +
                        std::to_string(name.size()),
                    fix});
}

void CheckSize(const Suite& suite, const Submission& submission) {
  if (submission.num_jobs > limits::kMaxJobs) {
    throw ClientError(ExitCode::kUsage, suite.file + ": " + std::to_string(submission.num_jobs) +
                                            " jobs are more than one experiment may have (" +
                                            std::to_string(limits::kMaxJobs) + "); split it");
  }
  const std::size_t bytes = Dump(submission.spec).size();
  if (bytes > limits::kMostBytes) {
    throw ClientError(ExitCode::kUsage, suite.file + ": written out, the experiment has " + std::to_string(bytes) +
                                            " bytes, more than can be sent (" + std::to_string(limits::kMostBytes) +
                                            "); split it");
  }
}

// Reports how the dataset's path is resolved for a suite from a pipe, which has no folder.
void ReportPlaceOfDataset(const Suite& suite) {
  if (!suite.dataset || !files::IsStream(suite.file)) return;
  std::cerr << "legopt: " << app::Printable(suite.file) << ": the dataset is relative to the working directory: "
            << app::Printable(std::filesystem::absolute(*suite.dataset).lexically_normal().string()) << "\n";
}

}  // namespace

Submission PrepareSubmission(const SuiteOptions& options) {
  std::vector<std::filesystem::path> solvers = options.solvers;
  for (std::filesystem::path& file : solvers) file = InputFile(file.string());
  Suite suite = ReadSuite(FindSuite(options.suite), external::RegistryWith(external::ReadDeclarations(solvers)));
  ReportPlaceOfDataset(suite);
  ApplyFilter(options.filter, &suite);
  if (options.null_row) AddNullRow(&suite);
  Submission submission;
  submission.dataset_folder =
      std::filesystem::absolute(ChooseDatasetFolder(options.dataset, &suite)).lexically_normal();
  const auto dataset = Dataset::Load(submission.dataset_folder, GuardedReader());
  RequireBalance(*dataset);
  WarnAbout(*dataset);
  const DatasetFacts facts = FactsOf(*dataset);
  CheckName(suite.name, suite.file, "give the suite another 'name'");
  CheckName(facts.name, (submission.dataset_folder / kDatasetFileName).string(),
            "choose another, then 'legopt dataset hash'");
  submission.spec = BuildSpec(suite, facts, &submission.left_out);
  if (const std::string name = SubmitterName(); !name.empty()) submission.spec["submitter"] = name;
  if (options.fresh || options.null_row) submission.spec["again"] = true;
  const bool task_lost = submission.spec.at("tasks").size() < suite.tasks.size();
  submission.surprising = !submission.left_out.empty() && (task_lost || !options.filter.problems.empty());
  submission.num_jobs = CountJobs(submission.spec);
  CheckSize(suite, submission);
  submission.id = options.fresh ? RandomSubmissionId() : ContentSubmissionId(submission.spec);
  return submission;
}

void RecordDataset(const Submission& submission) {
  RecordDatasetFolder(submission.spec.at("dataset").at("hash").get<std::string>(), submission.dataset_folder);
}

void WarnAboutOmittedProblems(const Submission& submission) {
  if (!submission.surprising) return;
  for (const auto& loss : submission.left_out) {
    std::cerr << "legopt: warning: " << loss << "; --max-stances takes them in\n";
  }
}

std::string DescribeJobs(const nlohmann::json& spec) {
  std::string problems;
  for (const auto& task : spec.at("tasks")) {
    if (!problems.empty()) problems += " + ";
    problems +=
        Plural(static_cast<std::int64_t>(task.at("problems").size()), task.at("task").get<std::string>() + " problem");
  }
  if (spec.at("tasks").size() > 1) problems = "(" + problems + ")";
  const auto count = [&spec](const char* key) { return static_cast<std::int64_t>(spec.at(key).size()); };
  return Plural(CountJobs(spec), "job") + ": " + Plural(count("methods"), "method") + " x " +
         Plural(count("initializations"), "initialization") + " x " + problems + " x " +
         Plural(spec.at("repetitions").get<std::int64_t>(), "repetition");
}

namespace {

struct SubmitOptions {
  SuiteOptions suite;
  NetworkOptions network;
  bool dry_run = false;
  bool wait = false;
  bool no_dataset = false;
  double patience_s = WatchOptions::kDefaultPatience_s;
  std::optional<double> give_up_s;
  bool json = false;
};

ExitCode Wait(ServerConnection& server, std::int64_t experiment_id, const SubmitOptions& options) {
  const InterruptGuard guard;
  try {
    const auto status = WatchOnTerminal(server, experiment_id,
                                        {Seconds(options.patience_s), true, {}, false, GiveUpOf(options.give_up_s)});
    if (const auto hint = FailureHint(status, ""); !hint.empty()) std::cerr << "legopt: " << hint << "\n";
    return OutcomeOf(status);
  } catch (const ClientError& error) {
    if (error.code() != ExitCode::kInterrupted) throw;
    std::cerr << "\nlegopt: experiment " << experiment_id << " continues; 'legopt watch " << experiment_id
              << "' returns to it, 'legopt cancel " << experiment_id << "' ends it\n";
    return ExitCode::kInterrupted;
  }
}

// The answer arrives when the experiment is on disk. Equal ids create one experiment, so it may be sent again.
legopt_msg::submit_reply Send(ServerConnection& server, const Submission& submission) {
  StoreOutageMonitor trouble;
  try {
    return server.Submit(submission.id, Dump(submission.spec), [&] { trouble.Look(server.Status(0), nullptr); });
  } catch (const ClientError& error) {
    if (error.code() == ExitCode::kUnreachable) trouble.ThrowIfAny();
    throw;
  }
}

// Lets the server store the dataset, so that its database is self-contained and workers can fetch it. The experiment
// does not depend on that, so a failure is a warning.
void SendDataset(ServerConnection& server, const Submission& submission) {
  std::string why;
  try {
    why = server.StoreDataset(submission.spec.at("dataset").at("hash").get<std::string>(),
                              [&] { return PackDataset(submission.dataset_folder, GuardedReader()); });
  } catch (const ClientError& error) {
    if (error.code() == ExitCode::kInterrupted) throw;
    why = error.what();
  } catch (const InputError& error) {
    why = error.what();
  }
  if (why.empty()) return;
  std::cerr << "legopt: warning: the server does not store the dataset with the results: " << app::Printable(why)
            << "; only workers that have the dataset take the jobs, and 'report', 'view', 'replay' and 'export' need "
               "--dataset\n";
}

// Reports that an identical experiment exists and nothing was started.
void ReportExistingExperiment(const ExperimentStatus& experiment) {
  std::cerr << "legopt: this experiment was submitted before, as " << experiment.id << ", and is "
            << ToString(experiment.state) << ": nothing was started; --again solves it anew\n";
}

// Returns earlier results of a running server; nullptr if there is none, because a dry run does not need them.
std::unique_ptr<ResultSource> OpenEarlierResults(NetworkOptions network) {
  constexpr double kPatience_s = 1.0;
  network.timeout_s = std::min(network.timeout_s, kPatience_s);
  try {
    auto source = OpenResults({std::nullopt, network});
    source->Query(db::Sql(db::Query::kExperimentCount));
    return source;
  } catch (const ClientError&) {
    return nullptr;
  } catch (const bus::BusError&) {
    return nullptr;
  }
}

ExitCode DryRunSubmission(const Submission& submission, const SubmitOptions& options) {
  const auto known = OpenEarlierResults(options.network);
  if (options.json) {
    PrintDryRunJson(submission, known.get());
  } else {
    PrintDryRun(submission, known.get(), 0, "nothing was submitted");
  }
  return ExitCode::kOk;
}

ExitCode Submit(const SubmitOptions& options) {
  const Submission submission = PrepareSubmission(options.suite);
  WarnAboutOmittedProblems(submission);
  if (options.dry_run) return DryRunSubmission(submission, options);
  ServerConnection server(options.network);
  const auto reply = Send(server, submission);
  const bool known = SubmitStatus{reply.status} == SubmitStatus::kAlreadyKnown;
  RecordDataset(submission);
  if (!options.no_dataset) SendDataset(server, submission);
  if (options.json) {
    std::cout << nlohmann::ordered_json{{"experiment_id", reply.experiment_id},
                                        {"jobs", reply.num_jobs},
                                        {"created", !known}}
              << std::endl;
  } else {
    std::cout << reply.experiment_id << std::endl;
  }
  if (known) {
    ReportExistingExperiment(ParseExperiments(server.Status(reply.experiment_id)).at(0));
  } else {
    std::cerr << DescribeJobs(submission.spec) << "\n";
  }
  return options.wait ? Wait(server, reply.experiment_id, options) : ExitCode::kOk;
}

}  // namespace

void AddSubmitCommand(const app::Command& program, Invocation* invocation) {
  const auto command = program.AddCommand("submit", "Submit an experiment to the server; prints its id");
  const auto options = std::make_shared<SubmitOptions>();
  AddSuiteOptions(command, &options->suite);
  command.AddFlag("--dry-run", options->dry_run, "Check everything and print counts, but submit nothing");
  command.AddFlag("--no-dataset", options->no_dataset,
                  "Do not send the dataset to the server (default: sent if the server lacks it and its archive has up "
                  "to 16 MiB; stored in the database, and handed out to workers that lack it)");
  command.AddFlag("--wait", options->wait, "Show progress until the experiment ends; its end decides the exit code");
  AddPatienceOption(command, &options->patience_s);
  AddGiveUpOption(command, &options->give_up_s);
  AddTextOrJsonOption(command, &options->json);
  AddNetworkOptions(command, &options->network);
  command.WhenChosen([=] { invocation->body = [options] { return Submit(*options); }; });
}

}  // namespace legopt::client
