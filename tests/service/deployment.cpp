#include "tests/service/deployment.h"

#include <algorithm>
#include <csignal>
#include <stdexcept>

#include "bus/lcm_transport.h"
#include "db/read_only_database.h"
#include "tests/folders.h"

namespace legopt::service {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr char kGroup[] = "239.255.76.67";
constexpr milliseconds kStartLimit = seconds(20);
constexpr milliseconds kBetweenLooks(20);

std::string Cell(const db::Value& value) {
  if (const auto* integer = std::get_if<std::int64_t>(&value)) return std::to_string(*integer);
  if (const auto* real = std::get_if<double>(&value)) return nlohmann::json(*real).dump();
  if (const auto* text = std::get_if<std::string>(&value)) return *text;
  if (const auto* blob = std::get_if<db::Blob>(&value)) {
    std::string hex;
    for (const char c : blob->bytes) {
      constexpr char kDigits[] = "0123456789abcdef";
      const auto byte = static_cast<unsigned char>(c);
      hex += {kDigits[byte >> 4], kDigits[byte & 15]};
    }
    return hex;
  }
  return "NULL";
}

}  // namespace

std::filesystem::path Program(const std::string& name) {
  const std::filesystem::path build = BuildFolder();
  return std::filesystem::exists(build / name) ? build / name : build / "tests" / name;
}

std::string Deployment::Unavailable() {
  const bus::MulticastRoute route = bus::ProbeMulticastRoute(kGroup);
  return route.usable ? "" : route.problem;
}

Deployment::Deployment() : port_(bus::FindFreePortPair(bus::RandomSeed())) {
  client::NetworkOptions network;
  network.group = kGroup;
  network.port = port_;
  network.timeout_s = 30;  // tolerates a busy machine
  connection_ = std::make_unique<client::ServerConnection>(network);
}

Deployment::~Deployment() = default;

std::unique_ptr<client::ChildProcess> Deployment::ExtraServer(const std::filesystem::path& database,
                                                              std::optional<int> port) {
  std::vector<std::string> arguments = {"--db", database.string(), "--group",
                                        kGroup, "--port",          std::to_string(port.value_or(port_))};
  arguments.insert(arguments.end(), server_arguments_.begin(), server_arguments_.end());
  return std::make_unique<client::ChildProcess>(Program("legopt-server"), arguments, true);
}

void Deployment::StartServer() {
  server_ = ExtraServer(database());
  if (!server_->WaitForLine("ready", kStartLimit)) {
    throw std::runtime_error("the server does not start: " + server_->ErrorTail());
  }
}

void Deployment::KillServer() {
  server_->Signal(SIGKILL);
  server_->Wait(kStartLimit);
}

std::unique_ptr<client::ChildProcess> Deployment::StartWorker(const std::string& program,
                                                              std::vector<std::string> arguments) const {
  for (const std::string& argument :
       {std::string("--group"), std::string(kGroup), std::string("--port"), std::to_string(port_)}) {
    arguments.push_back(argument);
  }
  return std::make_unique<client::ChildProcess>(Program(program), arguments, true);
}

std::unique_ptr<client::ChildProcess> Deployment::StartStubWorker(std::vector<std::string> arguments) const {
  arguments.insert(arguments.end(), {"--dataset", "stub-d"});
  return StartWorker("stub_worker", std::move(arguments));
}

std::int64_t Deployment::Submit(const nlohmann::json& spec, const std::string& submission_id) {
  return connection_->Submit(submission_id, spec.dump()).experiment_id;
}

bool Deployment::WaitFor(std::int64_t experiment, const std::function<bool(const nlohmann::json&)>& done,
                         seconds limit) {
  const auto end = std::chrono::steady_clock::now() + limit;
  while (std::chrono::steady_clock::now() < end) {
    const nlohmann::json status = connection_->Status(experiment);
    if (done(status.at("experiments").at(0))) return true;
    if (server_->Wait(kBetweenLooks)) throw std::runtime_error("the server has ended: " + server_->ErrorTail());
  }
  return false;
}

bool Deployment::WaitUntilDone(std::int64_t experiment) {
  return WaitFor(experiment, [](const nlohmann::json& status) { return status.at("state") != "active"; });
}

bool Deployment::WaitForWorkers(int online) {
  const auto end = std::chrono::steady_clock::now() + kStartLimit;
  while (std::chrono::steady_clock::now() < end) {
    const nlohmann::json status = connection_->Status(0);
    const auto& workers = status.at("workers");
    const auto takes_part = [](const nlohmann::json& worker) { return worker.at("online").get<bool>(); };
    if (std::count_if(workers.begin(), workers.end(), takes_part) >= online) return true;
    server_->Wait(kBetweenLooks);
  }
  return false;
}

bool Deployment::WaitForJobs(std::int64_t experiment, int count) {
  return WaitFor(experiment, [count](const nlohmann::json& status) {
    const nlohmann::json& jobs = status.at("jobs");
    return jobs.at("total").get<int>() - jobs.at("queued").get<int>() - jobs.at("leased").get<int>() >= count;
  });
}

std::vector<std::string> Deployment::Query(const std::string& sql) const {
  constexpr std::int64_t kMaxRows = 100'000;
  std::vector<std::string> lines;
  for (const auto& row : db::ReadOnlyDatabase(database()).Query(sql, kMaxRows).rows) {
    std::string line;
    for (const db::Value& value : row) {
      if (!line.empty()) line += '|';
      line += Cell(value);
    }
    lines.push_back(line);
  }
  return lines;
}

nlohmann::json StubSpec(int jobs, int work_ms) {
  constexpr std::size_t kHashDigits = 64;
  nlohmann::json problems = nlohmann::json::array();
  nlohmann::json waypoints = nlohmann::json::array();
  for (int i = 0; i < jobs; ++i) {
    problems.push_back(i);
    waypoints.push_back(1);
  }
  // Methods with different options must have different hashes.
  std::string hash = std::to_string(work_ms);
  hash.insert(0, kHashDigits - hash.size(), 'e');
  return {{"spec_version", 1},
          {"name", "stub"},
          {"seed", 5},
          {"repetitions", 1},
          {"dataset", {{"name", "stub"}, {"hash", std::string(kHashDigits, 'd')}}},
          {"tasks", {{{"task", "posture"}, {"problems", problems}, {"waypoints", waypoints}}}},
          {"initializations", {"good"}},
          {"methods",
           {{{"name", "Stub"},
             {"hash", hash},
             {"options", {{"work_ms", work_ms}}},
             {"multi_starts", 0},
             {"sample_size", 100},
             {"incremental", false}}}},
          {"limits", {{"wall_time_s", 60}, {"memory_mb", 1024}}},
          {"max_attempts", 3},
          {"again", true}};  // identical jobs must run
}

}  // namespace legopt::service
