#include "client/pool/slurm_pool.h"

#include <algorithm>
#include <cctype>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <system_error>
#include <thread>
#include <utility>

#include "app/data_folder.h"
#include "app/folder_cache.h"
#include "app/printable.h"
#include "bus/bridge/bridge.h"
#include "bus/bridge/uplink.h"
#include "bus/message_key.h"
#include "client/client_error.h"
#include "client/pool/packed_dataset.h"
#include "client/pool/pool_file.h"
#include "client/pool/worker_access.h"
#include "client/service/interrupt.h"
#include "legopt/dataset/internal/dataset_content.h"
#include "legopt/types/input_error.h"
#include "legopt/types/number_text.h"

namespace legopt::client {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using Clock = std::chrono::steady_clock;

constexpr seconds kSubmitPatience{60};
constexpr seconds kCallPatience{20};
// Most errors occur at once; later, one query per half minute is acceptable for sites.
constexpr seconds kFirstLook{5}, kLongestInterval{30}, kLookAgain{3};
constexpr milliseconds kStopInterval{500};
constexpr milliseconds kReleasePatience{5'000};  // time for a worker to release its jobs

std::vector<std::string> QueueArguments(const std::string& job_id) {
  return {"--noheader", "--array", "--jobs=" + job_id, "--format=%i|%T|%M|%R"};
}

std::string Trimmed(const std::string& text) {
  const auto first = text.find_first_not_of(" \n");
  return first == std::string::npos ? "" : text.substr(first, text.find_last_not_of(" \n") - first + 1);
}

// Returns nullopt without an answer. Slurm forgets ended jobs after some minutes and then reports an invalid id.
std::optional<std::vector<SlurmElement>> ElementsOf(const EngineResult& answer) {
  if (answer.ok()) return ParseElements(answer.output);
  if (answer.words.find("Invalid job id") != std::string::npos) return std::vector<SlurmElement>{};
  return std::nullopt;
}

// Returns the option that Slurm's message mentions, if any.
const EngineOption* MentionedOption(const PoolFile& pool, const std::string& words) {
  const auto named = [&words](const EngineOption& option) {
    return option.key.size() > 1 && words.find(option.key) != std::string::npos;
  };
  const auto blamed = std::find_if(pool.options.begin(), pool.options.end(), named);
  return blamed == pool.options.end() ? nullptr : &*blamed;
}

std::string Refusal(const PoolFile& pool, const EngineResult& answer) {
  const std::string words = Trimmed(app::PrintableLines(answer.words));
  const std::string said = words.empty() ? "sbatch ended with " + answer.exit->Describe() : "Slurm says: " + words;
  if (const EngineOption* option = MentionedOption(pool, words)) {
    return option->place + ": slurm." + option->key + ": is refused" +
           (option->value ? " (got '" + *option->value + "')" : "") + "; " + said;
  }
  return pool.file + ": the pool is refused; " + said;
}

void Cancel(std::vector<std::string> arguments) {
  const EngineResult answer = EngineCommand("scancel", arguments, kCallPatience).Wait();
  if (answer.ok() || answer.words.find("Invalid job id") != std::string::npos) return;
  // Ignore elements that have just ended.
  if (answer.exit && answer.words.find("already completing") != std::string::npos) return;
  std::fprintf(stderr, "legopt: warning: scancel %s: %s\n", arguments.back().c_str(),
               answer.exit ? Trimmed(app::PrintableLines(answer.words)).c_str() : "no answer in time");
}

}  // namespace

std::vector<SlurmElement> ParseElements(const std::string& lines) {
  std::vector<SlurmElement> elements;
  ClassicInput stream(lines);
  for (std::string line; std::getline(stream, line);) {
    ClassicInput fields(line);
    SlurmElement element;
    std::getline(fields, element.id, '|');
    std::getline(fields, element.state, '|');
    std::getline(fields, element.run_time, '|');
    std::getline(fields, element.place);  // a reason may contain any character
    if (!element.state.empty()) elements.push_back(std::move(element));
  }
  return elements;
}

std::string Summary(const std::vector<SlurmElement>& elements) {
  std::map<std::string, int> counts;
  for (const SlurmElement& element : elements) {
    std::string words;
    for (const char c : element.state) words += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    if (element.place.starts_with('(')) words += " " + element.place;
    ++counts[words];
  }
  std::string summary;
  for (const auto& [words, count] : counts) {
    summary += (summary.empty() ? "" : ", ") + std::to_string(count) + " " + words;
  }
  return summary.empty() ? "none" : summary;
}

SlurmArray SlurmArray::Submit(const PoolFile& pool, const std::string& script) {
  const EngineResult answer = EngineCommand("sbatch", {"--parsable"}, kSubmitPatience, script).Wait();
  if (!answer.exit) {
    throw ClientError(ExitCode::kEngineRefused, "sbatch did not answer within " +
                                                    std::to_string(kSubmitPatience.count()) +
                                                    " s; whether the job was taken in, 'squeue --me' tells");
  }
  const std::string job_id = Trimmed(answer.output.substr(0, answer.output.find(';')));  // "17" or "17;cluster"
  const bool is_number = !job_id.empty() && std::all_of(job_id.begin(), job_id.end(),
                                                        [](unsigned char c) { return std::isdigit(c) != 0; });
  if (!answer.ok() || !is_number) throw ClientError(ExitCode::kEngineRefused, Refusal(pool, answer));
  return SlurmArray(job_id);
}

std::optional<std::vector<SlurmElement>> SlurmArray::Look(Clock::time_point now) {
  if (next_look_ == Clock::time_point{}) next_look_ = now + (interval_ = kFirstLook);
  if (look_ == nullptr) {
    if (now < next_look_) return std::nullopt;
    look_ = std::make_unique<EngineCommand>("squeue", QueueArguments(job_id_), kCallPatience);
  }
  const auto answer = look_->Poll();
  if (!answer) return std::nullopt;
  look_.reset();
  auto elements = ElementsOf(*answer);
  next_look_ = now + (elements && elements->empty() ? kLookAgain : interval_);
  interval_ = std::min(2 * interval_, kLongestInterval);
  return elements;
}

std::optional<std::vector<SlurmElement>> SlurmArray::Elements() const {
  return ElementsOf(EngineCommand("squeue", QueueArguments(job_id_), kCallPatience).Wait());
}

void SlurmArray::Stop(milliseconds patience, bool (*give_up)()) {
  const auto hurried = [give_up] { return give_up != nullptr && give_up(); };
  // Returns true if all elements have left the queue.
  const auto wait = [&](milliseconds duration) {
    for (const auto end = Clock::now() + duration;;) {
      const auto elements = Elements();
      if (elements && elements->empty()) return true;
      if (hurried() || Clock::now() >= end) return false;
      std::this_thread::sleep_for(kStopInterval);
    }
  };
  look_.reset();
  Cancel({"--state=PENDING", job_id_});
  if (!hurried()) Cancel({"--batch", "--signal=TERM", job_id_});  // the worker drains
  if (wait(patience)) return;
  Cancel({"--batch", "--signal=TERM", job_id_});  // the worker releases running jobs
  if (wait(kReleasePatience)) return;
  Cancel({job_id_});
}

namespace {

namespace fs = std::filesystem;

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
  if (access.datasets.empty()) access.datasets = {HashOfDataset(options.dataset, GuardedReader())};
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
