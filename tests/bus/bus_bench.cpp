// Cost of calls over real multicast on loopback: a server thread and a client thread, each with its own transport.
// "process_us_per_call" is the CPU time of both sides and of LCM's four reader threads together. Also measures the
// memory that a party holds per served caller, over a simulated network.
#include <benchmark/benchmark.h>
#include <malloc.h>

#include <array>
#include <atomic>
#include <ctime>
#include <memory>
#include <string>
#include <thread>

#include "bus/bus_error.h"
#include "bus/endpoint.h"
#include "bus/lcm_transport.h"
#include "bus/message_key.h"
#include "bus/typed_calls.h"
#include "tests/doubles/simulated_network.h"

namespace legopt::bus {
namespace {

constexpr EndpointId kClient = 1000;

class Server {
 public:
  explicit Server(const LcmOptions& options) : transport_(options), endpoint_(transport_, kServer, RandomSeed()) {
    endpoint_.Serve(MessageType::kResult,
                    [](Request&& request, Responder responder) { responder.Reply(std::move(request.body)); });
    thread_ = std::thread([this] {
      while (!stop_) endpoint_.Poll(std::chrono::milliseconds(10));
    });
  }
  ~Server() {
    stop_ = true;
    thread_.join();
  }

 private:
  LcmTransport transport_;
  Endpoint endpoint_;
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

// range(0): bytes of the body in each direction; range(1): number of open calls.
void Calls(benchmark::State& state) {
  try {
    LcmOptions options;
    options.port = FindFreePortPair(RandomSeed());
    const Server server(options);
    LcmTransport transport(options);
    Endpoint client(transport, kClient, RandomSeed());
    const std::string body(static_cast<std::size_t>(state.range(0)), 'x');
    int open = 0;
    const std::clock_t cpu_before = std::clock();
    for (auto _ : state) {
      while (open >= state.range(1)) client.Poll(std::chrono::milliseconds(10));
      ++open;
      client.Call(kServer, MessageType::kResult, body, {}, [&](CallResult&& result) {
        --open;
        if (result.status != CallResult::kOk) state.SkipWithError("a call failed");
      });
    }
    while (open > 0) client.Poll(std::chrono::milliseconds(10));
    const double cpu_us = 1e6 * static_cast<double>(std::clock() - cpu_before) / CLOCKS_PER_SEC;
    state.SetItemsProcessed(state.iterations());
    state.counters["process_us_per_call"] = cpu_us / static_cast<double>(state.iterations());
    state.counters["retried"] = static_cast<double>(client.counters().requests_retried);
    state.counters["chunks_resent"] = static_cast<double>(client.counters().chunks_resent);
  } catch (const BusError& error) {
    state.SkipWithError(error.what());
  }
}
BENCHMARK(Calls)->Args({200, 1})->Args({200, 16})->Args({1000, 16})->UseRealTime();
BENCHMARK(Calls)->Args({3000, 1})->Args({300'000, 1})->Args({300'000, 4})->UseRealTime();

// Each caller makes one call and leaves. The second argument is 1 if there is a key.
void MemoryOfCallers(benchmark::State& state) {
  constexpr std::array<std::uint8_t, MessageKey::kBytes> kKey{1};
  const auto key = state.range(1) != 0 ? std::make_shared<const MessageKey>(kKey) : nullptr;
  double bytes = 0;
  for (auto _ : state) {
    SimulatedNetwork network(1);
    network.SetFiltered();
    SimulatedTransport transport(network, 1, key);
    Endpoint server(transport, kServer, 1);
    server.Serve(MessageType::kResult,
                 [](Request&& request, Responder responder) { responder.Reply(std::move(request.body)); });
    const std::size_t before = mallinfo2().uordblks;
    for (std::int64_t i = 0; i < state.range(0); ++i) {
      SimulatedTransport caller_transport(network, 1, key);
      Endpoint caller(caller_transport, kClient + i, static_cast<std::uint64_t>(i) + 2);
      bool answered = false;
      caller.Call(kServer, MessageType::kResult, std::string(100, 'x'), {},
                  [&](CallResult&& result) { answered = result.status == CallResult::kOk; });
      std::array endpoints = {&server, &caller};
      network.Run(
          endpoints, [&] { return answered; }, std::chrono::seconds(1));
      if (!answered) state.SkipWithError("a call failed");
    }
    bytes = static_cast<double>(mallinfo2().uordblks - before) / static_cast<double>(state.range(0));
  }
  state.counters["bytes_per_caller"] = bytes;
}
BENCHMARK(MemoryOfCallers)
    ->Args({60'000, 0})
    ->Args({60'000, 1})
    ->Args({130'000, 1})
    ->Iterations(1)
    ->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace legopt::bus

BENCHMARK_MAIN();
