// Real server, workers and LCM over a relay that injects faults, with processes killed all the time: acceptance figure
// 1.
//
// The server is on one pair of ports, workers and client on another; the relay between them loses a fifth of all
// datagrams. A worker is killed every two seconds, and every server after ten. At the end the database must hold every
// job once.

#include <unistd.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <iostream>
#include <memory>
#include <random>
#include <thread>

#include "bus/bridge/bridge.h"
#include "bus/bridge/uplink.h"
#include "bus/lcm_transport.h"
#include "client/client_error.h"
#include "client/service/child_process.h"
#include "client/service/server_connection.h"
#include "db/read_only_database.h"
#include "tests/guarded_main.h"
#include "tests/service/deployment.h"
#include "tests/temporary_folder.h"

namespace legopt::chaos {
namespace {

using Clock = std::chrono::steady_clock;
using client::ChildProcess;
using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr char kGroup[] = "239.255.76.67";
constexpr int kExitSkipped = 77;  // skip code of CTest
constexpr seconds kStartLimit{20};
constexpr int kWorkMin_ms = 20;
constexpr int kWorkSpread_ms = 180;
constexpr int kManyAttempts = 100;  // jobs are not charged for kills
constexpr std::uint64_t kNotARole = 1'000'000;

struct Options {
  double minutes = 15;
  int jobs = 1000;
  int workers = 2;
  std::uint64_t seed = 1;
  double kill_worker_s = 2;
  double kill_server_s = 10;
  bool bridged = false;
};

class Chaos {
 public:
  explicit Chaos(const Options& options) : options_(options), random_(options.seed) {
    setenv("LEGOPT_DEPLOYMENT", std::to_string(Deployment()).c_str(), 1);
    near_ = bus::FindFreePortPair(bus::RandomSeed());
    do far_ = bus::FindFreePortPair(bus::RandomSeed());
    while (std::abs(far_ - near_) < 2);
  }
  ~Chaos() {
    workers_.clear();
    server_.reset();
  }

  // Returns whether all jobs ended in time and the database passes all checks.
  bool Run() {
    relay_ = std::make_unique<ChildProcess>(
        service::Program("injuring_relay"),
        std::vector<std::string>{"--near", std::to_string(near_), "--far", std::to_string(far_), "--seed",
                                 std::to_string(options_.seed)},
        true);
    if (!relay_->WaitForLine("ready", kStartLimit)) throw std::runtime_error(relay_->ErrorTail());
    if (options_.bridged) BuildLink();
    StartServer();
    for (int i = 0; i < options_.workers; ++i) workers_.push_back(NewWorker());
    const auto start = Clock::now();
    started_at_us_ =
        std::chrono::duration_cast<std::chrono::microseconds>(std::chrono::system_clock::now().time_since_epoch())
            .count();
    const bool over = KillUntilOver(
        start + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(options_.minutes * 60)));
    const double took_s = std::chrono::duration<double>(Clock::now() - start).count();
    workers_.clear();
    server_->Stop(seconds(5));
    std::cout << "seed " << options_.seed << ": " << options_.jobs << " jobs, " << worker_kills_ << " workers and "
              << server_kills_ << " servers killed, " << took_s << " s" << (over ? "" : ", NOT OVER") << "\n";
    return Examine() && over;
  }

 private:
  // Puts each worker on a bus of its own. The relay also injects faults into the link to the server, which is the hub.
  void BuildLink() {
    constexpr bridge::LinkAddress kAnyPort = ~bridge::LinkAddress{0xFFFF};
    const auto free_address = [] {
      return bridge::LinkSocket(bridge::ParseLinkAddress("127.0.0.1:1") & kAnyPort).address();
    };
    hub_ = free_address();
    const bridge::LinkAddress door = free_address();
    bridge::WriteAccessFile(LinkFile(), {Deployment(), {door}});
    link_ = std::make_unique<ChildProcess>(
        service::Program("injuring_link"),
        std::vector<std::string>{"--hub", bridge::ToString(hub_), "--listen", bridge::ToString(door), "--seed",
                                 std::to_string(options_.seed)},
        true);
    const bool ready = link_->WaitForLine("ready", kStartLimit);
    if (!ready) throw std::runtime_error(link_->ErrorTail());
  }

  void StartServer() {
    std::vector<std::string> arguments = {"--db", Database(), "--group", kGroup, "--port", std::to_string(near_)};
    if (options_.bridged) arguments.insert(arguments.end(), {"--listen", bridge::ToString(hub_)});
    server_ = std::make_unique<ChildProcess>(service::Program("legopt-server"), arguments, true);
    if (!server_->WaitForLine("ready", kStartLimit)) throw std::runtime_error(server_->ErrorTail());
  }

  std::unique_ptr<ChildProcess> NewWorker() const {
    std::vector<std::string> arguments = {"--slots", "2", "--dataset", "stub-d", "--group", kGroup};
    if (options_.bridged) {
      arguments.insert(arguments.end(), {"--access", LinkFile()});
    } else {
      arguments.insert(arguments.end(), {"--port", std::to_string(far_)});
    }
    return std::make_unique<ChildProcess>(service::Program("stub_worker"), arguments, true);
  }

  std::int64_t Deployment() const { return static_cast<std::int64_t>(kNotARole + options_.seed); }
  std::string LinkFile() const { return (folder_ / "link.access").string(); }
  std::string Database() const { return (folder_ / "results.sqlite").string(); }

  // Repeats a request until it is answered, as a user would.
  template <class Ask>
  bool Try(Ask ask) {
    try {
      ask();
      return true;
    } catch (const client::ClientError&) {
      return false;
    }
  }

