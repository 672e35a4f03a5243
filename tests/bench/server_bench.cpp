// Empty jobs end to end: real server code on a real database file, real LCM, and two workers that do nothing.
//
// Each party has its own thread, transport and endpoint, as separate processes would. Requires a multicast route.

#include <benchmark/benchmark.h>
#include <spdlog/spdlog.h>

#include <atomic>
#include <nlohmann/json.hpp>
#include <optional>
#include <thread>

#include "bus/codec.h"
#include "bus/lcm_transport.h"
#include "db/sqlite_store.h"
#include "server/server.h"
#include "tests/db/store_samples.h"
#include "tests/doubles/memory_store.h"

namespace legopt::server {
namespace {

using namespace std::chrono_literals;
using db::HashOf;

nlohmann::json SpecOf(int num_problems, int repetitions) {
  auto problems = nlohmann::json::array(), waypoints = nlohmann::json::array();
  for (int i = 0; i < num_problems; ++i) {
    problems.push_back(i);
    waypoints.push_back(1);
  }
  return {{"spec_version", 1},
          {"name", "empty jobs"},
          {"seed", 1},
          {"repetitions", repetitions},
          {"dataset", {{"name", "garage"}, {"hash", HashOf('d')}}},
          {"tasks", {{{"task", "posture"}, {"problems", problems}, {"waypoints", waypoints}}}},
          {"initializations", {"good", "in_collision"}},
          {"methods",
           {{{"name", "none"},
             {"hash", HashOf('a')},
             {"options", nlohmann::json::object()},
             {"multi_starts", 0},
             {"sample_size", 100},
             {"incremental", false}}}},
          {"limits", {{"wall_time_s", 60}, {"memory_mb", 1024}}},
          {"max_attempts", 3}};
}

legopt_msg::result_request ResultOf(const legopt_msg::lease& lease, std::int64_t worker_id) {
  legopt_msg::result_request result{};
  result.worker_id = worker_id;
  result.job_id = lease.job_id;
  result.attempt = lease.attempt;
  result.token = lease.token;
  result.solver_status = "converged_feasible";
  result.verdict_literal = "success";
  result.verdict_strict = "success";
  result.verdict_solid = result.verdict_physical = "success";
  result.failed_waypoint = -1;
  result.wall_us = 1000;
  result.cost = 400;
  result.num_waypoints = 1;
  result.waypoint_size = 36;
  result.waypoints.assign(36, 0.25);
  return result;
}

// Leases batches and reports every job as finished at once, with several results in flight.
class EmptyWorker {
 public:
  EmptyWorker(const bus::LcmOptions& network, std::uint64_t seed)
      : transport_(network), endpoint_(transport_, bus::RandomEndpointId(), seed) {}

  void Run(const std::atomic<bool>& stop) {
    Hello();
    while (!stop) endpoint_.Poll(20ms);
  }

 private:
  template <class Reply, class Message>
  void Call(const Message& message, std::function<void(const Reply&)> then) {
    endpoint_.Call(bus::kServer, bus::CallOf<Message>::kType, bus::Encode(message), {},
                   [then](bus::CallResult&& result) {
                     const auto reply = bus::Decode<Reply>(result.body);
                     if (result.status == bus::CallResult::kOk && reply) then(*reply);
                   });
  }

  void Hello() {
    legopt_msg::hello_request request{};
    request.protocol_version = bus::kProtocolVersion;
    request.build_id = "bench";
    request.processors = 1;
    request.worker_name = "empty";
    request.pid = 1;
    request.slots = 1;
    legopt_msg::capability dataset{};
    dataset.kind = "dataset";
    dataset.name = "garage";
    dataset.hash = HashOf('d');
    request.capabilities = {dataset};
    Call<legopt_msg::hello_reply>(request, [this](const auto& reply) {
      registration_ = reply;
      Lease();
    });
  }

  void Lease() {
    legopt_msg::lease_request request{};
    request.worker_id = registration_.worker_id;
    request.server_instance = registration_.server_instance;
    request.max_jobs = kBatch;
    leasing_ = true;
    Call<legopt_msg::lease_reply>(request, [this](const auto& reply) {
      leasing_ = false;
      ready_.insert(ready_.end(), reply.jobs.begin(), reply.jobs.end());
      Deliver();
      if (reply.jobs.empty()) Lease();
    });
  }

  void Deliver() {
    while (!ready_.empty() && in_flight_ < kWindow) {
      const legopt_msg::lease lease = ready_.back();
      ready_.pop_back();
      ++in_flight_;
      Call<legopt_msg::result_reply>(ResultOf(lease, registration_.worker_id), [this](const auto&) {
        --in_flight_;
        Deliver();
      });
    }
    if (static_cast<int>(ready_.size()) < kBatch / 2 && !leasing_) Lease();
  }

