#include "worker/worker_main.h"

#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cstdio>
#include <exception>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "app/arguments.h"
#include "app/command_line.h"
#include "app/data_folder.h"
#include "app/exit_codes.h"
#include "app/folder_cache.h"
#include "app/host_resources.h"
#include "app/isolated_call.h"
#include "app/log_format.h"
#include "app/network_flags.h"
#include "app/printable.h"
#include "app/program_main.h"
#include "app/stop_signals.h"
#include "bus/bridge/uplink.h"
#include "bus/bus_error.h"
#include "bus/endpoint.h"
#include "bus/lcm_transport.h"
#include "legopt/input/text.h"
#include "legopt/types/input_error.h"
#include "worker/dataset_fetch.h"
#include "worker/external/solver_confinement.h"
#include "worker/job_process.h"
#include "worker/supervisor.h"

namespace legopt::worker {
namespace {

constexpr char kWorkerProgram[] = "legopt-worker";
constexpr std::string_view kChildFlag = "--child";
constexpr int kMaxSlots = 1024;
constexpr double kShortest_s = 0.001, kLongest_s = 604'800;  // a week
constexpr std::size_t kMaxNameBytes = 200;

double Seconds(microseconds duration) { return std::chrono::duration<double>(duration).count(); }

microseconds Microseconds(double duration_s) {
  return std::chrono::duration_cast<microseconds>(std::chrono::duration<double>(duration_s));
}

struct CommandLine {
  std::optional<int> slots;
  WorkerInputs inputs;
  std::string name;
  app::NetworkFlags network;
  std::optional<std::string> access;
  double wait_server_s = 0;
  double drain_s = Seconds(PoolOptions().drain);
  double idle_timeout_s = 0;
  bool exit_when_idle = false;
  pid_t owner = 0;
  bool verbose = false;
};

std::string HostName() {
  std::array<char, kMaxNameBytes> name{};
  if (gethostname(name.data(), name.size() - 1) != 0 || DiagnoseName(name.data())) return "unknown";
  return name.data();
}

std::string FaultOfWorkerName(const std::string& name) {
  if (name.size() > kMaxNameBytes) return "has more than " + std::to_string(kMaxNameBytes) + " bytes";
  const auto fault = name.empty() ? std::nullopt : DiagnoseName(name);
  return fault ? fault->message + " (got '" + name + "'); " + fault->fix : "";
}

void Define(app::Program& program, CommandLine& line) {
  program
      .AddOption("--slots", line.slots,
                 "Jobs at the same time, one process each (default: the processors granted to this process by its "
                 "affinity, Slurm, and the CPU quota of its control group, one of each physical core). As many as "
                 "cores are kept on one each")
      .Check(app::WholeNumber(1, kMaxSlots));
  program
      .AddOption("--dataset", line.inputs.datasets,
                 "Dataset whose jobs this worker takes: a folder, the name of an embedded one, or a content hash "
                 "('legopt dataset info'), then the embedded ones, ~/.cache/legopt and the server are asked for it; "
                 "may be repeated (default: the "
                 "embedded ones, garage-easier and garage-hard, and those that the server has stored)")
      .ValueName("FOLDER|NAME|HASH");
  program.AddOption("--solver", line.inputs.solvers,
                    "Description file of an external solver that jobs may need; may be repeated "
                    "(docs/reference/external-solvers.md)");
  program.AddOption("--name", line.name, "Name in tables and listings (default: the host's)")
      .Check({FaultOfWorkerName, ""});
  program.AddFlag("--exit-when-idle", line.exit_when_idle,
                  "Leave when every experiment of the server is over (also when it has none)");
  program
      .AddOption("--idle-timeout", line.idle_timeout_s,
                 "Seconds without a job after which to leave, server or not (default: never)")
      .Check(app::Number(kShortest_s, kLongest_s));
  program
      .AddOption("--drain", line.drain_s,
                 "Seconds that running jobs may continue after the first signal; then they are released (default 8)")
      .Check(app::Number(0, kLongest_s));
  program
      .AddOption("--wait-server", line.wait_server_s,
                 "Seconds without any answer of a server after which to give up (default: never)")
      .Check(app::Number(kShortest_s, kLongest_s));
  program.AddFlag("-v,--verbose", line.verbose, "Tell what happens, job processes included");
  app::AddNetworkFlags(program, &line.network);
  program
      .AddOption("--access", line.access,
                 "Reach the server without multicast, at the addresses in this file of 'legopt-server --listen'; LCM "
                 "stays on this machine, on ports of this worker's own")
      .ValueName("FILE")
      .Group(app::kNetworkHeading);
  // Used by a program that starts the worker as a part of itself ('legopt run'); hidden from users.
  program.AddOption("--owner", line.owner, "Process whose orders to stop count; no others do").Group("");
  program.SetFooter(
      "Stop it with SIGTERM or Ctrl-C: it takes no more jobs, finishes those that end within --drain and gives the\n"
      "others back, which costs them no attempt; a second signal gives them back at once.\n" +
      app::ExitCodeHelp({ExitCode::kOk, ExitCode::kUsage, ExitCode::kUnreachable, ExitCode::kDatasetMismatch,
                         ExitCode::kNetworkUnusable, ExitCode::kInterrupted, ExitCode::kInternal, ExitCode::kMachine}));
}

// Returns --child SUPERVISOR_PID COUNT DECLARATION... FOLDER...; used by SupervisorMain only.
std::vector<std::string> ChildCommand(const WorkerInputs& inputs) {
  // Uses the running program even if its file has been replaced since, so that all processes of a worker have the same
  // build. Without /proc, uses the file that has its name now.
  constexpr char kThisProgram[] = "/proc/self/exe";
  const bool known = access(kThisProgram, X_OK) == 0;
  std::vector<std::string> command = {known ? kThisProgram : app::ProgramFile().string(), std::string(kChildFlag),
                                      std::to_string(getpid()), std::to_string(inputs.solvers.size())};
  for (const std::filesystem::path& declaration : inputs.solvers) command.push_back(declaration.string());
  for (const std::filesystem::path& dataset : inputs.datasets) command.push_back(dataset.string());
  return command;
}

bool ReadNumber(std::string_view word, int* number) {
  return std::from_chars(word.data(), word.data() + word.size(), *number).ec == std::errc{};
}

int ChildMain(int argc, char** argv, const ExecutorFactory& make_executor) {
  constexpr int kFirstDeclaration = 4;
  int supervisor_pid = 0, declarations = 0;
  if (argc < kFirstDeclaration || !ReadNumber(argv[2], &supervisor_pid) || !ReadNumber(argv[3], &declarations) ||
      declarations < 0 || declarations > argc - kFirstDeclaration) {
    std::fprintf(stderr, "legopt-worker: %s is for the worker itself\n", argv[1]);
    return StatusOf(ExitCode::kUsage);
  }
  char** const folders = argv + kFirstDeclaration + declarations;
  WorkerInputs inputs;
  inputs.solvers.assign(argv + kFirstDeclaration, folders);
  inputs.datasets.assign(folders, argv + argc);
  const std::unique_ptr<JobExecutor> executor = make_executor(std::move(inputs));
  return RunJobProcess(ChildProcess::kSocket, supervisor_pid, *executor);
}

void DescribeHost(PoolOptions& pool) {
  const app::HostFacts host = app::ReadHostFacts();
  pool.processor = host.processor;
  pool.processors = app::GrantedProcessors(app::ReadProcessorFacts()).processors;
  pool.memory_bytes = host.memory_bytes;
  pool.load = [] { return app::HostLoad(); };
}

std::vector<int> PlacesOf(int slots) { return app::ProcessorsOfSlots(slots, app::OneOfEachCore(app::AffinityMask())); }

SupervisorOptions OptionsOf(const CommandLine& line, const app::BuildFacts& build, const bridge::ServerUplink& uplink) {
  SupervisorOptions options;
  PoolOptions& pool = options.pool;
  pool.slots = *line.slots;
  pool.hostname = HostName();
  pool.name = line.name.empty() ? pool.hostname : line.name;
  pool.pid = getpid();
  pool.build = app::BuildName(build);
  pool.build_id = app::BuildId(build);
  DescribeHost(pool);
  pool.seed = bus::RandomSeed();
  pool.protocol_version = bus::kProtocolVersion;
  pool.server_address = uplink.server_address;
  pool.bridged = uplink.bridged();
  pool.exit_when_idle = line.exit_when_idle;
  pool.key_file = uplink.network.key_file;
  pool.drain = Microseconds(line.drain_s);
  if (line.wait_server_s > 0) pool.wait_server = Microseconds(line.wait_server_s);
  if (line.idle_timeout_s > 0) pool.idle_timeout = Microseconds(line.idle_timeout_s);
  options.slot_processors = PlacesOf(pool.slots);
  return options;
}

// Reduces the number of slots if not all of them can have their descriptors. Returns the reason, or an empty text if
// all can. Throws std::system_error if not even one slot can.
std::string FitSlotsToDescriptors(int& slots) {
  constexpr std::size_t kFilesOfSlot = 3, kFilesToStart = 5;  // one job process; starting one
  constexpr std::size_t kOwn = app::kFewestDescriptors + kFilesToStart;
  const std::size_t free = app::FreeDescriptors(kOwn + kFilesOfSlot * static_cast<std::size_t>(slots));
  const int fit = free <= kOwn ? 0 : static_cast<int>((free - kOwn) / kFilesOfSlot);
  if (fit >= slots) return {};
  const std::string reason =
      "only " + std::to_string(free) + " more files can be opened ('ulimit -n'), 3 for each slot";
  if (fit == 0) throw std::system_error(EMFILE, std::generic_category(), reason + "; raise 'ulimit -n'");
  return std::to_string(std::exchange(slots, fit)) + " slots would be too many: " + reason;
}

// Uses as many slots as processors were granted, unless the user specified a number, and prints the number with its
// reason. Prints to standard output, so that a log of warnings stays empty if there are none.
void ResolveSlotCount(CommandLine& line, spdlog::logger& logger) {
  const app::ProcessorGrant grant = app::GrantedProcessors(app::ReadProcessorFacts());
  if (line.slots && *line.slots > grant.processors) {
    logger.warn("--slots {} is more than was granted: {}. Jobs will take turns, and their wall times tell nothing",
                *line.slots, grant.reason);
  }
  const bool told = line.slots.has_value();
  if (!told) line.slots = std::min(grant.processors, kMaxSlots);
  const std::string reduced = FitSlotsToDescriptors(*line.slots);
  if (!reduced.empty()) logger.warn("{} slots: {}", *line.slots, reduced);
  const std::string granted = (told ? "told by --slots; " : "") + grant.reason;
  std::printf("legopt-worker: %d slot%s: %s%s\n", *line.slots, *line.slots == 1 ? "" : "s",
              reduced.empty() ? granted.c_str() : reduced.c_str(),
              PlacesOf(*line.slots).empty() ? "" : "; each is kept on a core of its own");
  std::fflush(stdout);
}

// Runs one pool after another, each with an additional dataset that jobs wait for.
ExitCode RunPools(WorkerInputs inputs, SupervisorOptions options, const DatasetCache& cache, ServerLink& link,
                  const DatasetSearchContext& around) {
  options.pool.fetch_datasets = inputs.datasets.empty();
  if (options.pool.fetch_datasets) inputs.datasets = app::EmbeddedDatasetFolders();
  if (const auto end = FindDatasets(inputs.datasets, cache, link, options.pool, around)) return *end;
  FetchedDatasets datasets(inputs.datasets, cache);
  for (;;) {
    options.pool.unfetched = datasets.unfetched();
    options.child_command = ChildCommand({datasets.folders(), inputs.solvers});
    Supervisor supervisor(link, options, around.logger);
    const ExitCode end = supervisor.Run(around.stop.descriptor(), [&around] { return around.stop.Take(); });
    const Pool& pool = supervisor.pool();
    const bool failed = end == ExitCode::kUsage || end == ExitCode::kInternal || end == ExitCode::kMachine;
    if (!pool.ended_to_fetch().empty()) {
      if (!datasets.Fetch(pool.ended_to_fetch(), link, options.pool, around)) return ExitCode::kOk;
    } else if (pool.has_loaded() || !failed || !datasets.DropLast(around.logger)) {
      return end;
    }
  }
}

ExitCode SupervisorMain(CommandLine line, const app::BuildFacts& build, spdlog::logger& logger) {
  app::StopSignals stop(line.owner);
  ResolveSlotCount(line, logger);
  const DatasetCache cache(app::DatasetCacheFolder(), GuardedReader());
  try {
    bridge::ServerUplink uplink =
        bridge::PrepareUplink(line.network.Resolve(), line.access, bridge::BusLocation::kOwnNamespace);
    if (uplink.bridged()) {
      std::printf("legopt-worker: LCM stays %s\n", uplink.bus.c_str());
      std::fflush(stdout);
    }
    external::HideFromOtherProcesses();  // especially from external solvers of its jobs
    SupervisorOptions options = OptionsOf(line, build, uplink);
    bus::LcmTransport transport(uplink.network);
    const auto spoke = bridge::RunSpoke(std::move(uplink));
    if (const std::string warning = transport.receive_buffer_warning(); !warning.empty()) logger.warn(warning);
    if (const std::string warning = transport.missing_key_warning(); !warning.empty()) logger.warn(warning);
    bus::Endpoint endpoint(transport, bus::RandomEndpointId(), bus::RandomSeed());
    EndpointLink link(endpoint);
    return RunPools(line.inputs, options, cache, link, {stop, logger, options.pool.server_address});
  } catch (const bus::BusError& error) {
    logger.error(error.what());
    return app::CodeOf(error);
  }
}

}  // namespace

app::ProcessKind KindOf(int argc, const char* const* argv) {
  return argc > 1 && argv[1] == kChildFlag ? app::ProcessKind::kJob : app::ProcessKind::kService;
}

int WorkerMain(int argc, char** argv, const app::BuildFacts& build, const ExecutorFactory& make_executor) {
  if (KindOf(argc, argv) == app::ProcessKind::kJob) return ChildMain(argc, argv, make_executor);
  CommandLine line;
  app::Program program(kWorkerProgram, "Runs jobs of a legopt server in a pool of job processes");
  Define(program, line);
  program.SetVersion("legopt-worker " + build.version, app::BuildReport(build));
  if (const auto status = app::ParseCommandLine(program, argc, argv)) return *status;
  const auto logger = spdlog::stderr_color_st(kWorkerProgram);
  app::FormatPrintably(*logger);
  logger->set_level(line.verbose ? spdlog::level::debug : spdlog::level::warn);
  return StatusOf(SupervisorMain(line, build, *logger));
}

}  // namespace legopt::worker
