// Fixture of the conformance tests: a server, a client and a network of the parameter's kind.
#pragma once

#include <gtest/gtest.h>

#include <memory>
#include <optional>
#include <random>
#include <string>
#include <utility>

#include "bus/endpoint.h"
#include "tests/bus/test_bed.h"

namespace legopt::bus {

inline constexpr EndpointId kClient = 1000;
inline constexpr EndpointId kStranger = 2000;
inline constexpr std::size_t kLarge = 300 * 1024;

inline std::string RandomBody(std::size_t bytes, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::string body(bytes, '\0');
  for (char& c : body) c = static_cast<char>(random());
  return body;
}

class Conformance : public testing::TestWithParam<BedKind> {
 protected:
  void SetUp() override {
    std::string why;
    bed_ = MakeTestBed(GetParam(), &why);
    if (bed_ == nullptr) GTEST_SKIP() << why;
    server_ = &bed_->Add(kServer);
    client_ = &bed_->Add(kClient);
  }

  static bool keyed() { return GetParam() == BedKind::kSimulatedWithKey; }

  void ServeEcho(Endpoint& endpoint) {
    endpoint.Serve(MessageType::kQuery, [this](Request&& request, Responder responder) {
      ++handled_;
      responder.Reply("<" + request.body + ">");
    });
  }

  // Makes a call and waits for its result.
  CallResult CallAndWait(std::string body, const CallOptions& options = {}) {
    std::optional<CallResult> result;
    client_->Call(kServer, MessageType::kQuery, std::move(body), options,
                  [&](CallResult&& r) { result = std::move(r); });
    EXPECT_TRUE(bed_->RunUntil([&] { return result.has_value(); }));
    return result.value_or(CallResult{});
  }

  // Waits until everything in flight has arrived.
  void Settle() {
    bed_->RunUntil([] { return false; }, std::chrono::milliseconds(60));
  }

  std::unique_ptr<TestBed> bed_;
  Endpoint* server_ = nullptr;
  Endpoint* client_ = nullptr;
  int handled_ = 0;
};

inline std::string BedName(const testing::TestParamInfo<BedKind>& parameter) {
  switch (parameter.param) {
    case BedKind::kSimulated:
      return "Simulated";
    case BedKind::kSimulatedWithKey:
      return "SimulatedWithKey";
    case BedKind::kUdp:
      return "Udp";
    case BedKind::kBridged:
      return "Bridged";
  }
  return "";
}

}  // namespace legopt::bus
