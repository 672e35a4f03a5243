// Policy: requests of any number of senders do not grow the server's memory or its database. There is one case for
// each message type, with a body that the server accepts. The limits of the bus and of the scheduler are small here,
// so that the first half of the senders reaches them; the second half must add nothing.

#include <gtest/gtest.h>
#include <malloc.h>
#include <poll.h>
#include <spdlog/spdlog.h>

#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "bus/codec.h"
#include "db/sqlite_store.h"
#include "legopt/types/reply.h"
#include "server/server.h"
#include "tests/bus/sample_messages.h"
#include "tests/doubles/simulated_network.h"
#include "tests/server/sample_spec.h"

namespace legopt::server {
namespace {

using namespace std::chrono_literals;

// Returns the heap in use in bytes; 0 if a sanitizer's allocator does not count it.
std::size_t HeapBytes() {
  const auto info = mallinfo2();
  return info.uordblks + info.hblkhd;
}

// Returns the request of sender number `i`.
template <class Request>
Request RequestOf(int /*i*/) {
  return bus::Sample<Request>();
}
template <>
legopt_msg::hello_request RequestOf(int i) {
  auto request = bus::Sample<legopt_msg::hello_request>();
  request.protocol_version = bus::kProtocolVersion;
  request.worker_name = "worker " + std::to_string(i) + std::string(100, 'w');
  return request;
}
template <>
legopt_msg::submit_request RequestOf(int i) {
  legopt_msg::submit_request request{};
  request.submission_id = "submission " + std::to_string(i);
  auto spec = SampleSpec(10);
  spec["submitter"] = "submitter " + std::to_string(i);
  request.spec_json = spec.dump();
  return request;
}
template <>
legopt_msg::control_request RequestOf(int i) {
  legopt_msg::control_request request{};
  request.experiment_id = 1;
  request.action = EnumNumber(i % 2 == 0 ? ControlAction::kPause : ControlAction::kResume);
  return request;
}
template <>
legopt_msg::query_request RequestOf(int /*i*/) {
  legopt_msg::query_request request{};
  request.sql = "SELECT count(*) FROM jobs";
  request.max_rows = 1;
  return request;
}
template <>
legopt_msg::status_request RequestOf(int /*i*/) {
  return {};  // all experiments
}

struct Kind {
  bus::MessageType type{};
  std::function<std::string(int)> body;  // body of sender number i
};

template <class... Request>
std::vector<Kind> KindsOf(bus::MessageList<Request...> /*list*/) {
  return {{bus::CallOf<Request>::kType, [](int i) { return bus::Encode(RequestOf<Request>(i)); }}...};
}

class FloodBed : public testing::Test {
 protected:
  FloodBed() : store_(db::OpenSqliteStore(path_)), queries_(path_) {
    spdlog::set_level(spdlog::level::off);
    bus::EndpointOptions limits;
    limits.max_cached_bytes = 64 << 10;
    limits.max_peers = 128;
    endpoint_ = std::make_unique<bus::Endpoint>(transport_, bus::kServer, 1, limits);
    ServerOptions options;
    options.scheduler.server_instance = 1;
    options.scheduler.max_new_worker_bytes = 256 << 10;
    options.scheduler.max_open_experiments = 100;
    options.scheduler.max_experiments = 200;
    options.scheduler.control_burst = 100;
    options.version = "test";
    options.pid = 1;
    server_ = std::make_unique<Server>(
        *endpoint_, *store_, &queries_, options, [this] { return network_.now().count(); },
        [this] { return ++token_; });
    Call(-1, bus::MessageType::kSubmit, bus::Encode(RequestOf<legopt_msg::submit_request>(-1)));
  }

  // Expects that the second half of the calls does not raise memory or file size above their level after the first
  // half.
  void ExpectFlat(const std::function<void(int)>& call, int half) {
    constexpr std::size_t kMaxGrowth = 32;  // bytes per call; stored data of a call would take more
    for (int i = 0; i < half; ++i) call(i);
    const std::size_t file = FileBytes(), heap = HeapBytes();
    for (int i = half; i < 2 * half; ++i) call(i);
    EXPECT_LE(FileBytes(), file + kMaxGrowth * static_cast<std::size_t>(half));
    EXPECT_LE(HeapBytes(), heap + kMaxGrowth * static_cast<std::size_t>(half));
  }

  // Makes one call from a new sender and waits for the answer.
  void Call(int i, bus::MessageType type, std::string body) {
    bus::SimulatedTransport transport(network_);
    bus::Endpoint sender(transport, 1'000'000 + i, static_cast<std::uint64_t>(i));
    bool answered = false;
    sender.Call(bus::kServer, type, std::move(body), {}, [&](bus::CallResult&& result) {
      answered = true;
      EXPECT_EQ(result.status, bus::CallResult::kOk) << result.error;
    });
    while (!answered) {
      sender.Poll(0us);
      endpoint_->Poll(0us);
      if (type == bus::MessageType::kQuery) AwaitQuery();
      server_->Work();
      network_.Advance(1ms);
    }
  }

  void AwaitQuery() {
    pollfd ready{queries_.descriptor(), POLLIN, 0};
    constexpr int kLongest_ms = 1;
    poll(&ready, 1, kLongest_ms);
  }

  // Returns the file size after a complete checkpoint.
  std::size_t FileBytes() {
    network_.Advance(5s);
    server_->Work();
    store_->Idle();
    return std::filesystem::file_size(path_);
  }

  db::TemporaryFolder folder_;
  std::filesystem::path path_ = folder_ / "results.sqlite";
  std::unique_ptr<db::Store> store_;
  QueryService queries_;
  bus::SimulatedNetwork network_{5};
  bus::SimulatedTransport transport_{network_};
  std::unique_ptr<bus::Endpoint> endpoint_;
  std::unique_ptr<Server> server_;
  std::int64_t token_ = 0;
};

class Flood : public FloodBed, public testing::WithParamInterface<Kind> {};

TEST_P(Flood, ManySendersLeaveMemoryAndFileFlat) {
  if (HeapBytes() == 0) GTEST_SKIP() << "the heap cannot be measured (sanitizer)";
  constexpr int kHalf = 2000;
  ExpectFlat([this](int i) { Call(i, GetParam().type, GetParam().body(i)); }, kHalf);
}

// Deleted experiments leave nothing behind, for any submitter and caller.
TEST_F(FloodBed, ExperimentsThatAreDeletedLeaveMemoryAndFileFlat) {
  if (HeapBytes() == 0) GTEST_SKIP() << "the heap cannot be measured (sanitizer)";
  const auto cycle = [this](int i) {
    Call(3 * i, bus::MessageType::kSubmit, bus::Encode(RequestOf<legopt_msg::submit_request>(i)));
    legopt_msg::cancel_request cancel{};
    legopt_msg::control_request removal{};
    cancel.experiment_id = removal.experiment_id = i + 2;  // after the first one
    removal.action = EnumNumber(ControlAction::kDelete);
    Call(3 * i + 1, bus::MessageType::kCancel, bus::Encode(cancel));
    Call(3 * i + 2, bus::MessageType::kControl, bus::Encode(removal));
  };
  constexpr int kHalf = 600;
  ExpectFlat(cycle, kHalf);
}

INSTANTIATE_TEST_SUITE_P(Types, Flood, testing::ValuesIn(KindsOf(bus::Requests())),
                         [](const auto& one) { return std::string(ToString(one.param.type)); });

}  // namespace
}  // namespace legopt::server