  bool KillUntilOver(Clock::time_point end) {
    client::NetworkOptions network;
    network.group = kGroup;
    network.port = far_;
    client::ServerConnection client(network);
    nlohmann::json spec = service::StubSpec(options_.jobs, kWorkMin_ms);
    spec["methods"][0]["options"]["work_spread_ms"] = kWorkSpread_ms;
    spec["max_attempts"] = kManyAttempts;
    const auto period = [](double s) {
      return std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(s));
    };
    auto kill_worker = Clock::now() + period(options_.kill_worker_s);
    auto kill_server = Clock::now() + period(options_.kill_server_s);
    bool submitted = false;
    bool over = false;
    while (!over && Clock::now() < end) {
      if (!submitted) submitted = Try([&] { client.Submit("chaos", spec.dump()); });
      if (submitted) {
        Try([&] { over = client.Status(1).at("experiments").at(0).at("state") != "active"; });
      }
      if (Clock::now() >= kill_worker) {
        auto& victim = workers_[random_() % workers_.size()];
        victim->Signal(SIGKILL);
        victim->Wait(kStartLimit);
        victim = NewWorker();
        ++worker_kills_;
        kill_worker += period(options_.kill_worker_s);
      }
      if (Clock::now() >= kill_server) {
        server_->Signal(SIGKILL);
        server_->Wait(kStartLimit);
        StartServer();
        ++server_kills_;
        // Counted from readiness: a server releases the jobs of dead workers after nine seconds, however long it takes
        // to start.
        kill_server = Clock::now() + period(options_.kill_server_s);
      }
      std::this_thread::sleep_for(milliseconds(100));
    }
    return over;
  }

  // Counts lost, duplicated, unexpected and inconsistent rows; each count must be 0.
  bool Examine() {
    db::ReadOnlyDatabase database(Database());
    const std::vector<std::pair<const char*, const char*>> checks = {
        {"experiments beyond one", "SELECT count(*) - 1 FROM experiments"},
        {"jobs not done", "SELECT count(*) FROM jobs WHERE state <> 'done'"},
        {"jobs without their one result",
         "SELECT count(*) FROM jobs WHERE (SELECT count(*) FROM results AS r WHERE "
         "r.job_id = jobs.job_id) <> 1"},
        {"results of attempts that did not finish",
         "SELECT count(*) FROM results JOIN attempts USING (job_id, attempt) WHERE outcome <> 'finished'"},
        {"finished attempts without result",
         "SELECT count(*) FROM attempts LEFT JOIN results USING (job_id, attempt) WHERE outcome = 'finished' AND "
         "results.job_id IS NULL"},
        {"attempts still running", "SELECT count(*) FROM attempts WHERE outcome = 'running'"}};
    bool sound = true;
    for (const auto& [what, sql] : checks) {
      const auto count = std::get<std::int64_t>(database.Query(sql).rows.at(0).at(0));
      sound = sound && count == 0;
      std::cout << "  " << what << ": " << count << "\n";
    }
    const auto row =
        database.Query("SELECT (SELECT count(*) FROM attempts), (SELECT count(*) FROM stale_results)").rows;
    std::cout << "  attempts: " << std::get<std::int64_t>(row.at(0).at(0))
              << ", stale reports: " << std::get<std::int64_t>(row.at(0).at(1)) << "\n";
    PrintPhaseTimes(database);
    return sound;
  }

  // Prints how the time was spent.
  void PrintPhaseTimes(db::ReadOnlyDatabase& database) const {
    const auto row = database
                         .Query(
                             "SELECT ifnull((SELECT min(submitted_at_us) FROM experiments), 0),"
                             " ifnull((SELECT max(ended_at_us) FROM attempts), 0)")
                         .rows.at(0);
    const auto after_s = [&](const db::Value& at_us) {
      return static_cast<double>(std::get<std::int64_t>(at_us) - started_at_us_) * 1e-6;
    };
    std::cout << "  submitted after " << after_s(row.at(0)) << " s, the last attempt over after " << after_s(row.at(1))
              << " s" << std::endl;
  }

  Options options_;
  std::mt19937_64 random_;
  test::TemporaryFolder folder_;
  int near_ = 0, far_ = 0;
  std::int64_t started_at_us_ = 0;
  bridge::LinkAddress hub_ = 0;
  std::unique_ptr<ChildProcess> relay_, link_, server_;
  std::vector<std::unique_ptr<ChildProcess>> workers_;
  int worker_kills_ = 0, server_kills_ = 0;
};

int Main(int argc, char** argv) {
  Options options;
  CLI::App app("Real processes under loss and kills; fails unless every job is done once.");
  app.add_option("--minutes", options.minutes, "All jobs must be over by then")->capture_default_str();
  app.add_option("--jobs", options.jobs, "Stub jobs of 20 - 200 ms")->capture_default_str();
  app.add_option("--workers", options.workers, "Worker processes of two slots")->capture_default_str();
  app.add_option("--seed", options.seed, "Of the relay's dice and the choice of victims")->capture_default_str();
  app.add_option("--kill-worker-s", options.kill_worker_s, "Between kills of a worker")->capture_default_str();
  app.add_option("--kill-server-s", options.kill_server_s, "Life of a server, from its readiness")
      ->capture_default_str();
  app.add_flag("--bridged", options.bridged, "Workers on buses of their own, joined to the server by injured links");
  CLI11_PARSE(app, argc, argv);
  if (const std::string why = service::Deployment::Unavailable(); !why.empty()) {
    std::cout << "SKIPPED, NO MULTICAST HERE: " << why << std::endl;
    return kExitSkipped;
  }
  return Chaos(options).Run() ? 0 : 1;
}

}  // namespace
}  // namespace legopt::chaos

int main(int argc, char** argv) { return legopt::GuardedMain(argc, argv, legopt::chaos::Main); }