  static constexpr int kBatch = 32;
  static constexpr int kWindow = 16;
  bus::LcmTransport transport_;
  bus::Endpoint endpoint_;
  legopt_msg::hello_reply registration_{};
  std::vector<legopt_msg::lease> ready_;
  int in_flight_ = 0;
  bool leasing_ = false;
};

void BM_EmptyJobsOverLcm(benchmark::State& state) {
  spdlog::set_level(spdlog::level::off);
  constexpr int kNumJobs = 20'000;
  for (auto _ : state) {
    const db::TemporaryFolder folder;
    bus::LcmOptions network;
    network.port = bus::FindFreePortPair(bus::RandomSeed());
    const auto store = db::OpenSqliteStore(folder / "bench.sqlite");
    bus::LcmTransport transport(network);
    bus::Endpoint endpoint(transport, bus::kServer, bus::RandomSeed());
    ServerOptions options;
    options.scheduler.server_instance = 1;
    options.pid = 1;
    Server server(
        endpoint, *store, nullptr, options, [] { return std::int64_t{1}; }, bus::RandomEndpointId);
    std::atomic<bool> stop = false;
    std::vector<std::thread> workers;
    for (std::uint64_t seed = 1; seed <= 2; ++seed) {
      workers.emplace_back([&, seed] { EmptyWorker(network, seed).Run(stop); });
    }
    legopt_msg::submit_request submit{};
    submit.submission_id = "bench";
    submit.spec_json = SpecOf(100, kNumJobs / 200).dump();
    bus::LcmTransport client_transport(network);
    bus::Endpoint client(client_transport, bus::RandomEndpointId(), 7);
    client.Call(bus::kServer, bus::MessageType::kSubmit, bus::Encode(submit), {}, {});
    const auto done = [&] {
      const auto& experiments = server.scheduler().experiments();
      return !experiments.empty() && experiments.begin()->second.state == db::ExperimentState::kDone;
    };
    const auto start = std::chrono::steady_clock::now();
    while (!done()) {
      client.Poll(0us);
      server.Round(10ms);
    }
    const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - start;
    state.SetIterationTime(elapsed.count());
    stop = true;
    for (std::thread& worker : workers) worker.join();
  }
  state.counters["jobs/s"] = benchmark::Counter(static_cast<double>(kNumJobs) * static_cast<double>(state.iterations()),
                                                benchmark::Counter::kIsRate);
}
BENCHMARK(BM_EmptyJobsOverLcm)->UseManualTime()->Iterations(3)->Unit(benchmark::kMillisecond);

// The scheduler alone leases and finishes one job of a large experiment.
void BM_ScheduleOneJob(benchmark::State& state) {
  db::MemoryStore store;
  std::int64_t token = 0;
  SchedulerOptions options;
  options.server_instance = 1;
  Scheduler scheduler(
      options, store.LoadOpenState(), [&] { return ++token; },
      {[](std::int64_t, int) { return std::nullopt; }, [](const std::string&) { return std::nullopt; },
       [](std::int64_t) { return std::nullopt; },
       [](const db::ResultSearch& search) { return std::vector<db::KnownResult>(search.problems.size()); }},
      {});
  Scheduler::Ops ops;
  legopt_msg::submit_request submit{};
  submit.submission_id = "bench";
  submit.spec_json = SpecOf(100, 5000).dump();
  scheduler.Submit({}, submit, ops);
  legopt_msg::hello_request hello{};
  hello.protocol_version = bus::kProtocolVersion;
  hello.build_id = "bench";
  hello.processors = 1;
  legopt_msg::capability dataset{};
  dataset.kind = "dataset";
  dataset.name = "garage";
  dataset.hash = HashOf('d');
  hello.capabilities = {dataset};
  legopt_msg::lease_request request{};
  request.worker_id = scheduler.Hello({}, 99, hello, ops).worker_id;
  request.server_instance = 1;
  request.max_jobs = 1;
  for (auto _ : state) {
    ops.clear();
    const auto reply = scheduler.Lease({}, 99, request, ops);
    if (reply.jobs.empty()) {
      state.SkipWithError("out of jobs");
      break;
    }
    scheduler.Result({}, ResultOf(reply.jobs[0], request.worker_id), ops);
  }
}
BENCHMARK(BM_ScheduleOneJob)->Iterations(900'000);

}  // namespace
}  // namespace legopt::server
