#include "client/service/local_pool.h"

#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstdio>
#include <sstream>
#include <utility>
#include <vector>

#include "bus/lcm_transport.h"
#include "client/client_error.h"
#include "client/service/interrupt.h"
#include "programs/data_folder.h"

namespace legopt::client {
namespace {

using std::chrono::milliseconds;

constexpr char kServerProgram[] = "legopt-server";
constexpr char kWorkerProgram[] = "legopt-worker";
constexpr char kReadyWord[] = "ready";
constexpr milliseconds kServerStart{20'000};
constexpr milliseconds kServerStop{10'000};
constexpr milliseconds kWorkerLeave{3'000};
constexpr int kPortAttempts = 5;
constexpr int kMaxRestarts = 20;

// That names a cause other than a defect, and no end in good order.
bool NamesACause(int code) {
  const auto named = static_cast<ExitCode>(code);
  if (named == ExitCode::kOk || named == ExitCode::kInterrupted || named == ExitCode::kInternal) return false;
  return std::any_of(programs::kExitCodeTexts.begin(), programs::kExitCodeTexts.end(),
                     [named](const programs::ExitCodeText& known) { return known.code == named; });
}

// What ends us may be sent to all processes of a job (batch systems): a server that stopped at once could not take back
// what the worker gives back.
std::vector<std::string> OwnedByUs() { return {"--owner", std::to_string(::getpid())}; }

// From the log lines of a child: "[date] [program] [level] text".
std::string WithoutLogPrefix(const std::string& line, const std::string& program) {
  const std::string name = "[" + program + "] [";
  const auto level = line.find(name);
  if (line.rfind('[', 0) != 0 || level == std::string::npos) return line;
  const auto end = line.find("] ", level + name.size());
  return end == std::string::npos ? line : line.substr(end + 2);
}

[[noreturn]] void Fail(const std::string& program, const ChildProcess& child, const ChildExit& exit) {
  const auto code = exit.signal == 0 && NamesACause(exit.code) ? static_cast<ExitCode>(exit.code) : ExitCode::kInternal;
  const std::string words = LastWords(program, child.ErrorTail());
  throw ClientError(code, words.empty()
                              ? program + " ended with " + exit.Describe() + "; run again with --verbose to see its log"
                              : program + ": " + words);
}

// An end in good order that we did not ask for: somebody wants the run to end.
void ThrowIfToldToStop(const std::string& program, const ChildExit& exit) {
  const bool orderly =
      exit.code == static_cast<int>(ExitCode::kOk) || exit.code == static_cast<int>(ExitCode::kInterrupted);
  if (exit.signal == 0 && orderly) {
    throw ClientError(ExitCode::kInterrupted, program + " of this run was told to stop, not by us");
  }
}

}  // namespace

std::string LastWords(const std::string& program, const std::string& tail) {
  const std::string error_mark = "[" + program + "] [error] ";
  std::string words;
  bool is_error = false;
  std::istringstream lines(tail);
  for (std::string line; std::getline(lines, line);) {
    // What happens to the other job processes after the error only hides its cause.
    const bool error = line.find(error_mark) != std::string::npos;
    if (is_error && !error) continue;
    is_error = error;
    words = WithoutLogPrefix(line, program);
  }
  for (const std::string& prefix : {program + ": ", std::string("error: ")}) {
    if (words.rfind(prefix, 0) == 0) words.erase(0, prefix.size());
  }
  return words;
}

LocalPool::LocalPool(LocalPoolOptions options) : options_(std::move(options)) {
  // The group may come from the environment, the port only from a flag: a run is a deployment of its own.
  options_.network.group = options_.network.Resolve().group;
  options_.network.ttl = 0;
  chosen_port_ = !options_.network.port.has_value();
  StartServer();
  StartWorker();
}

LocalPool::~LocalPool() { Stop(milliseconds(0)); }

bool LocalPool::TryStartServer() {
  std::vector<std::string> arguments = {"--db",    options_.database.string(),
                                        "--group", *options_.network.group,
                                        "--port",  std::to_string(*options_.network.port),
                                        "--ttl",   "0"};
  for (const std::string& word : OwnedByUs()) arguments.push_back(word);
  if (options_.verbose) arguments.emplace_back("--verbose");
  server_ = std::make_unique<ChildProcess>(programs::ProgramFolder() / kServerProgram, arguments, !options_.verbose);
  if (server_->WaitForLine(kReadyWord, kServerStart, Interrupted)) return true;
  if (Interrupted()) throw ClientError(ExitCode::kInterrupted, "interrupted");
  const auto exit = server_->Poll();
  if (!exit) {
    throw ClientError(ExitCode::kUnreachable, std::string(kServerProgram) + " did not become ready within " +
                                                  std::to_string(kServerStart.count() / 1000) +
                                                  " s; run again with --verbose to see its log");
  }
  if (exit->signal == 0 && exit->code == static_cast<int>(ExitCode::kNetworkUnusable)) return false;
  Fail(kServerProgram, *server_, *exit);
}

void LocalPool::StartServer() {
  // Another program may take a port between our look and the server's bind: look again.
  const int attempts = chosen_port_ ? kPortAttempts : 1;
  for (int attempt = 1;; ++attempt) {
    if (chosen_port_ && !server_) options_.network.port = bus::FindFreePortPair(bus::RandomSeed());
    if (TryStartServer()) return;
    if (attempt == attempts) Fail(kServerProgram, *server_, *server_->Poll());
    server_.reset();
  }
}

void LocalPool::StartWorker() {
  std::vector<std::string> arguments = {"--slots",   std::to_string(options_.slots),
                                        "--dataset", options_.dataset.string(),
                                        "--group",   *options_.network.group,
                                        "--port",    std::to_string(*options_.network.port),
                                        "--ttl",     "0",
                                        "--name",    "local"};
  for (const std::filesystem::path& solver : options_.solvers) {
    arguments.insert(arguments.end(), {"--solver", solver.string()});
  }
  for (const std::string& word : OwnedByUs()) arguments.push_back(word);
  if (options_.verbose) arguments.emplace_back("--verbose");
  worker_ = std::make_unique<ChildProcess>(programs::ProgramFolder() / kWorkerProgram, arguments, !options_.verbose);
}

void LocalPool::CountRestart(const std::string& program, const ChildExit& exit) {
  std::fprintf(stderr, "\nlegopt: warning: %s ended with %s; starting it again\n", program.c_str(),
               exit.Describe().c_str());
  if (++restarts_ > kMaxRestarts) {
    throw ClientError(
        exit.signal == SIGKILL ? ExitCode::kMachine : ExitCode::kInternal,
        program + " was killed again and again, at last by " + exit.Describe() + "; run with --verbose to see why");
  }
}

void LocalPool::Supervise() {
  if (const auto exit = server_->Poll()) {
    ThrowIfToldToStop(kServerProgram, *exit);
    if (exit->signal == 0) Fail(kServerProgram, *server_, *exit);
    CountRestart(kServerProgram, *exit);
    // On the same port: the worker and our connection expect the server there.
    if (!TryStartServer()) Fail(kServerProgram, *server_, *server_->Poll());
  }
  if (const auto exit = worker_->Poll()) {
    ThrowIfToldToStop(kWorkerProgram, *exit);
    if (exit->signal == 0) Fail(kWorkerProgram, *worker_, *exit);
    CountRestart(kWorkerProgram, *exit);
    StartWorker();
  }
}

void LocalPool::Stop(milliseconds patience) {
  if (worker_) {
    // Finish what runs, take nothing new. Not SIGTERM: pending signals of one kind are one, and somebody else's does
    // not count.
    worker_->Signal(SIGINT);
    if (!worker_->Wait(patience, InterruptedTwice))
      worker_->Stop(kWorkerLeave, InterruptedTwice);  // a second one: at once
    worker_.reset();
  }
  if (server_) {
    server_->Stop(kServerStop, InterruptedTwice);
    server_.reset();
  }
}

}  // namespace legopt::client
