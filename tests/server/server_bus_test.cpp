// The server on a simulated network in virtual time, with scripted workers and clients.

#include <gtest/gtest.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <functional>
#include <memory>
#include <vector>

#include "bus/codec.h"
#include "bus/message_limits.h"
#include "server/permission.h"
#include "server/server.h"
#include "tests/doubles/simulated_network.h"
#include "tests/server/scheduler_fixture.h"

namespace legopt::server {
namespace {

using namespace std::chrono_literals;

// A party with its own transport that decodes replies.
class Party {
 public:
  Party(bus::SimulatedNetwork& network, bus::EndpointId id) : transport_(network), endpoint_(transport_, id, 17) {}

  template <class Reply, class Message>
  void Call(bus::MessageType type, const Message& message, std::function<void(const Reply&)> then) {
    bus::CallOptions options;
    options.timeout = 5s;
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

// Leases and finishes jobs until stopped.
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

// A store that counts its commits and can simulate read errors of the disk.
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

  bool RunUntil(const std::function<bool()>& done, microseconds limit = 300s) {
    const microseconds end = network_.now() + limit;
    while (!done()) {
      if (network_.now() > end) return false;
      endpoint_->Poll(0us);
      server_->Work();
      client_.endpoint().Poll(0us);
      for (auto& worker : workers_) worker->endpoint().Poll(0us);
      network_.Advance(1ms);
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

class ServerOnBadBus : public ServerOnBus {
 protected:
  ServerOnBadBus() : ServerOnBus(bus::FaultModel::StandardChaos()) {}
};

TEST_F(ServerOnBus, ExperimentIsWorkedOff) {
  AddWorkers(2);
  Submit(SampleSpec(50));
  ASSERT_TRUE(RunUntil([&] { return AllDone(); }));
  EXPECT_EQ(StatusOf(*submitted_), SubmitStatus::kCreated);
  EXPECT_EQ(store_.num_accepted(), 50);
  const auto status = Status();
  EXPECT_EQ(status["experiments"][0]["state"], "done");
  EXPECT_EQ(status["experiments"][0]["jobs"]["done"], 50);
  EXPECT_EQ(status["workers"].size(), 2U);
  EXPECT_GT(status["server"]["transport"]["requests_handled"], 0);
  EXPECT_EQ(status["server"]["requests"]["submit"]["requests"], 1);
  EXPECT_EQ(status["server"]["requests"]["result"]["requests"], 50);
  EXPECT_GT(status["server"]["requests"]["result"]["bytes"], 50);
  EXPECT_EQ(status["server"]["requests"]["shutdown"]["requests"], 0);
}

class GroupedCommits : public ServerOnBus {
 protected:
  // Sends submissions shortly one after the other and returns the number of commits.
  int CommitsFor(int submissions) {
    const int before = store_.commits;
    int answered = 0;
    for (int i = 0; i < submissions; ++i) {
      legopt_msg::submit_request request{};
      request.submission_id = "g" + std::to_string(++submission_);
      request.spec_json = SampleSpec(1).dump();
      client_.Call<legopt_msg::submit_reply>(bus::MessageType::kSubmit, request, [&](const auto&) { ++answered; });
      RunUntil([] { return false; }, 1ms);
    }
    EXPECT_TRUE(RunUntil([&] { return answered == submissions; }, 1s));
    return store_.commits - before;
  }

  int submission_ = 0;
};

TEST_F(GroupedCommits, AnIdleServerAnswersAtOnceAndABusyOneOncePerInterval) {
  RunUntil([] { return false; }, 100ms);
  EXPECT_EQ(CommitsFor(1), 1);
  RunUntil([] { return false; }, 100ms);
  const microseconds start = network_.now();
  const int commits = CommitsFor(40);
  const auto intervals = static_cast<int>((network_.now() - start) / ServerOptions{}.commit_interval);
  EXPECT_GE(commits, intervals / 2);
  EXPECT_LE(commits, intervals + 1);
  EXPECT_LT(commits, 30);
}

TEST_F(GroupedCommits, StatusCommitsBeforeItTells) {
  CommitsFor(1);
  Submit(SampleSpec(3), "late");
  nlohmann::json status = Status();  // arrives within the interval of the previous commit
  EXPECT_EQ(status["experiments"].size(), store_.LoadOpenState().experiments.size());
  EXPECT_EQ(status["experiments"].size(), 2U);
}

TEST_F(ServerOnBadBus, ChaosChangesNothing) {
  AddWorkers(2);
  Submit(SampleSpec(40));
  ASSERT_TRUE(RunUntil([&] { return AllDone(); }));
  EXPECT_EQ(store_.num_accepted(), 40);
}

TEST_F(ServerOnBadBus, RestartsChangeNothing) {
  AddWorkers(2);
  Submit(SampleSpec(60));
  for (int restart = 0; restart < 10 && !AllDone(); ++restart) {
    const std::int64_t before = store_.num_accepted();
    RunUntil([&] { return AllDone() || store_.num_accepted() > before + 3; });
    StartServer();
  }
  ASSERT_TRUE(RunUntil([&] { return AllDone(); }));
  EXPECT_EQ(store_.num_accepted(), 60);
  EXPECT_TRUE(RunUntil([&] { return submitted_.has_value(); }));
}

TEST_F(ServerOnBus, NothingIsAcknowledgedOrLeasedWhileTheStoreFails) {
  Submit(SampleSpec(4));
  ASSERT_TRUE(RunUntil([&] { return submitted_.has_value(); }));
  store_.FailWith(db::StoreErrorCode::kFull);
  submitted_.reset();
  Submit(SampleSpec(6), "s2");
  EXPECT_FALSE(RunUntil([&] { return submitted_.has_value(); }, 2s));
  EXPECT_FALSE(server_->store_healthy());
  AddWorkers(1);
  EXPECT_FALSE(RunUntil([&] { return server_->scheduler().num_leases() > 0; }, 3s));
  EXPECT_NE(Status()["server"]["store_error"], "") << "it keeps answering";
  store_.FailWith({});
  ASSERT_TRUE(RunUntil([&] { return submitted_.has_value() && AllDone(1) && AllDone(2); }));
  EXPECT_TRUE(server_->store_healthy());
  EXPECT_EQ(store_.num_accepted(), 10);
}

TEST_F(ServerOnBus, TheEndOfAnExperimentTellsWhatTheBusWentThrough) {
  AddWorkers(1);
  Submit(SampleSpec(5));
  ASSERT_TRUE(RunUntil([&] { return AllDone(); }));
  submitted_.reset();
  Submit(SampleSpec(2), "s2");
  ASSERT_TRUE(RunUntil([&] { return submitted_.has_value(); }));
  legopt_msg::cancel_request cancel{};
  cancel.experiment_id = 2;
  client_.Call<legopt_msg::cancel_reply>(bus::MessageType::kCancel, cancel, [](const auto&) {});
  ASSERT_TRUE(RunUntil([&] { return store_.health.size() == 2U; }));
  const auto first = nlohmann::json::parse(store_.health.at(1));
  EXPECT_EQ(first.at("results_accepted"), 5);
  EXPECT_GT(first.at("datagrams_received").get<int>(), 5);
  EXPECT_FALSE(first.contains("rejected_tag")) << "only what grew";
  const auto second = nlohmann::json::parse(store_.health.at(2));
  EXPECT_EQ(second.at("jobs_cancelled"), 2);
  EXPECT_FALSE(second.contains("results_accepted")) << "since its own submission";
}

// Regression found by the simulation: a deferred request failed while the store could not be read, and this ended the
// server.
TEST_F(ServerOnBus, RequestsWaitWhileReadingFails) {
  store_.FailWith(db::StoreErrorCode::kIo);
  store_.reading_fails = true;
  Submit(SampleSpec(3));
  EXPECT_FALSE(RunUntil([&] { return submitted_.has_value(); }, 2s));
  store_.FailWith({});
  EXPECT_FALSE(RunUntil([&] { return submitted_.has_value(); }, 2s));
  EXPECT_EQ(endpoint_->counters().handler_failures, 0U);
  store_.reading_fails = false;
  ASSERT_TRUE(RunUntil([&] { return submitted_.has_value(); }, 5s));
  EXPECT_EQ(StatusOf(*submitted_), SubmitStatus::kCreated);
  EXPECT_TRUE(server_->store_healthy());
}

// Requests wait for the store up to a limit; callers repeat the requests beyond it.
TEST_F(ServerOnBus, BytesOfWaitingRequestsAreLimited) {
  store_.FailWith(db::StoreErrorCode::kIo);
  Submit(SampleSpec(3), "first");
  EXPECT_FALSE(RunUntil([&] { return submitted_.has_value(); }, 1s));
  constexpr int kMore = 20;
  int answered = 0;
  for (int i = 0; i < kMore; ++i) {
    legopt_msg::submit_request request{};
    request.submission_id = "more" + std::to_string(i);
    request.spec_json = SampleSpec(1).dump();
    client_.Call<legopt_msg::submit_reply>(bus::MessageType::kSubmit, request, [&](const auto&) { ++answered; });
  }
  EXPECT_FALSE(RunUntil([&] { return answered > 0; }, 1s));
  store_.FailWith({});
  int at_once = 0;
  EXPECT_TRUE(RunUntil([&] { return (at_once = answered) > 0; }, 5s));
  EXPECT_LT(at_once, kMore) << "a specification has about 500 bytes";
  EXPECT_TRUE(RunUntil([&] { return answered == kMore; }, 60s)) << "nothing is lost";
}

TEST_F(ServerOnBus, TheDiskOfTheDatabaseHasAReserve) {
  disk_ = db::DiskSpace{1'000'000, 100'000'000'000};
  Submit(SampleSpec(3));
  ASSERT_TRUE(RunUntil([&] { return submitted_.has_value(); }, 5s));
  EXPECT_EQ(StatusOf(*submitted_), SubmitStatus::kRefused);
  EXPECT_NE(submitted_->message.find("has 1 MB free"), std::string::npos) << submitted_->message;
}

TEST_F(ServerOnBus, StoreDefectEndsTheServer) {
  Submit(SampleSpec(4));
  store_.FailWith(db::StoreErrorCode::kCorrupt);
  EXPECT_THROW(RunUntil([&] { return submitted_.has_value(); }, 2s), db::StoreError);
}

TEST_F(ServerOnBus, ProbeDescribesTheServer) {
  std::optional<legopt_msg::probe_reply> probe;
  client_.Call<legopt_msg::probe_reply>(bus::MessageType::kProbe, legopt_msg::probe_request{},
                                        [&](const auto& reply) { probe = reply; });
  ASSERT_TRUE(RunUntil([&] { return probe.has_value(); }));
  EXPECT_EQ(probe->protocol_version, bus::kProtocolVersion);
  EXPECT_EQ(probe->server_version, "test");
  EXPECT_EQ(probe->server_instance, 1);
}

TEST_F(ServerOnBus, MethodOptionsAreServed) {
  Submit(SampleSpec(1));
  ASSERT_TRUE(RunUntil([&] { return submitted_.has_value(); }));
  std::vector<legopt_msg::method_reply> replies;
  for (const char digit : {'a', 'f'}) {
    legopt_msg::method_request request{};
    request.hash = HashOf(digit);
    client_.Call<legopt_msg::method_reply>(bus::MessageType::kMethod, request,
                                           [&](const auto& reply) { replies.push_back(reply); });
    ASSERT_TRUE(RunUntil([&] { return replies.size() == (digit == 'a' ? 1U : 2U); }));
  }
  EXPECT_EQ(StatusOf(replies[0]), MethodStatus::kFound);
  EXPECT_EQ(nlohmann::json::parse(replies[0].options_json)["solver"], "a");
  EXPECT_EQ(StatusOf(replies[1]), MethodStatus::kUnknown);
}

TEST_F(ServerOnBus, DatasetsAreHandedOutInPieces) {
  dataset_ = std::string(bus::fields::kMaxPieceBytes + 10, 'x') + "end";
  const auto ask = [this](char digit, std::int64_t offset) {
    legopt_msg::dataset_request request{};
    request.hash = HashOf(digit);
    request.offset = offset;
    std::optional<legopt_msg::dataset_reply> answer;
    client_.Call<legopt_msg::dataset_reply>(bus::MessageType::kDataset, request,
                                            [&](const auto& reply) { answer = reply; });
    EXPECT_TRUE(RunUntil([&] { return answer.has_value(); }));
    return answer.value_or(legopt_msg::dataset_reply{});
  };
  const auto whole = static_cast<std::int64_t>(dataset_.size());
  const auto first = ask('a', 0);
  EXPECT_EQ(StatusOf(first), DatasetStatus::kFound);
  EXPECT_EQ(first.archive_bytes, whole);
  EXPECT_EQ(first.num_bytes, bus::fields::kMaxPieceBytes);
  const auto last = ask('a', first.num_bytes);
  EXPECT_EQ(std::string(last.piece.begin(), last.piece.end()), "xxxxxxxxxxend");
  EXPECT_EQ(ask('a', whole).num_bytes, 0);
  EXPECT_EQ(ask('a', bus::fields::kMaxArchiveBytes).num_bytes, 0) << "beyond its end";
  EXPECT_EQ(StatusOf(ask('f', 0)), DatasetStatus::kUnknown);
}

class StoredDatasets : public ServerOnBus {
 protected:
  // Without an archive: asks whether the server wants it.
  legopt_msg::store_dataset_reply Store(const std::string& archive, char digit = 'd') {
    legopt_msg::store_dataset_request request{};
    request.hash = HashOf(digit);
    request.archive.assign(archive.begin(), archive.end());
    request.num_bytes = static_cast<std::int32_t>(archive.size());
    std::optional<legopt_msg::store_dataset_reply> answer;
    client_.Call<legopt_msg::store_dataset_reply>(bus::MessageType::kStoreDataset, request,
                                                  [&](const auto& reply) { answer = reply; });
    EXPECT_TRUE(RunUntil([&] { return answer.has_value(); }));
    return answer.value_or(legopt_msg::store_dataset_reply{});
  }
  void SubmitOne(const std::string& id = "s1", char digit = 'd') {
    submitted_.reset();
    nlohmann::json spec = SampleSpec(1);
    spec["dataset"] = {{"name", std::string("set-") + digit}, {"hash", HashOf(digit)}};
    Submit(spec, id);
    EXPECT_TRUE(RunUntil([&] { return submitted_.has_value(); }));
  }
  // Submits something to commit, so that the server encounters the error of its store.
  void SubmitInVain() {
    Submit(SampleSpec(2), "in vain");
    RunUntil([] { return false; }, 1s);
  }
  std::string HandedOut(char digit = 'd') {
    legopt_msg::dataset_request request{};
    request.hash = HashOf(digit);
    std::optional<std::string> piece;
    client_.Call<legopt_msg::dataset_reply>(bus::MessageType::kDataset, request, [&](const auto& reply) {
      piece = std::string(reply.piece.begin(), reply.piece.end());
    });
    EXPECT_TRUE(RunUntil([&] { return piece.has_value(); }));
    return piece.value_or("");
  }
};

TEST_F(StoredDatasets, AnArchiveOfAnExperimentIsStoredOnceAndHandedOut) {
  EXPECT_EQ(StatusOf(Store("packed")), StoreDatasetStatus::kRefused) << "no experiment has the dataset";
  EXPECT_EQ(store_.FindDatasetArchive(HashOf('d')), std::nullopt);
  SubmitOne();
  EXPECT_EQ(StatusOf(Store("")), StoreDatasetStatus::kWanted);
  EXPECT_EQ(HandedOut(), "");
  EXPECT_EQ(StatusOf(Store("packed")), StoreDatasetStatus::kStored);
  EXPECT_EQ(store_.FindDatasetArchive(HashOf('d')), "packed") << "on disk before the answer";
  EXPECT_EQ(StatusOf(Store("another")), StoreDatasetStatus::kStored);
  EXPECT_EQ(StatusOf(Store("")), StoreDatasetStatus::kStored);
  EXPECT_EQ(HandedOut(), "packed");
  StartServer();
  EXPECT_EQ(HandedOut(), "packed");
}

TEST_F(StoredDatasets, StoredArchivesHaveABudgetTogether) {
  SubmitOne("s1", 'd');
  SubmitOne("s2", 'e');
  EXPECT_EQ(StatusOf(Store(std::string(600, 'x'), 'd')), StoreDatasetStatus::kStored);
  const auto refused = Store(std::string(600, 'x'), 'e');
  EXPECT_EQ(StatusOf(refused), StoreDatasetStatus::kRefused);
  EXPECT_NE(refused.message.find("at most 1000"), std::string::npos) << refused.message;
  EXPECT_EQ(StatusOf(Store(std::string(400, 'x'), 'e')), StoreDatasetStatus::kStored);
}

TEST_F(StoredDatasets, AServerWithoutDatasetsOrDiskRefusesAndKeepsNothing) {
  SubmitOne();
  store_.FailWith(db::StoreErrorCode::kFull);
  SubmitInVain();
  const auto unhealthy = Store("packed");
  EXPECT_EQ(StatusOf(unhealthy), StoreDatasetStatus::kRefused);
  EXPECT_NE(unhealthy.message.find("cannot be written"), std::string::npos) << unhealthy.message;
  store_.FailWith(std::nullopt);
  store_datasets_ = false;
  StartServer();
  const auto refused = Store("");
  EXPECT_EQ(StatusOf(refused), StoreDatasetStatus::kRefused);
  EXPECT_NE(refused.message.find("--no-dataset"), std::string::npos) << refused.message;
  EXPECT_EQ(StatusOf(Store("packed")), StoreDatasetStatus::kRefused);
  EXPECT_EQ(store_.FindDatasetArchive(HashOf('d')), std::nullopt);
}

TEST_F(StoredDatasets, ArchivesLeaveTheReserveOfTheDisk) {
  SubmitOne();
  disk_ = db::DiskSpace{1'000'000'003, 100'000'000'000};
  const auto refused = Store("packed");
  EXPECT_EQ(StatusOf(refused), StoreDatasetStatus::kRefused);
  EXPECT_NE(refused.message.find("1000000000 are reserved"), std::string::npos) << refused.message;
  disk_->free_bytes = 99'000'000'000;
  EXPECT_EQ(StatusOf(Store("packed")), StoreDatasetStatus::kStored);
}

TEST_F(ServerOnBus, QueryWithoutADatabaseFileIsRefusedPolitely) {
  legopt_msg::query_request request{};
  request.sql = "SELECT 1";
  request.max_rows = 1;
  std::optional<legopt_msg::query_reply> answer;
  client_.Call<legopt_msg::query_reply>(bus::MessageType::kQuery, request, [&](const auto& reply) { answer = reply; });
  ASSERT_TRUE(RunUntil([&] { return answer.has_value(); }));
  EXPECT_EQ(StatusOf(*answer), QueryStatus::kRefused);
}

TEST_F(ServerOnBus, MalformedBodiesAreRejectedByField) {
  bus::CallResult result;
  bool done = false;
  client_.endpoint().Call(bus::kServer, bus::MessageType::kLease, "garbage", {}, [&](bus::CallResult&& r) {
    result = std::move(r);
    done = true;
  });
  ASSERT_TRUE(RunUntil([&] { return done; }));
  EXPECT_EQ(result.status, bus::CallResult::kRejected);
  EXPECT_EQ(result.code, bus::ErrorCode::kMalformed);
}

// The table of PROTOCOL.md, section 11, for every action, with or without an object.
TEST(Permission, ActionsThatConcernTheWorkOfOthersAreForOperators) {
  const std::vector<ControlAction> operators_only = {ControlAction::kPauseNow, ControlAction::kRelease,
                                                     ControlAction::kPriority, ControlAction::kDelete,
                                                     ControlAction::kDrainWorker};
  for (const EnumName<ControlAction>& row : kEnumNames<ControlAction>) {
    legopt_msg::control_request request{};
    request.action = EnumNumber(row.value);
    const bool restricted = std::find(operators_only.begin(), operators_only.end(), row.value) != operators_only.end();
    EXPECT_EQ(RefusalOf(bus::KeyRole::kOperator, request), "") << row.word;
    EXPECT_EQ(RefusalOf(bus::KeyRole::kClient, request).empty(), !restricted) << row.word;
    if (restricted) {
      EXPECT_EQ(
          RefusalOf(bus::KeyRole::kClient, request),
          "a client's key does not permit the action '" + std::string(row.word) + "'; give --key-file the full key");
    }
  }
}

TEST_F(ServerOnBus, ShutdownIsAnsweredAndDrains) {
  bool answered = false;
  client_.Call<legopt_msg::shutdown_reply>(
      bus::MessageType::kShutdown, legopt_msg::shutdown_request{},
      [&](const auto& reply) { answered = StatusOf(reply) == ShutdownStatus::kStopping; });
  ASSERT_TRUE(RunUntil([&] { return answered; }));
  EXPECT_TRUE(server_->shutdown_requested());
}

}  // namespace
}  // namespace legopt::server
