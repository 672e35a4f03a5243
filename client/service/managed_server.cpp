#include "client/service/managed_server.h"

#include <chrono>
#include <utility>

#include "bus/endpoint.h"
#include "bus/lcm_transport.h"
#include "client/client_error.h"
#include "client/service/interrupt.h"

namespace legopt::client {
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

}  // namespace legopt::client
