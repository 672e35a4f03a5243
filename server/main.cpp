// legopt-server: the experiment service of a deployment with one database file.

#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <filesystem>
#include <iostream>
#include <limits>
#include <string>
#include <utility>

#include "app/arguments.h"
#include "app/build_identity.h"
#include "app/command_line.h"
#include "app/data_folder.h"
#include "app/exit_codes.h"
#include "app/log_format.h"
#include "app/network_flags.h"
#include "app/printable.h"
#include "app/program_main.h"
#include "app/stop_signals.h"
#include "bus/lcm_transport.h"
#include "bus/message_limits.h"
#include "db/database_file.h"
#include "db/sqlite_store.h"
#include "legopt/input/text.h"
#include "server/event_sinks.h"
#include "server/listening.h"
#include "server/server.h"
#include "server/single_server.h"

namespace legopt::server {
namespace {

using app::ExitCode;

constexpr char kProgram[] = "legopt-server";
constexpr microseconds kProbePatience{400'000};
constexpr microseconds kLongestWait{1'000'000};
constexpr std::int64_t kBytesPerMegabyte = 1'000'000;
constexpr microseconds kLinger{200'000};  // time for answering repeats of the last requests before the process ends

struct Arguments {
  std::filesystem::path database;
  app::NetworkFlags network;
  ListenFlags listen;
  std::optional<std::string> datasets;
  std::optional<std::string> notify;
  std::int64_t disk_reserve_mb = 1000;
  bool no_dataset = false;
  bool verbose = false;
  pid_t owner = 0;
};

std::int64_t SystemClock_us() {
  return std::chrono::duration_cast<microseconds>(std::chrono::system_clock::now().time_since_epoch()).count();
}

// Messages and the database store times since 1970; if the clock is set to an earlier time, 1970 is used.
std::int64_t WallClock() { return std::max<std::int64_t>(0, SystemClock_us()); }

std::string Hostname() {
  std::array<char, 256> name{};
  gethostname(name.data(), name.size() - 1);
  return DiagnoseName(name.data()) ? "unknown" : name.data();
}

ServerOptions OptionsFor(const Arguments& arguments) {
  ServerOptions options;
  options.scheduler.server_instance = bus::RandomEndpointId();
  options.version = app::ThisBuild("").version;
  options.hostname = Hostname();
  options.pid = getpid();
  options.database = std::filesystem::absolute(arguments.database).string();
  return options;
}

void WarnAboutNetwork(const bus::LcmTransport& transport) {
  if (const std::string warning = transport.receive_buffer_warning(); !warning.empty()) spdlog::warn(warning);
  if (const std::string warning = transport.missing_key_warning(); !warning.empty()) spdlog::warn(warning);
}

// Runs until a signal or a client stops the server, then answers repeats of its last requests for a moment. If a rival
// server of the deployment has precedence, it stops immediately as in a crash: acknowledged data is on disk, and its
// leases expire. `owned`: a command started this server and stops it after its workers, some of which may have been
// killed.
ExitCode ServeUntilStopped(Server& server, bus::Endpoint& endpoint, DuplicateServerDetector& rivals,
                           app::StopSignals& stop, EventSinks& outlets, bool owned) {
  bool foreign_reported = false;
  const std::array<pollfd, 1> extra{pollfd{stop.descriptor(), POLLIN, 0}};
  while (!server.shutdown_requested() && !stop.Take()) {
    server.Round(kLongestWait, extra);
    outlets.Work();
    rivals.Look();
    if (!rivals.rival().empty()) {
      spdlog::error("another server answers on this port ({}): stopping before it takes or spoils any more work",
                    rivals.rival());
      return ExitCode::kNetworkUnusable;
    }
    if (!foreign_reported && endpoint.counters().rejected_deployment > 0) {
      foreign_reported = true;
      spdlog::warn("another deployment uses this port; its messages are ignored. Give each its own --port");
    }
  }
  server.Drain();
  if (owned) server.RequeueRunningJobs("the command that ran the workers has ended them");
  const microseconds end = endpoint.now() + kLinger;
  while (endpoint.now() < end) server.Round(end - endpoint.now());
  spdlog::info("stopping");
  return ExitCode::kOk;
}

// The server creates and verifies the authentication tags of all roles.
void RequireFullKey(const bus::LcmTransport& transport, const bus::LcmOptions& network) {
  if (transport.key() == nullptr || transport.key()->role() == bus::KeyRole::kOperator) return;
  throw bus::BusError(bus::BusErrorCode::kInvalidOption,
                      "key file \"" + network.key_file + "\": holds a " +
                          std::string(ToString(transport.key()->role())) +
                          "'s key; a server needs the full key, from which that one was derived");
}

// Returns why this process is not the only server on these ports; empty if it is. The claim detects servers on this
// machine, the probe servers on others.
std::string DescribePortConflict(const PortClaim& claim, bus::LcmTransport& transport, const ServerOptions& options) {
  auto self = ProbeReply(options, microseconds(0), WallClock());
  // Without the claim, only probe, in order to describe the other server, and yield to all others.
  if (claim.taken()) self.server_instance = std::numeric_limits<std::int64_t>::max();
  const std::string obstacle = FindOtherServer(transport, bus::RandomSeed(), self, kProbePatience);
  if (!obstacle.empty() || !claim.taken()) return obstacle;
  return "another legopt-server of this machine uses UDP port " + std::to_string(*claim.taken()) +
         " (each uses its --port and the next one); stop it or choose another --port";
}

ExitCode Serve(const Arguments& arguments) {
  if (SystemClock_us() < 0) {
    app::ReportError("legopt-server",
                     "the clock of this machine shows a time before 1970; set it (timedatectl set-ntp true, "
                     "or as root: date --set='YYYY-MM-DD hh:mm') and start the server again");
    return ExitCode::kMachine;
  }
  app::StopSignals stop(arguments.owner);
  app::OfferedDatasets offered(arguments.datasets);
  // Set up the network first: a server that may not run leaves no database behind.
  const bus::LcmOptions network = arguments.network.Resolve();
  auto listener = OpenListener(arguments.listen, network);
  bus::LcmTransport transport(network);
  RequireFullKey(transport, network);
  WarnAboutNetwork(transport);
  const std::string address = network.group + ":" + std::to_string(network.port);
  ServerOptions options = OptionsFor(arguments);
  const PortClaim claim(network.port);
  if (const std::string obstacle = DescribePortConflict(claim, transport, options); !obstacle.empty()) {
    app::ReportError(kProgram, address + ": " + obstacle);
    return ExitCode::kNetworkUnusable;
  }
  const auto store = db::OpenSqliteStore(arguments.database);
  bus::Endpoint endpoint(transport, bus::kServer, bus::RandomSeed());
  QueryService queries(arguments.database);
  options.find_dataset = [&offered](const std::string& hash) {
    return offered.Find(hash, bus::fields::kMaxArchiveBytes);
  };
  EventSinks outlets(arguments.notify);
  options.on_event = [&outlets](const db::RecordEvent& event) { outlets.Take(event); };
  options.stopwatch = [] {
    return std::chrono::duration_cast<microseconds>(std::chrono::steady_clock::now().time_since_epoch());
  };
  options.disk_space = [database = arguments.database] { return db::SpaceAt(database); };
  options.store_datasets = !arguments.no_dataset;
  options.scheduler.disk_reserve_bytes = arguments.disk_reserve_mb * kBytesPerMegabyte;
  Server server(endpoint, *store, &queries, options, WallClock, bus::RandomEndpointId);
  DuplicateServerDetector rivals(endpoint, options.scheduler.server_instance);
  server.Work();
  const std::string access_file = arguments.listen.access.value_or(options.database + ".access");
  const auto hub = listener ? Listen(std::move(*listener), network, transport.deployment(), access_file) : nullptr;
  std::cout << "legopt-server ready on " << address << " with database " << app::Printable(options.database) << " (pid "
            << getpid() << ")" << std::endl;
  return ServeUntilStopped(server, endpoint, rivals, stop, outlets, arguments.owner != 0);
}

int Run(int argc, char** argv) {
  Arguments arguments;
  const app::BuildFacts build = app::ThisBuild("");
  app::Program program(
      kProgram,
      "The legopt experiment service: leases the jobs of submitted experiments to workers and stores their results.");
  program.SetVersion("legopt-server " + build.version, app::BuildReport(build));
  program.AddOption("--db", arguments.database, "Database file; created when missing").Required();
  app::AddNetworkFlags(program, &arguments.network);
  AddListenFlags(program, &arguments.listen);
  program
      .AddOption("--datasets", arguments.datasets,
                 "Folder of packed datasets ('legopt dataset pack') for workers that do not have them")
      .ValueName("FOLDER");
  program
      .AddOption(
          "--notify", arguments.notify,
          "Program to start for events that need a person (docs/how-to/monitoring.md), with the event as JSON on its "
          "standard input; no shell, at most one a second")
      .ValueName("COMMAND");
  program
      .AddOption("--disk-reserve", arguments.disk_reserve_mb,
                 "Refuse experiments that would leave less free where the database is; at most 5 % of that disk")
      .ValueName("MB")
      .Check(app::WholeNumber(0, 1'000'000'000))
      .ShowDefault();
  program.AddFlag("--no-dataset", arguments.no_dataset,
                  "Do not store the datasets of that folder in the database with their results");
  program.AddFlag("-v,--verbose", arguments.verbose, "Log what happens to stderr");
  // For a parent process that runs this server as a part of itself ('legopt run'); hidden from users.
  program.AddOption("--owner", arguments.owner, "Process whose orders to stop count; no others do").Group("");
  program.SetFooter(
      app::ExitCodeHelp({ExitCode::kOk, ExitCode::kUsage, ExitCode::kDatabaseUnusable, ExitCode::kNetworkUnusable,
                         ExitCode::kNewerDatabase, ExitCode::kInternal, ExitCode::kMachine}));
  if (const auto status = app::ParseCommandLine(program, argc, argv)) return *status;
  spdlog::set_level(arguments.verbose ? spdlog::level::debug : spdlog::level::warn);
  return StatusOf(Serve(arguments));
}

// Reports database errors; app::RunProgram reports all others.
int RunReportingStore(int argc, char** argv) {
  using db::StoreErrorCode;
  try {
    return Run(argc, argv);
  } catch (const db::StoreError& error) {
    const bool defect = error.code() == StoreErrorCode::kConstraint || error.code() == StoreErrorCode::kBadQuery;
    ExitCode code = defect ? ExitCode::kInternal : ExitCode::kDatabaseUnusable;
    if (error.code() == StoreErrorCode::kNewerSchema) code = ExitCode::kNewerDatabase;
    if (error.code() == StoreErrorCode::kShortage) code = ExitCode::kMachine;
    return app::ReportFailure(kProgram, code, error.what());
  } catch (const SpecError& error) {
    return app::ReportFailure(kProgram, ExitCode::kDatabaseUnusable,
                              std::string("the database holds an illegal experiment: ") + error.what());
  }
}

}  // namespace
}  // namespace legopt::server

int main(int argc, char** argv) {
  using legopt::server::kProgram;
  return legopt::app::RunProgram(kProgram, legopt::app::ProcessKind::kService, [&] {
    // Standard output is reserved for the "ready" line.
    const auto logger = spdlog::stderr_logger_mt(kProgram);
    legopt::app::FormatPrintably(*logger);
    spdlog::set_default_logger(logger);
    return legopt::server::RunReportingStore(argc, argv);
  });
}
