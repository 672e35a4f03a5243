// Runs seeded histories of bridged hosts: calls under standard chaos while hub and spokes restart, hosts change their
// address, and a stranger injects recorded, damaged and reflected envelopes. Every call must be answered once with its
// own body, and no bridge may do what PROTOCOL.md, section 14, forbids.

#include <CLI/CLI.hpp>
#include <cstdint>
#include <iostream>
#include <random>
#include <string>

#include "bus/wire.h"
#include "tests/bus/bridge/joined_hosts.h"
#include "tests/guarded_main.h"

namespace legopt::bridge {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr int kCallers = 3;
constexpr int kCalls = 40;  // calls per history
constexpr seconds kCallLimit{60};

class History {
 public:
  explicit History(std::uint64_t seed) : random_(seed), hosts_(kCallers, seed, BridgeTestKey()) {
    hosts_.wire().set_fault_model(bus::FaultModel::StandardChaos());
  }

  // Returns the fault that was found, or an empty string.
  std::string Play() {
    for (int call = 0; call < kCalls; ++call) {
      Begin("call " + std::to_string(call) + std::string(Below(4) == 0 ? 5000 : 5, '.'));
      Pass(milliseconds(Below(400)));
      DisturbRandomly();
    }
    hosts_.RunUntil([this] { return open_ == 0; }, kCallLimit);
    if (!hosts_.first_violation().empty()) return hosts_.first_violation();
    if (!fault_.empty()) return fault_;
    if (hosts_.handled() != kCalls) return std::to_string(hosts_.handled()) + " requests handled";
    return "";
  }

 private:
  std::uint64_t Below(std::uint64_t bound) { return random_() % bound; }
  int AnyCaller() { return static_cast<int>(Below(kCallers)); }
  void Pass(microseconds time) {
    hosts_.RunUntil([] { return false; }, time);
  }

  void Begin(const std::string& body) {
    ++open_;
    bus::CallOptions options;
    options.timeout = kCallLimit;
    hosts_.caller(AnyCaller())
        .party()
        .Call(bus::kServer, bus::MessageType::kQuery, body, options, [this, body](bus::CallResult&& result) {
          --open_;
          if (result.status != bus::CallResult::kOk) fault_ = "a call was not answered";
          if (result.status == bus::CallResult::kOk && result.body != "<" + body + ">")
            fault_ = "another call's answer";
        });
  }

  void DisturbRandomly() {
    switch (Below(8)) {
      case 0:
        hosts_.server().EndBridge();
        Pass(milliseconds(Below(1500)));
        hosts_.StartHub();
        return;
      case 1:
        hosts_.StartSpoke(AnyCaller());
        return;
      case 2:
        hosts_.caller(AnyCaller()).MoveTo(JoinedHosts::kStranger + 1 + Below(1000));
        return;
      case 3:
        ForgeFrameOnBus();
        return;
      default:
        InjectSome();
    }
  }

  void InjectSome() {
    for (int i = 0; i < 30; ++i) {
      const auto& recorded = hosts_.wire().recorded();
      FaultyWire::Letter letter = recorded[Below(recorded.size())];
      if (Below(3) == 0) letter.bytes[Below(letter.bytes.size())] ^= static_cast<std::uint8_t>(1 + Below(255));
      hosts_.Inject(Below(4) == 0 ? letter.from : letter.to, letter.bytes);
    }
  }

  // Forges a frame without the key, as another process on a caller's host or on the server's host.
  void ForgeFrameOnBus() {
    const int caller = AnyCaller();
    bus::FrameHeader header;
    header.kind = bus::FrameKind::kRequest;
    header.type = static_cast<std::int16_t>(bus::MessageType::kQuery);
    header.deployment = hosts_.server().membership().deployment;
    const bool at_server = Below(2) == 0;
    const bus::EndpointId party = hosts_.caller(caller).party_id();
    header.sender = at_server ? bus::kServer : party;
    header.destination = at_server ? party : bus::kServer;
    header.session = header.call_id = 1;
    header.nonce = static_cast<std::int64_t>(1 + Below(1000));
    bus::DatagramBuffer buffer;
    Host& host = at_server ? hosts_.server() : hosts_.caller(caller);
    host.network().Inject(bus::Port::kControl, bus::SealFrame(header, 0, buffer, nullptr));
  }

  std::mt19937_64 random_;
  JoinedHosts hosts_;
  int open_ = 0;
  std::string fault_;
};

int RunHistories(int argc, char** argv) {
  std::uint64_t first = 1, seeds = 100;
  bool expect_failure = false;
  CLI::App app("Simulates bridged hosts under seeded misfortune in virtual time.");
  app.add_option("--first", first, "Seed of the first history")->capture_default_str();
  app.add_option("--seeds", seeds, "How many histories")->capture_default_str();
  app.add_flag("--expect-failure", expect_failure, "Succeed when a history fails, for planted faults");
  CLI11_PARSE(app, argc, argv);
  std::uint64_t failed = 0, played = 0;
  for (std::uint64_t seed = first; seed < first + seeds && !(expect_failure && failed > 0); ++seed) {
    ++played;
    const std::string fault = History(seed).Play();
    if (fault.empty()) continue;
    ++failed;
    std::cout << "  " << fault << "\nreproduce: " << argv[0] << " --first " << seed << " --seeds 1" << std::endl;
  }
  std::cout << played << " histories, " << failed << " failed" << std::endl;
  return (failed > 0) == expect_failure ? 0 : 1;
}

}  // namespace
}  // namespace legopt::bridge

int main(int argc, char** argv) { return legopt::GuardedMain(argc, argv, legopt::bridge::RunHistories); }
