#include "client/service/managed_pool.h"

#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "app/data_folder.h"
#include "bus/endpoint.h"
#include "bus/lcm_transport.h"
#include "bus/message_key.h"
#include "client/client_error.h"
#include "client/service/interrupt.h"
#include "legopt/files/written_file.h"
#include "legopt/types/number_text.h"

namespace legopt::client {
namespace {

constexpr int kMaxRestarts = 20;

// Returns true for exit codes that name a cause other than a bug or an orderly end.
bool IsSpecificExitCode(int code) {
  const auto named = static_cast<ExitCode>(code);
  if (named == ExitCode::kOk || named == ExitCode::kInterrupted || named == ExitCode::kInternal) return false;
  return std::any_of(app::kExitCodeTexts.begin(), app::kExitCodeTexts.end(),
                     [named](const app::ExitCodeText& known) { return known.code == named; });
}

// Returns the message of a line that reports an error: "[date] [PROGRAM] [error] MESSAGE" or "PROGRAM: error: MESSAGE".
// Messages of other levels may quote such a line.
std::optional<std::string> ErrorIn(const std::string& line, const std::string& program) {
  const std::string logged = " [" + program + "] [error] ";
  const auto date_end = line.find(']');
  if (line.starts_with('[') && date_end != std::string::npos &&
      line.compare(date_end + 1, logged.size(), logged) == 0) {
    return line.substr(date_end + 1 + logged.size());
  }
  const std::string reported = program + ": error: ";
  if (line.starts_with(reported)) return line.substr(reported.size());
  return std::nullopt;
}

// Signals sent by users, batch systems and resource limits are not defects of the program.
ExitCode CodeOfSignal(int signal) {
  switch (signal) {
    case SIGKILL:
    case SIGXCPU:
      return ExitCode::kMachine;
    case SIGTERM:
    case SIGINT:
    case SIGHUP:
    case SIGQUIT:
      return ExitCode::kInterrupted;
    default:
      return ExitCode::kInternal;
  }
}

ExitCode CodeOf(const ChildExit& exit) {
  if (exit.signal != 0) return CodeOfSignal(exit.signal);
  return IsSpecificExitCode(exit.code) ? static_cast<ExitCode>(exit.code) : ExitCode::kInternal;
}

// Throws if the program ended orderly without an order of this process: a user wants the run to end.
void ThrowIfStoppedExternally(const std::string& program, const ChildExit& exit) {
  const bool orderly =
      exit.code == static_cast<int>(ExitCode::kOk) || exit.code == static_cast<int>(ExitCode::kInterrupted);
  if (exit.signal == 0 && orderly) {
    throw ClientError(ExitCode::kInterrupted, program + " of this run was stopped by another program");
  }
}

}  // namespace

std::string LastErrorMessage(const std::string& program, const std::string& tail) {
  std::string words;
  ClassicInput lines(tail);
  for (std::string line; std::getline(lines, line);) {
    if (const auto error = ErrorIn(line, program)) words = *error;
  }
  return words;
}

void ManagedProgram::Start(std::vector<std::string> arguments, std::span<const int> kept) {
  // Batch systems may send signals to all processes of a job: a server that stopped immediately could not re-queue the
  // jobs that the worker releases.
  arguments.insert(arguments.end(), {"--owner", std::to_string(::getpid())});
  if (verbose_) arguments.emplace_back("--verbose");
  child_ = std::make_unique<ChildProcess>(app::ProgramFolder() / name_, arguments, !verbose_, std::string(), kept);
}

bool ManagedProgram::WasKilled() {
  const auto exit = child_->Poll();
  if (!exit) return false;
  ThrowIfStoppedExternally(name_, *exit);
  if (exit->signal == 0) Fail();
  std::fprintf(stderr, "\nlegopt: warning: %s ended with %s; starting it again\n", name_.c_str(),
               exit->Describe().c_str());
  if (++restarts_ > kMaxRestarts) {
    throw ClientError(CodeOfSignal(exit->signal), name_ + " was killed again and again, at last by " +
                                                      exit->Describe() + "; run with --verbose to see why");
  }
  return true;
}

void ManagedProgram::Fail() {
  const ChildExit exit = child_->Poll().value_or(ChildExit{});
  const ExitCode code = CodeOf(exit);
  const std::string words = LastErrorMessage(name_, child_->ErrorTail());
  if (exit.signal == 0 && !words.empty()) throw ClientError(code, name_ + ": " + words);
  throw ClientError(code, name_ + " ended with " + exit.Describe() +
                              (words.empty() ? "; " + files::WriteAdvice("run again with --verbose to see its log")
                                             : "; it reported: " + words));
}

namespace {

using std::chrono::milliseconds;

constexpr char kServerProgram[] = "legopt-server";
constexpr char kReadyWord[] = "ready on";  // last line of the server's startup
constexpr milliseconds kServerStart{20'000};
constexpr milliseconds kServerStop{10'000};
constexpr int kPortAttempts = 5;

}  // namespace

ManagedServer::ManagedServer(OwnServerOptions options)
    : options_(std::move(options)), program_(kServerProgram, options_.verbose) {
  // The group may come from the environment, the port only from a flag: each run is a separate deployment.
  options_.network.group = options_.network.Resolve().group;
  options_.network.ttl = 0;
  Start();
}

bool ManagedServer::TryStart() {
  std::vector<std::string> arguments = {"--db",    options_.database.string(),
                                        "--group", *options_.network.group,
                                        "--port",  std::to_string(*options_.network.port),
                                        "--ttl",   "0"};
  if (options_.network.key_file) arguments.insert(arguments.end(), {"--key-file", *options_.network.key_file});
  arguments.insert(arguments.end(), options_.extra.begin(), options_.extra.end());
  program_.Start(std::move(arguments), options_.kept);
  if (program_.child().WaitForLine(kReadyWord, kServerStart, Interrupted)) return true;
  if (Interrupted()) throw ClientError(ExitCode::kInterrupted, "interrupted");
  const auto exit = program_.child().Poll();
  if (!exit) {
    throw ClientError(ExitCode::kUnreachable, std::string(kServerProgram) + " did not become ready within " +
                                                  std::to_string(kServerStart.count() / 1000) +
                                                  " s; run again with --verbose to see its log");
  }
  if (exit->signal == 0 && exit->code == static_cast<int>(ExitCode::kNetworkUnusable)) return false;
  program_.Fail();
}

void ManagedServer::Start() {
  // Another process may take the port before the server binds it: retry with another one.
  const bool chosen_port = !options_.network.port.has_value();
  const int attempts = chosen_port ? kPortAttempts : 1;
  for (int attempt = 1;; ++attempt) {
    if (chosen_port) options_.network.port = bus::FindFreePortPair(bus::RandomSeed());
    if (TryStart()) return;
    if (attempt == attempts) program_.Fail();
  }
}

void ManagedServer::Supervise() {
  if (!program_.WasKilled()) return;
  // Use the same port: the workers and this process's connection expect the server there.
  if (!TryStart()) program_.Fail();
}

void ManagedServer::Stop() {
  if (!program_.started()) return;
  program_.child().Stop(kServerStop, InterruptedTwice);
  program_.Drop();
}

namespace {

constexpr milliseconds kWorkerLeave{3'000};

std::string NameOf(const app::Descriptor& file) { return "/dev/fd/" + std::to_string(file.get()); }

NetworkOptions WithKey(NetworkOptions network, const app::Descriptor& key) {
  network.key_file = NameOf(key);
  return network;
}

}  // namespace

LocalPool::LocalPool(LocalPoolOptions options) : LocalPool(std::move(options), *bus::MessageKey::Random()) {}

LocalPool::LocalPool(LocalPoolOptions options, const bus::MessageKey& key)
    : options_(std::move(options)),
      key_(key.WriteInMemory()),
      worker_key_(key.ForRole(bus::KeyRole::kWorker)->WriteInMemory()),
      server_({options_.database,
               WithKey(options_.network, key_),
               options_.offered.empty() ? std::vector<std::string>()
                                        : std::vector<std::string>{"--datasets", options_.offered.string()},
               options_.verbose,
               {key_.get()}}),
      worker_("legopt-worker", options_.verbose) {
  StartWorker();
}

LocalPool::~LocalPool() { Stop(milliseconds(0)); }

void LocalPool::StartWorker() {
  std::vector<std::string> arguments = {"--slots",    std::to_string(options_.slots),
                                        "--dataset",  options_.dataset.string(),
                                        "--group",    *network().group,
                                        "--port",     std::to_string(*network().port),
                                        "--ttl",      "0",
                                        "--key-file", NameOf(worker_key_),
                                        "--name",     "local"};
  for (const std::filesystem::path& solver : options_.solvers) {
    arguments.insert(arguments.end(), {"--solver", solver.string()});
  }
  const std::array<int, 1> kept{worker_key_.get()};
  worker_.Start(std::move(arguments), kept);
}

void LocalPool::Supervise() {
  server_.Supervise();
  if (worker_.WasKilled()) StartWorker();
}

void LocalPool::Stop(milliseconds patience) {
  if (worker_.started()) {
    // The worker finishes running jobs and takes no new ones. SIGINT instead of SIGTERM: pending signals of one kind
    // are merged, and a SIGTERM from another process is ignored.
    worker_.child().Signal(SIGINT);
    if (!worker_.child().Wait(patience, InterruptedTwice)) {
      worker_.child().Stop(kWorkerLeave, InterruptedTwice);  // a second interruption kills immediately
    }
    worker_.Drop();
  }
  server_.Stop();
}

}  // namespace legopt::client
