#include <chrono>
#include <filesystem>
#include <iostream>
#include <memory>
#include <optional>
#include <string>
#include <system_error>
#include <thread>
#include <utility>
#include <vector>

#include "app/command_line.h"
#include "app/printable.h"
#include "bus/bridge/uplink.h"
#include "client/client_error.h"
#include "client/commands/commands.h"
#include "client/commands/options.h"
#include "client/pool/pool_file.h"
#include "client/pool/pool_script.h"
#include "client/pool/slurm_pool.h"
#include "client/pool/ssh_pool.h"
#include "client/pool/worker_access.h"
#include "client/report/listing.h"
#include "client/report/progress.h"
#include "client/service/interrupt.h"

namespace legopt::client {
namespace {

namespace fs = std::filesystem;

constexpr char kDefaultFolder[] = "legopt-pool";

struct PoolFlags {
  std::string file;
  std::string access;
  NetworkOptions network;
  std::string folder = kDefaultFolder;
  Engine engine = Engine::kPbs;
  bool dry_run = false;
  std::unique_ptr<InterruptGuard> guard;  // kept to the end: a late signal must not suppress the report
};

std::string Absolute(const std::string& file) { return fs::absolute(file).lexically_normal().string(); }

PoolAccess AccessFor(const PoolFlags& flags, const PoolFile& file) {
  PoolAccess access = AccessWithLocalPaths(file, flags.folder);
  access.job_name = "legopt-" + std::to_string(bridge::ReadAccessFile(flags.access).deployment);
  return access;
}

// Returns the access by files at paths that the nodes can read as well.
PoolAccess AccessByPaths(const PoolFlags& flags, const PoolFile& file, const bus::LcmOptions& network) {
  PoolAccess access = AccessFor(flags, file);
  access.access_file = Absolute(flags.access);
  if (access.key_file.empty() && !network.key_file.empty()) {
    access.key_file = WorkerKeyFile(network.key_file, flags.folder).string();
  }
  return access;
}

// Returns the access with access file and key embedded in the script.
PoolAccess AccessInScript(const PoolFlags& flags, const PoolFile& file, const bus::LcmOptions& network) {
  PoolAccess access = AccessFor(flags, file);
  access.access = ReadWhole(flags.access);
  if (access.key_file.empty() && !network.key_file.empty()) access.key = WorkerKeyText(network.key_file);
  return access;
}

// The folder of a pool; one that was created here is removed again unless the pool is started.
class StartedFolder {
 public:
  explicit StartedFolder(fs::path folder) : folder_(std::move(folder)), created_(fs::create_directories(folder_)) {}
  ~StartedFolder() {
    std::error_code ignored;
    if (created_) fs::remove_all(folder_, ignored);
  }
  StartedFolder(const StartedFolder&) = delete;
  StartedFolder& operator=(const StartedFolder&) = delete;
  void Keep() { created_ = false; }

