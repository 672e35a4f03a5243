#pragma once

#include <gtest/gtest.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <chrono>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "bus/codec.h"
#include "server/server.h"
#include "tests/doubles/simulated_network.h"
#include "tests/server/scheduler_fixture.h"

namespace legopt::server {

/// A party with its own transport that decodes replies.
class Party {
 public:
  Party(bus::SimulatedNetwork& network, bus::EndpointId id) : transport_(network), endpoint_(transport_, id, 17) {}

  template <class Reply, class Message>
  void Call(bus::MessageType type, const Message& message, std::function<void(const Reply&)> then) {
    bus::CallOptions options;
    options.timeout = std::chrono::seconds(5);
    endpoint_.Call(bus::kServer, type, bus::Encode(message), options, [this, type, message, then](bus::CallResult&& r) {
      if (r.status == bus::CallResult::kRejected) {
        ADD_FAILURE() << "refused: " << r.error;
        return;
      }
      if (r.status == bus::CallResult::kTimeout) return Call<Reply>(type, message, then);  // a new call
      std::string why;
      const auto reply = bus::Decode<Reply>(r.body, &why);
      ASSERT_TRUE(reply) << why;
      then(*reply);
    });
  }

  bus::Endpoint& endpoint() { return endpoint_; }

 private:
  bus::SimulatedTransport transport_;
  bus::Endpoint endpoint_;
};

/// Leases and finishes jobs until stopped.
class ScriptedWorker {
 public:
  ScriptedWorker(bus::SimulatedNetwork& network, bus::EndpointId id) : party_(network, id) { Hello(); }

  bus::Endpoint& endpoint() { return party_.endpoint(); }
  int accepted = 0, refused = 0;

 private:
  void Hello() {
    legopt_msg::hello_request request{};
    request.protocol_version = bus::kProtocolVersion;
    request.build_id = "test";
    request.processors = 1;
    request.worker_name = "scripted";
    request.pid = 1;
    request.slots = 1;
    legopt_msg::capability dataset{};
    dataset.kind = "dataset";
    dataset.name = "garage";
    dataset.hash = HashOf('d');
    request.capabilities = {dataset};
    party_.Call<legopt_msg::hello_reply>(bus::MessageType::kHello, request, [this](const auto& reply) {
      ASSERT_EQ(StatusOf(reply), HelloStatus::kOk) << reply.message;
      registration_ = reply;
      Lease();
    });
  }

  void Lease() {
    legopt_msg::lease_request request{};
    request.worker_id = registration_.worker_id;
    request.server_instance = registration_.server_instance;
    request.max_jobs = 4;
    party_.Call<legopt_msg::lease_reply>(bus::MessageType::kLease, request, [this](const auto& reply) {
      if (StatusOf(reply) == LeaseStatus::kUnknownWorker) return Hello();
      if (StatusOf(reply) == LeaseStatus::kNoMoreWork) return;
      left_ = static_cast<int>(reply.jobs.size());
      for (const auto& lease : reply.jobs) Deliver(lease);
      if (left_ == 0) Lease();
    });
  }

  void Deliver(const legopt_msg::lease& lease) {
    auto result = ResultFor(registration_.worker_id, lease);
    result.trace.assign(3000, 7);  // more than one datagram
    party_.Call<legopt_msg::result_reply>(bus::MessageType::kResult, result, [this](const auto& reply) {
      const ResultStatus status = StatusOf(reply);
      ++(status == ResultStatus::kAccepted || status == ResultStatus::kDuplicate ? accepted : refused);
      if (--left_ == 0) Lease();
    });
  }

  Party party_;
  legopt_msg::hello_reply registration_{};
  int left_ = 0;
};

/// A store that counts its commits and can simulate read errors of the disk.
class CountingStore : public db::MemoryStore {
 public:
  std::optional<std::string> FindMethodOptions(const std::string& hash) override {
    if (reading_fails) throw db::StoreError(db::StoreErrorCode::kIo, "reading fails");
    return MemoryStore::FindMethodOptions(hash);
  }
  void Apply(std::span<const db::StoreOp> operations) override {
    MemoryStore::Apply(operations);
    ++commits;
    for (const db::StoreOp& operation : operations) {
      const auto* event = std::get_if<db::RecordEvent>(&operation);
      if (event != nullptr && event->kind == "transport_health") health[event->experiment_id.value()] = event->detail;
    }
  }
  int commits = 0;
  std::map<std::int64_t, std::string> health;  // key: experiment
  bool reading_fails = false;
};

/// A server, workers and one client on a simulated network in virtual time.
class ServerOnBus : public testing::Test {
 protected:
  static void SetUpTestSuite() { spdlog::set_level(spdlog::level::off); }

