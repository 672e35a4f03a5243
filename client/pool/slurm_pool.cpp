#include "client/pool/slurm_pool.h"

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <nlohmann/json.hpp>
#include <system_error>
#include <utility>

#include "app/data_folder.h"
#include "app/isolated_call.h"
#include "app/printable.h"
#include "bus/bridge/access_file.h"
#include "bus/bridge/link_socket.h"
#include "bus/message_key.h"
#include "client/client_error.h"
#include "client/pool/packed_dataset.h"
#include "client/pool/pool_record.h"
#include "client/pool/worker_key.h"
#include "client/service/interrupt.h"
#include "legopt/dataset/dataset_archive.h"
#include "legopt/types/input_error.h"

namespace legopt::client {
namespace {

namespace fs = std::filesystem;
using std::chrono::milliseconds;

constexpr char kDatasets[] = "datasets";  // subfolder of the pool's folder with the datasets that the server offers
// A single query may fall between the end of an element and its re-queueing.
constexpr int kLooksToBelieve = 2;
constexpr milliseconds kAskServer{2000};
constexpr std::size_t kTailBytes = 4000;

// Returns a port that is currently free on all addresses of this machine.
std::string FreeListener() {
  constexpr bridge::LinkAddress kAnything = 0;
  return bridge::ToString(bridge::LinkSocket(kAnything).address());
}

// Returns the newest log in a folder; empty if there is none.
fs::path NewestLog(const fs::path& folder) {
  fs::path newest;
  std::error_code ignored;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder, ignored)) {
    if (entry.path().extension() != ".log") continue;
    if (newest.empty() || entry.last_write_time(ignored) > fs::last_write_time(newest, ignored)) newest = entry.path();
  }
  return newest;
}

// Returns the worker's error in the newest log, or else the error of Slurm's own program.
std::string CauseInLogs(const fs::path& folder) {
  const fs::path newest = NewestLog(folder);
  if (newest.empty()) {
    return "no log has come to " + folder.string() + " (can the nodes write there? If not, name another 'output')";
  }
  std::string text = ReadWhole(newest);
  text.erase(0, text.size() - std::min(text.size(), kTailBytes));
  for (const char* program : {"legopt-worker", "slurmstepd"}) {
    if (const std::string words = LastErrorMessage(program, text); !words.empty())
      return "the newest log says: " + words;
  }
  return "the newest log, " + newest.string() + ", reports no error";
}

PoolAccess AccessOf(const SlurmPoolOptions& options, const fs::path& folder) {
  PoolAccess access = AccessWithLocalPaths(options.file, folder);
  for (const fs::path& solver : options.solvers) access.solvers.push_back(fs::absolute(solver).string());
  return access;
}

}  // namespace

PoolAccess AccessWithLocalPaths(const PoolFile& file, const fs::path& folder) {
  PoolAccess access;
  access.program =
      file.worker.program.empty() ? (app::ProgramFolder() / "legopt-worker").string() : file.worker.program;
  access.key_file = file.worker.key_file;
  access.datasets = file.worker.datasets;
  access.logs = fs::absolute(folder).string();
  if (const char* data = std::getenv("LEGOPT_DATA")) access.data_folder = fs::absolute(data).string();
  return access;
}

fs::path PoolFolder(const fs::path& database) { return database.string() + ".pool"; }

std::string PreviewScript(const SlurmPoolOptions& options) {
  PoolAccess access = AccessOf(options, fs::absolute(PoolFolder(options.database)));
  if (access.datasets.empty()) access.datasets = {HashOfDataset(options.dataset, CallIsolated)};
  access.access = "(the server's addresses)";
  if (access.key_file.empty()) access.key = "(the key)";
  access.job_name = "legopt-(deployment)";
  return SlurmScript(options.file, access);
}

SlurmPool::SlurmPool(SlurmPoolOptions options)
    : options_(std::move(options)), folder_(fs::absolute(PoolFolder(options_.database))) {
  for (const char* program : {"sbatch", "squeue", "scancel"}) RequireEngineProgram(program);
  PrepareFolder();
  access_ = AccessOf(options_, folder_);
  if (access_.datasets.empty()) access_.datasets = {OfferDataset()};
  StartServer();
  access_.access = ReadWhole(folder_ / "access");
  if (access_.key_file.empty()) access_.key = WorkerKeyText(*options_.network.key_file);
  access_.job_name = "legopt-" + std::to_string(bridge::ReadAccessFile(folder_ / "access").deployment);
  array_ = SlurmArray::Submit(options_.file, SlurmScript(options_.file, access_));
  AddToRecord(folder_, {Engine::kSlurm, array_->job_id()});
  std::fprintf(stderr, "Slurm job %s: %d worker%s, one to a node; logs in %s\n", array_->job_id().c_str(),
               options_.file.nodes, options_.file.nodes == 1 ? "" : "s", app::Printable(folder_.string()).c_str());
}