 private:
  fs::path folder_;
  bool created_;
};

ExitCode StartSlurm(const PoolFlags& flags) {
  const PoolFile file = ReadPoolFile(flags.file, Engine::kSlurm);
  const bus::LcmOptions network = flags.network.Resolve();
  const PoolAccess access = AccessInScript(flags, file, network);
  const std::string script = SlurmScript(file, access);
  if (flags.dry_run) {
    std::cout << WithoutKey(script, access);
    return ExitCode::kOk;
  }
  RequireServer(flags.access, network);
  StartedFolder started(flags.folder);
  const SlurmArray array = SlurmArray::Submit(file, script);
  started.Keep();  // for the logs of what is submitted
  AddToRecord(flags.folder, {Engine::kSlurm, array.job_id()});
  const std::string folder = app::Printable(flags.folder);
  std::cout << "Slurm job " << array.job_id() << ": " << file.nodes << (file.nodes == 1 ? " worker" : " workers")
            << ", one to a node; logs in " << folder << "\n  legopt pool status " << folder << "\n  legopt pool stop "
            << folder << "\n";
  return ExitCode::kOk;
}

// Reports which hosts failed and why; returns the exit code.
ExitCode OutcomeOf(const SshPool& pool) {
  const std::vector<SshPool::Failure> failures = pool.Failures();
  if (failures.empty()) return ExitCode::kOk;
  std::string text;
  for (const SshPool::Failure& failure : failures) text += (text.empty() ? "" : "\n  ") + failure.text;
  throw ClientError(failures.front().code, text);
}

void KeepUntilOver(SshPool& pool, const HostsFile& file) {
  constexpr std::chrono::milliseconds kInterval{100};
  file.Write(pool.hosts());
  for (int orders = 0; !pool.over(); std::this_thread::sleep_for(kInterval)) {
    if (pool.Look()) file.Write(pool.hosts());
    if (InterruptCount() == orders) continue;
    orders = InterruptCount();
    constexpr int kGentle = 2;
    if (orders <= kGentle) {
      std::cerr << (orders == 1 ? "stopping when running jobs have ended (again: give them back)\n"
                                : "giving running jobs back (again: end the connections)\n");
      pool.OrderToStop();
    } else {
      pool.Close();
    }
  }
}

ExitCode StartSsh(PoolFlags& flags) {
  const PoolFile file = ReadPoolFile(flags.file, Engine::kSsh);
  const bus::LcmOptions network = flags.network.Resolve();
  const PoolAccess access = AccessInScript(flags, file, network);
  if (flags.dry_run) {
    std::string text;
    for (const std::string& host : file.hosts) {
      text += "# ssh";
      for (const std::string& word : SshArguments(file, host)) text += " " + app::ShellWord(word);
      text += "\n" + WithoutKey(HostScript(file, access, host), access);
    }
    std::cout << text;
    return ExitCode::kOk;
  }
  RequireServer(flags.access, network);
  StartedFolder started(flags.folder);
  flags.guard = std::make_unique<InterruptGuard>();
  SshPool pool(file, access);
  AddToRecord(flags.folder, {Engine::kSsh, PoolProcess::ThisProcess().id()});
  started.Keep();
  std::cout << file.nodes << (file.nodes == 1 ? " worker" : " workers") << ", one to a host; logs in "
            << app::Printable(flags.folder) << "; Ctrl-C stops them\n"
            << std::flush;
  const HostsFile hosts(flags.folder, PoolProcess::ThisProcess());
  KeepUntilOver(pool, hosts);
  hosts.Remove();
  return OutcomeOf(pool);
}

ExitCode PrintScript(const PoolFlags& flags) {
  const PoolFile file = ReadPoolFile(flags.file, flags.engine);
  std::cout << OtherEngineScript(flags.engine, file, AccessByPaths(flags, file, flags.network.Resolve()));
  return ExitCode::kOk;
}

struct FolderFlags {
  std::string folder = kDefaultFolder;
  double patience_s = 0;
  ListingOptions listing;
};

void ListArray(const std::string& job, Listing& listing) {
  const auto elements = SlurmArray(job).Elements();
  if (!elements) {
    throw ClientError(ExitCode::kEngineRefused,
                      "Slurm does not say how job " + job + " is; the workers that are at work are in 'legopt status'");
  }
  for (const SlurmElement& element : *elements) {
    listing.rows.push_back({element.id, element.state, element.run_time, element.place});
  }
}

void ListHosts(const HostsFile& file, Listing& listing) {
  for (const SshPool::Host& host : file.Read()) {
    listing.rows.push_back(
        {host.name, host.state, FormatDuration(std::chrono::system_clock::now() - host.since), host.name});
  }
}

ExitCode Status(const FolderFlags& flags) {
  Listing listing;
  listing.columns = {"worker", "state", "time", "node"};
  for (const PoolMember& member : ReadRecord(flags.folder)) {
    if (member.engine == Engine::kSlurm) {
      ListArray(member.id, listing);
    } else if (const auto keeper = PoolProcess::FromId(member.id); keeper && keeper->runs()) {
      ListHosts({flags.folder, *keeper}, listing);
    }
  }
  PrintListing(listing, flags.listing);
  return ExitCode::kOk;
}

void StopArray(const std::string& job, std::chrono::milliseconds patience) {
  SlurmArray array(job);
  const auto elements = array.Elements();
  if (elements && elements->empty()) return;
  std::cout << "Slurm job " << job << ": " << (elements ? Summary(*elements) : "unknown") << "; stopping\n"
            << std::flush;
  array.Stop(patience, Interrupted);
}

void StopHosts(const std::string& id, std::chrono::milliseconds patience) {
  const auto keeper = PoolProcess::FromId(id);
  if (!keeper || !keeper->runs()) return;
  std::cout << "workers through ssh: stopping\n" << std::flush;
  keeper->Stop(patience, Interrupted);
}

ExitCode Stop(const FolderFlags& flags) {
  const InterruptGuard guard;
  const std::chrono::milliseconds patience(static_cast<std::int64_t>(flags.patience_s * 1e3));
  for (const PoolMember& member : ReadRecord(flags.folder)) {
    if (member.engine == Engine::kSlurm) {
      StopArray(member.id, patience);
    } else {
      StopHosts(member.id, patience);
    }
  }
  return ExitCode::kOk;
}

void AddStartFlags(const app::Command& command, PoolFlags* flags) {
  command.AddOption("FILE", flags->file, "Pool file (docs/how-to/clusters.md)").Required();
  command.AddOption("--access", flags->access, "Access file that the server wrote ('legopt-server --listen')")
      .Required();
  command.AddOption("--folder", flags->folder, "Folder for logs, and for what status and stop need").ShowDefault();
  app::AddListeningFlags(command, &flags->network);
}

}  // namespace

void AddPoolCommand(const app::Command& program, Invocation* invocation) {
  const auto pool = program.AddCommand("pool", "Start and stop workers on other machines");
  pool.RequireCommand();
  pool.LetOptionsFollowCommands();

  const auto slurm = pool.AddCommand("slurm", "Start workers by Slurm: a job array, one worker per node");
  const auto flags = std::make_shared<PoolFlags>();
  AddStartFlags(slurm, flags.get());
  slurm.AddFlag("--dry-run", flags->dry_run, "Print the script, without the key, and submit nothing");
  slurm.WhenChosen([=] { invocation->body = [flags] { return StartSlurm(*flags); }; });

  const auto ssh = pool.AddCommand("ssh", "Run one worker on each of several hosts over ssh, until Ctrl-C");
  const auto ssh_flags = std::make_shared<PoolFlags>();
  AddStartFlags(ssh, ssh_flags.get());
  ssh.AddFlag("--dry-run", ssh_flags->dry_run, "Print the commands for each host, without the key, and start nothing");
  ssh.WhenChosen([=] { invocation->body = [ssh_flags] { return StartSsh(*ssh_flags); }; });

  const auto script = pool.AddCommand("script", "Print a job script for another batch system");
  const auto script_flags = std::make_shared<PoolFlags>();
  AddStartFlags(script, script_flags.get());
  script
      .AddEnum<Engine>("--engine", script_flags->engine, "pbs, sge or htcondor", app::OneOf({"pbs", "sge", "htcondor"}))
      .Required();
  script.WhenChosen([=] { invocation->body = [script_flags] { return PrintScript(*script_flags); }; });

  const auto status = pool.AddCommand("status", "Show the state of a pool's workers from Slurm or ssh");
  const auto status_flags = std::make_shared<FolderFlags>();
  status.AddOption("FOLDER", status_flags->folder, "The pool's folder").ShowDefault();
  AddListingOptions(status, &status_flags->listing);
  status.WhenChosen([=] { invocation->body = [status_flags] { return Status(*status_flags); }; });

  constexpr double kMost_s = 86'400;
  const auto stop = pool.AddCommand("stop", "Stop the workers of a pool; their unfinished jobs are re-queued");
  const auto stop_flags = std::make_shared<FolderFlags>();
  stop.AddOption("FOLDER", stop_flags->folder, "The pool's folder").ShowDefault();
  stop.AddOption("--patience", stop_flags->patience_s, "Seconds for running jobs to end (default 0)")
      .Check(app::Number(0, kMost_s));
  stop.WhenChosen([=] { invocation->body = [stop_flags] { return Stop(*stop_flags); }; });
}

}  // namespace legopt::client