  explicit ServerOnBus(const bus::FaultModel& fault_model = {}) : network_(99, fault_model) { StartServer(); }

  void StartServer() {
    server_.reset();
    endpoint_.reset();
    transport_.reset();
    transport_ = std::make_unique<bus::SimulatedTransport>(network_);
    endpoint_ = std::make_unique<bus::Endpoint>(*transport_, bus::kServer, ++lives_);
    ServerOptions options;
    options.scheduler.server_instance = static_cast<std::int64_t>(lives_);
    options.version = "test";
    options.pid = 1;
    options.disk_space = [this] { return disk_; };
    options.max_deferred_bytes = kMaxDeferredBytes;
    options.store_datasets = store_datasets_;
    options.most_dataset_bytes = most_dataset_bytes_;
    options.find_dataset = [this](const std::string& hash) { return hash == HashOf('a') ? &dataset_ : nullptr; };
    server_ = std::make_unique<Server>(
        *endpoint_, store_, nullptr, options, [this] { return network_.now().count(); }, [this] { return ++token_; });
  }

  bool RunUntil(const std::function<bool()>& done, microseconds limit = std::chrono::seconds(300)) {
    const microseconds end = network_.now() + limit;
    while (!done()) {
      if (network_.now() > end) return false;
      endpoint_->Poll(microseconds(0));
      server_->Work();
      client_.endpoint().Poll(microseconds(0));
      for (auto& worker : workers_) worker->endpoint().Poll(microseconds(0));
      network_.Advance(std::chrono::milliseconds(1));
    }
    return true;
  }

  void AddWorkers(int count) {
    for (int i = 0; i < count; ++i) {
      workers_.push_back(std::make_unique<ScriptedWorker>(network_, static_cast<bus::EndpointId>(1'000'000 + i)));
    }
  }

  void Submit(const nlohmann::json& spec, const std::string& id = "s1") {
    legopt_msg::submit_request request{};
    request.submission_id = id;
    request.spec_json = spec.dump();
    client_.Call<legopt_msg::submit_reply>(bus::MessageType::kSubmit, request,
                                           [this](const auto& reply) { submitted_ = reply; });
  }

  nlohmann::json Status() {
    nlohmann::json status;
    client_.Call<legopt_msg::status_reply>(bus::MessageType::kStatus, legopt_msg::status_request{},
                                           [&](const auto& reply) { status = nlohmann::json::parse(reply.json); });
    EXPECT_TRUE(RunUntil([&] { return !status.is_null(); }));
    return status;
  }

  /// Returns whether all jobs are done on disk, not only in the scheduler.
  bool AllDone(std::int64_t experiment = 1) {
    const std::vector<db::ExperimentSummary> all = store_.LoadOpenState().experiments;
    return std::any_of(all.begin(), all.end(), [&](const db::ExperimentSummary& one) {
      return one.experiment_id == experiment && one.state == db::ExperimentState::kDone;
    });
  }

  static constexpr std::size_t kMaxDeferredBytes = 5000;
  std::optional<db::DiskSpace> disk_;  // disk of the database; empty: unknown
  bus::SimulatedNetwork network_;
  CountingStore store_;
  std::unique_ptr<bus::SimulatedTransport> transport_;
  std::unique_ptr<bus::Endpoint> endpoint_;
  std::unique_ptr<Server> server_;
  Party client_{network_, 555'555};
  std::vector<std::unique_ptr<ScriptedWorker>> workers_;
  std::optional<legopt_msg::submit_reply> submitted_;
  std::uint64_t lives_ = 0;
  std::int64_t token_ = 0;
  std::string dataset_ = "archive";  // archive of hash aaa...
  bool store_datasets_ = true;
  std::int64_t most_dataset_bytes_ = 1000;
};

}  // namespace legopt::server
