// Cost of the bridge over real sockets of this host: calls between two buses connected only by the link, compared with
// calls on one bus, and the hub's cost for idle spokes.
#include <benchmark/benchmark.h>
#include <poll.h>

#include <algorithm>
#include <atomic>
#include <ctime>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <unordered_map>
#include <utility>
#include <vector>

#include "bus/bridge/bridge.h"
#include "bus/bridge/hub_and_spoke.h"
#include "bus/bus_error.h"
#include "bus/endpoint.h"
#include "bus/lcm_transport.h"

namespace legopt::bridge {
namespace {

constexpr bus::EndpointId kBenchClient = bus::EndpointId{1} << 40;

LinkSocket AnyPortOfLoopback() {
  constexpr LinkAddress kAnyPort = ~LinkAddress{0xFFFF};
  return LinkSocket(ParseLinkAddress("127.0.0.1:1") & kAnyPort);
}

bus::LcmOptions BusOfItsOwn() {
  bus::LcmOptions options;
  options.port = bus::FindFreePortPair(bus::RandomSeed());
  options.deployment = 4711;
  return options;
}

class EchoServer {
 public:
  explicit EchoServer(const bus::LcmOptions& options)
      : transport_(options), endpoint_(transport_, bus::kServer, bus::RandomSeed()) {
    endpoint_.Serve(bus::MessageType::kResult,
                    [](bus::Request&& request, bus::Responder responder) { responder.Reply(std::move(request.body)); });
    thread_ = std::thread([this] {
      while (!stop_) endpoint_.Poll(std::chrono::milliseconds(10));
    });
  }
  ~EchoServer() {
    stop_ = true;
    thread_.join();
  }

 private:
  bus::LcmTransport transport_;
  bus::Endpoint endpoint_;
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

// range(0): bytes of the body in each direction; range(1): number of open calls; range(2): 1 over the bridge, 0 on one
// bus.
void Calls(benchmark::State& state) {
  try {
    const bus::LcmOptions near = BusOfItsOwn();
    const EchoServer server(near);
    const bool bridged = state.range(2) != 0;
    const bus::LcmOptions far = bridged ? BusOfItsOwn() : near;
    std::unique_ptr<Bridge> hub, spoke;
    if (bridged) {
      LinkSocket socket = AnyPortOfLoopback();
      const LinkAddress address = socket.address();
      hub = Bridge::RunHub(near, std::move(socket));
      spoke = Bridge::RunSpoke(far, AnyPortOfLoopback(), {address});
    }
    bus::LcmTransport transport(far);
    bus::Endpoint client(transport, kBenchClient, bus::RandomSeed());
    const std::string body(static_cast<std::size_t>(state.range(0)), 'x');
    int open = 0;
    const auto call = [&] {
      ++open;
      client.Call(bus::kServer, bus::MessageType::kResult, body, {}, [&](bus::CallResult&& result) {
        --open;
        if (result.status != bus::CallResult::kOk) state.SkipWithError("a call failed");
      });
    };
    call();  // wait until the link is up
    while (open > 0) client.Poll(std::chrono::milliseconds(10));
    const std::clock_t cpu_before = std::clock();
    for (auto _ : state) {
      while (open >= state.range(1)) client.Poll(std::chrono::milliseconds(10));
      call();
    }
    while (open > 0) client.Poll(std::chrono::milliseconds(10));
    state.SetItemsProcessed(state.iterations());
    state.counters["process_us_per_call"] =
        1e6 * static_cast<double>(std::clock() - cpu_before) / CLOCKS_PER_SEC / static_cast<double>(state.iterations());
    state.counters["retried"] = static_cast<double>(client.counters().requests_retried);
  } catch (const bus::BusError& error) {
    state.SkipWithError(error.what());
  }
}
BENCHMARK(Calls)->ArgsProduct({{108, 1000}, {1, 48}, {0, 1}})->UseRealTime();

// Many spokes on one socket; to the hub they look like spokes on as many hosts.
class Spokes final : private Carrier {
 public:
  Spokes(std::size_t count, LinkAddress hub) : socket_(AnyPortOfLoopback()) {
    Carrier& carrier = *this;
    for (std::size_t i = 0; i < count; ++i) {
      spokes_.push_back(
          std::make_unique<Spoke>(DeploymentIdentity{4711, nullptr}, std::vector{hub}, bus::RandomSeed(), carrier));
    }
  }

