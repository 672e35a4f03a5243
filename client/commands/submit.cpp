#include <algorithm>
#include <iostream>
#include <memory>

#include "app/command_line.h"
#include "app/isolated_call.h"
#include "app/printable.h"
#include "bus/bus_error.h"
#include "client/client_error.h"
#include "client/commands/commands.h"
#include "client/commands/dry_run.h"
#include "client/commands/submission.h"
#include "client/report/watching.h"
#include "client/service/interrupt.h"
#include "client/suite/experiment_spec.h"
#include "db/named_queries.h"
#include "legopt/dataset/dataset_archive.h"
#include "legopt/input/json.h"
#include "legopt/types/input_error.h"
#include "legopt/types/reply.h"

namespace legopt::client {
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
                              [&] { return PackDataset(submission.dataset_folder, CallIsolated); });
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
