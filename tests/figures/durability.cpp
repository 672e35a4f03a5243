#include <atomic>
#include <map>
#include <memory>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "client/client_error.h"
#include "client/service/server_connection.h"
#include "tests/figures/figures.h"
#include "tests/service/deployment.h"

namespace legopt::figures {
namespace {

using service::Deployment;
using std::chrono::milliseconds;

constexpr int kKills = 500;
constexpr int kKilledJobs = 20;
constexpr int kClients = 4;

// A client that submits experiments, each repeatedly until it is acknowledged.
class Submitter {
 public:
  Submitter(int port, std::string name) : name_(std::move(name)), thread_([this, port] { Run(port); }) {}
  ~Submitter() { Stop(); }
  Submitter(const Submitter&) = delete;
  Submitter& operator=(const Submitter&) = delete;

  void Stop() {
    stop_ = true;
    if (thread_.joinable()) thread_.join();
  }
  // After Stop: experiment by submission id.
  const std::map<std::string, std::int64_t>& acknowledged() const { return acknowledged_; }
  int unanswered() const { return unanswered_; }
  const std::string& fault() const { return fault_; }

 private:
  void Run(int port) {
    client::NetworkOptions network;
    network.port = port;
    client::ServerConnection connection(network);
    const std::string spec = service::StubSpec(kKilledJobs, 0).dump();
    for (int number = 0; !stop_;) {
      const std::string id = name_ + " " + std::to_string(number);
      try {
        acknowledged_[id] = connection.Submit(id, spec).experiment_id;
        ++number;
      } catch (const client::ClientError& error) {
        if (error.code() != client::ExitCode::kUnreachable) {
          fault_ = error.what();
          return;
        }
        ++unanswered_;
      }
    }
  }

  std::string name_;
  std::atomic<bool> stop_{false};
  std::map<std::string, std::int64_t> acknowledged_;
  int unanswered_ = 0;
  std::string fault_;
  std::thread thread_;
};

}  // namespace

void MeasureDurability(const Request& request, Findings& findings) {
  const int kills = request.count > 0 ? request.count : kKills;
  std::mt19937_64 random(request.seed);
  Deployment deployment;
  findings.Begin("2");
  std::map<std::string, std::int64_t> acknowledged;
  int unanswered = 0;
  {
    std::vector<std::unique_ptr<Submitter>> submitters;
    for (int i = 0; i < kClients; ++i) {
      submitters.push_back(std::make_unique<Submitter>(deployment.port(), "client " + std::to_string(i)));
    }
    for (int kill = 0; kill < kills; ++kill) {
      deployment.StartServer();
      constexpr int kLongest_ms = 120;
      std::this_thread::sleep_for(milliseconds(random() % kLongest_ms));
      deployment.KillServer();
    }
    deployment.StartServer();  // lets an open call end
    for (const auto& submitter : submitters) {
      submitter->Stop();
      acknowledged.insert(submitter->acknowledged().begin(), submitter->acknowledged().end());
      unanswered += submitter->unanswered();
      findings.Promise(submitter->fault().empty(), "no submission is refused " + submitter->fault());
    }
  }
  std::map<std::string, std::int64_t> stored;
  bool twice = false;
  for (const std::string& row : deployment.Query("SELECT submission_id, experiment_id FROM experiments")) {
    const auto bar = row.find('|');
    twice = !stored.emplace(row.substr(0, bar), std::stoll(row.substr(bar + 1))).second || twice;
  }
  int lost = 0;
  for (const auto& [id, experiment] : acknowledged) {
    const auto found = stored.find(id);
    lost += found == stored.end() || found->second != experiment ? 1 : 0;
  }
  findings.Promise(lost == 0 && !acknowledged.empty(), std::to_string(kills) + " SIGKILLs, " +
                                                           std::to_string(acknowledged.size()) +
                                                           " submissions acknowledged, lost " + std::to_string(lost));
  findings.Promise(!twice, "no id twice");
  const auto whole = deployment.Query(
      "SELECT count(*) FROM (SELECT count(j.job_id) AS jobs FROM experiments LEFT JOIN cells USING (experiment_id) "
      "LEFT JOIN jobs AS j USING (cell_id) GROUP BY experiment_id) WHERE jobs <> " +
      std::to_string(kKilledJobs));
  findings.Promise(whole.at(0) == "0", "every experiment has all its jobs");
  findings.Note(std::to_string(unanswered) + " submissions had to be sent again after no answer in 5 s");
}

}  // namespace legopt::figures