  void RunFor(microseconds time) {
    const microseconds end = Now() + time;
    for (microseconds now = Now(); now < end; now = Now()) {
      for (const auto& spoke : spokes_) spoke->Tick(now);
      pollfd wait{socket_.descriptor(), POLLIN, 0};
      ::poll(&wait, 1, 1);
      Drain(now);
    }
  }
  std::size_t connected() const {
    return static_cast<std::size_t>(std::count_if(spokes_.begin(), spokes_.end(),
                                                  [](const auto& spoke) { return spoke->connected().has_value(); }));
  }

 private:
  static microseconds Now() {
    return std::chrono::duration_cast<microseconds>(std::chrono::steady_clock::now().time_since_epoch());
  }
  // Dispatches each envelope by the link number in its header; all other spokes would drop it.
  void Drain(microseconds now) {
    EnvelopeBuffer room;
    LinkAddress from = 0;
    while (const std::size_t bytes = socket_.Receive(room, from)) {
      EnvelopeView view;
      if (OpenEnvelope(std::span(room.data(), bytes), 4711, nullptr, view) != EnvelopeFault::kNone) continue;
      const auto owner = owners_.find(view.header.link);
      if (owner != owners_.end()) owner->second->OnLink(from, std::span(room.data(), bytes), now);
    }
  }
  void ToBus(bus::Port /*port*/, std::span<const std::uint8_t> /*frame*/) override {}
  void ToLink(LinkAddress to, std::span<const std::uint8_t> envelope) override {
    EnvelopeView view;
    if (OpenEnvelope(envelope, 4711, nullptr, view) == EnvelopeFault::kNone && !owners_.contains(view.header.link)) {
      // The first envelope of a spoke carries its link number; spokes connect in order.
      owners_[view.header.link] = spokes_[owners_.size()].get();
    }
    socket_.Send(to, envelope);
  }

  LinkSocket socket_;
  std::vector<std::unique_ptr<Spoke>> spokes_;
  std::unordered_map<std::int64_t, Spoke*> owners_;
};

// range(0): number of connected, idle spokes. Runs for five seconds. The hub's share of a core is measured as the CPU
// time of this process without the spokes' thread.
void IdleSpokes(benchmark::State& state) {
  try {
    LinkSocket socket = AnyPortOfLoopback();
    const LinkAddress address = socket.address();
    const auto hub = Bridge::RunHub(BusOfItsOwn(), std::move(socket));
    Spokes spokes(static_cast<std::size_t>(state.range(0)), address);
    spokes.RunFor(std::chrono::seconds(4));
    const auto cpu = [](clockid_t clock) {
      timespec time{};
      ::clock_gettime(clock, &time);
      return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
    };
    for (auto _ : state) {
      const double before = cpu(CLOCK_PROCESS_CPUTIME_ID) - cpu(CLOCK_THREAD_CPUTIME_ID);
      constexpr std::chrono::seconds kTime(5);
      spokes.RunFor(kTime);
      const double used = cpu(CLOCK_PROCESS_CPUTIME_ID) - cpu(CLOCK_THREAD_CPUTIME_ID) - before;
      state.counters["hub_percent_of_a_core"] = 100 * used / static_cast<double>(kTime.count());
    }
    state.counters["connected"] = static_cast<double>(spokes.connected());
  } catch (const bus::BusError& error) {
    state.SkipWithError(error.what());
  }
}
BENCHMARK(IdleSpokes)->Arg(100)->Arg(4000)->Iterations(1)->UseRealTime();

}  // namespace
}  // namespace legopt::bridge

BENCHMARK_MAIN();
