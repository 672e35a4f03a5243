// Policy: servers that hear each other agree on exactly one that serves, on any unreliable network. A server that
// already serves has priority; among starting servers, the smallest instance serves.

#include <gtest/gtest.h>

#include <memory>
#include <vector>

#include "bus/codec.h"
#include "server/single_server.h"
#include "tests/doubles/simulated_network.h"

namespace legopt::server {
namespace {

using namespace std::chrono_literals;

legopt_msg::probe_reply SelfOf(std::int64_t instance) {
  legopt_msg::probe_reply self{};
  self.protocol_version = bus::kProtocolVersion;
  self.hostname = "host";
  self.pid = instance;
  self.server_instance = instance;
  self.database = "/db";
  return self;
}

struct Candidate {
  Candidate(bus::SimulatedNetwork& network, std::int64_t instance)
      : transport(network),
        endpoint(transport, bus::kServerCandidate, static_cast<std::uint64_t>(instance)),
        candidacy(endpoint, SelfOf(instance), 400ms) {}
  bus::SimulatedTransport transport;
  bus::Endpoint endpoint;
  ServerElection candidacy;
};

// A serving server, reduced to its answers to probes.
struct Serving {
  Serving(bus::SimulatedNetwork& network, std::int64_t instance)
      : transport(network),
        endpoint(transport, bus::kServer, static_cast<std::uint64_t>(instance)),
        watch(endpoint, instance) {
    endpoint.Serve(bus::MessageType::kProbe, [instance](bus::Request&& request, bus::Responder responder) {
      const auto probe = bus::Decode<legopt_msg::probe_request>(request.body);
      if (request.sender == bus::kServer && probe->nonce == instance) return;
      responder.Reply(bus::Encode(SelfOf(instance)));
    });
  }
  bus::SimulatedTransport transport;
  bus::Endpoint endpoint;
  DuplicateServerDetector watch;
};

TEST(SoleServer, ACandidateAloneServes) {
  bus::SimulatedNetwork network(1);
  Candidate alone(network, 5);
  const std::vector<bus::Endpoint*> endpoints{&alone.endpoint};
  ASSERT_TRUE(network.Run(
      endpoints, [&] { return alone.candidacy.over(); }, 1s));
  EXPECT_EQ(alone.candidacy.other(), "");
}

TEST(SoleServer, OfCandidatesTheSmallestInstanceGoesOn) {
  constexpr std::uint64_t kHistories = 100;
  for (std::uint64_t seed = 1; seed <= kHistories; ++seed) {
    bus::FaultModel delays;
    delays.max_delay = 20ms;
    delays.duplicate = delays.reorder = 0.1;
    bus::SimulatedNetwork network(seed, delays);
    std::vector<std::unique_ptr<Candidate>> candidates;
    std::vector<bus::Endpoint*> endpoints;
    for (const std::int64_t instance : {30, 10, 20}) {
      candidates.push_back(std::make_unique<Candidate>(network, instance));
      endpoints.push_back(&candidates.back()->endpoint);
      network.Run(
          endpoints, [] { return false; }, microseconds(static_cast<int>(seed % 7) * 30'000));
    }
    const auto over = [&] {
      for (const auto& candidate : candidates) {
        if (!candidate->candidacy.over()) return false;
      }
      return true;
    };
    ASSERT_TRUE(network.Run(endpoints, over, 2s));
    EXPECT_NE(candidates[0]->candidacy.other(), "") << seed;
    EXPECT_EQ(candidates[1]->candidacy.other(), "") << seed;
    EXPECT_NE(candidates[2]->candidacy.other(), "") << seed;
  }
}

TEST(SoleServer, AServerThatServesComesBeforeASmallerCandidate) {
  bus::SimulatedNetwork network(1);
  Serving serving(network, 20);
  Candidate candidate(network, 10);
  const std::vector<bus::Endpoint*> endpoints{&serving.endpoint, &candidate.endpoint};
  ASSERT_TRUE(network.Run(
      endpoints, [&] { return candidate.candidacy.over(); }, 1s));
  EXPECT_EQ(candidate.candidacy.other(), "process 20 on host with database /db");
}

TEST(SoleServer, OfTwoThatServeTheLargerInstanceFindsOutAndTheOtherStays) {
  bus::SimulatedNetwork network(3, bus::FaultModel::StandardChaos());
  Serving small(network, 10), large(network, 20);
  const std::vector<bus::Endpoint*> endpoints{&small.endpoint, &large.endpoint};
  const auto look = [&](const std::function<bool()>& until) {
    for (int i = 0; i < 600 && !until(); ++i) {
      small.watch.Look();
      large.watch.Look();
      network.Run(
          endpoints, [] { return false; }, 100ms);
    }
  };
  network.SetPartition(large.transport, 1);
  look([&] { return network.now() > 20s; });
  EXPECT_EQ(large.watch.rival(), "") << "they do not hear each other";
  network.SetPartition(large.transport, 0);
  look([&] { return !large.watch.rival().empty(); });
  EXPECT_EQ(large.watch.rival(), "process 10 on host with database /db");
  look([&] { return network.now() > 60s; });
  EXPECT_EQ(small.watch.rival(), "");
}

}  // namespace
}  // namespace legopt::server
