#include "tests/figures/lease_prober.h"

#include <unistd.h>

#include <optional>
#include <stdexcept>
#include <string>

#include "bus/typed_calls.h"
#include "legopt/types/check.h"
#include "legopt/types/reply.h"
#include "legopt/types/result.h"
#include "tests/figures/findings.h"

namespace legopt::figures {
namespace {

using std::chrono::milliseconds;

const std::string kDatasetHash(64, 'd');

bus::LcmOptions Network(int port) {
  bus::LcmOptions network;
  network.port = port;
  return network;
}

}  // namespace

LeaseProber::LeaseProber(int port)
    : transport_(Network(port)), endpoint_(transport_, bus::RandomEndpointId(), bus::RandomSeed()) {
  legopt_msg::hello_request hello{};
  hello.protocol_version = bus::kProtocolVersion;
  hello.build_id = "prober";
  hello.processors = 1;
  hello.worker_name = "prober";
  hello.pid = getpid();
  hello.slots = 1;
  legopt_msg::capability dataset;
  dataset.kind = "dataset";
  dataset.name = "stub";
  dataset.hash = kDatasetHash;
  hello.capabilities = {dataset};
  bool answered = false;
  registration_ = Ask(hello, &answered);
  if (!answered || HelloStatus{registration_.status} != HelloStatus::kOk)
    throw std::runtime_error("no server takes the prober");
}

template <class Message>
typename bus::CallOf<Message>::Reply LeaseProber::Ask(const Message& message, bool* answered) {
  using Outcome = bus::CallOutcome<typename bus::CallOf<Message>::Reply>;
  std::optional<Outcome> outcome;
  bus::CallMessage(endpoint_, bus::kServer, message, {}, [&](Outcome&& reply) { outcome = std::move(reply); });
  while (!outcome) endpoint_.Poll(milliseconds(20));
  *answered = outcome->ok();
  return outcome->reply;
}

void LeaseProber::Report(const legopt_msg::lease& lease) {
  legopt_msg::result_request result{};
  result.worker_id = registration_.worker_id;
  result.job_id = lease.job_id;
  result.attempt = lease.attempt;
  result.token = lease.token;
  result.solver_status = ToString(SolveStatus::kConvergedFeasible);
  result.verdict_literal = result.verdict_strict = result.verdict_solid = result.verdict_physical =
      ToString(Verdict::kSuccess);
  result.failed_waypoint = -1;
  result.wall_us = 1000;
  result.cost = 1;
  result.num_waypoints = 1;
  result.waypoint_size = 36;
  result.waypoints.assign(36, 0.25);
  bool answered = false;
  Ask(result, &answered);
}

void LeaseProber::Run(const std::atomic<bool>& stop) {
  constexpr milliseconds kPause(20);
  legopt_msg::lease_request request{};
  request.worker_id = registration_.worker_id;
  request.server_instance = registration_.server_instance;
  request.max_jobs = 1;
  while (!stop) {
    bool answered = false;
    const auto asked = Clock::now();
    const legopt_msg::lease_reply reply = Ask(request, &answered);
    if (answered) {
      latencies_ms_.push_back(SecondsSince(asked) * 1000);
    } else {
      ++timeouts_;
    }
    for (const legopt_msg::lease& lease : reply.jobs) Report(lease);
    endpoint_.Poll(kPause);
  }
}

}  // namespace legopt::figures