SlurmPool::~SlurmPool() { Stop(milliseconds(0)); }

void SlurmPool::PrepareFolder() {
  fs::create_directories(folder_ / kDatasets);
  fs::permissions(folder_, fs::perms::owner_all);
  if (!options_.network.key_file) {
    const std::string given = options_.network.Resolve().key_file;
    options_.network.key_file = given.empty() ? (folder_ / "key").string() : given;
  }
  if (!fs::exists(*options_.network.key_file)) bus::MessageKey::Random()->WriteFile(*options_.network.key_file);
}

std::string SlurmPool::OfferDataset() const {
  try {
    return PackInto(options_.dataset, folder_ / kDatasets).hash;
  } catch (const InputError&) {  // too large to be transferred: assume that the nodes see it, like the worker program
    return fs::absolute(options_.dataset).string();
  }
}

void SlurmPool::StartServer() {
  // Another process may take an automatically chosen port before the server binds it: retry with another one.
  const bool chosen_port = options_.file.listen.empty();
  constexpr int kAttempts = 5;
  for (int attempt = 1;; ++attempt) {
    const std::string listen = chosen_port ? FreeListener() : options_.file.listen;
    std::vector<std::string> arguments = {
        "--listen", listen, "--access", (folder_ / "access").string(), "--datasets", (folder_ / kDatasets).string()};
    if (!options_.store_dataset) arguments.emplace_back("--no-dataset");
    try {
      server_ = std::make_unique<ManagedServer>(
          OwnServerOptions{options_.database, options_.network, std::move(arguments), options_.verbose});
      return;
    } catch (const ClientError& error) {
      if (error.code() != ExitCode::kNetworkUnusable || !chosen_port || attempt == kAttempts) throw;
    }
  }
}

void SlurmPool::Supervise() {
  server_->Supervise();
  if (const auto elements = array_->Look(std::chrono::steady_clock::now())) TakeNews(*elements);
}

void SlurmPool::TakeNews(const std::vector<SlurmElement>& elements) {
  if (const std::string summary = Summary(elements); summary != last_summary_) {
    last_summary_ = summary;
    std::fprintf(stderr, "\nSlurm job %s: %s\n", array_->job_id().c_str(), app::Printable(summary).c_str());
  }
  looks_without_elements_ = elements.empty() ? looks_without_elements_ + 1 : 0;
  if (looks_without_elements_ >= kLooksToBelieve) GiveUpWithoutWorkers();
}

void SlurmPool::GiveUpWithoutWorkers() {
  nlohmann::json workers;
  try {
    ServerConnection server(network());
    server.set_timeout(kAskServer);
    workers = server.Status(0).value("workers", nlohmann::json::array());
  } catch (const ClientError& error) {
    if (error.code() != ExitCode::kUnreachable) throw;
    return;  // unknown whether workers are connected
  }
  const auto online = [](const nlohmann::json& worker) { return worker.value("online", false); };
  if (std::any_of(workers.begin(), workers.end(), online)) return;
  const std::string log = CauseInLogs(folder_);
  const std::string job = "Slurm has ended all workers of job " + array_->job_id();
  if (!workers.empty()) {
    throw ClientError(ExitCode::kEngineRefused,
                      job + " before the experiment was over; " + log + ". The same command with --db continues");
  }
  const std::string key = access_.key_file.empty()
                              ? ""
                              : " (or under another key: is " + access_.key_file + ", worker.key_file of " +
                                    options_.file.file + ", the worker's key of " + *options_.network.key_file + "?)";
  throw ClientError(ExitCode::kUnreachable, job + ", and none has reached this server at " +
                                                bridge::ListOf(bridge::ReadAccessFile(folder_ / "access").addresses) +
                                                key + "; let UDP to one of these pass, or set server.listen of " +
                                                options_.file.file + " to ADDRESS:PORT that nodes reach; " + log);
}

void SlurmPool::Stop(milliseconds patience) {
  if (array_) {
    array_->Stop(patience, InterruptedTwice);
    array_.reset();
  }
  if (server_) server_->Stop();
}

}  // namespace legopt::client
