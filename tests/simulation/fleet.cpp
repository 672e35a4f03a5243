#include "tests/simulation/fleet.h"

#include <algorithm>
#include <ctime>
#include <nlohmann/json.hpp>
#include <numeric>
#include <string>

#include "bus/codec.h"
#include "tests/simulation/experiment_text.h"
#include "words/reply.h"

namespace legopt::simulation {
namespace {

constexpr bus::EndpointId kClient = 77;
constexpr std::uint64_t kSeed = 1;
constexpr int kMostProblems = 1000;
constexpr double kFleetWallLimit_s = 60;
constexpr std::int64_t kLooks = 100;

std::chrono::nanoseconds ThreadCpu() {
  timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return std::chrono::seconds(time.tv_sec) + std::chrono::nanoseconds(time.tv_nsec);
}

// Few problems with many repetitions, as a client would ask for so many jobs.
std::string SpecOf(const std::string& name, std::int64_t jobs) {
  std::int64_t problems = std::min<std::int64_t>(jobs, kMostProblems);
  while (jobs % problems != 0) --problems;
  auto spec = nlohmann::json::parse(ExperimentText(name, static_cast<int>(problems), kFleetWallLimit_s, false, true));
  spec["repetitions"] = jobs / problems;
  return spec.dump();
}

server::ServerOptions ServerOptionsOf(std::int64_t instance) {
  server::ServerOptions options;
  options.scheduler.server_instance = instance;
  options.version = "simulated";
  options.pid = 1;
  return options;
}

}  // namespace

Fleet::Fleet(const FleetOptions& options, db::Store& store)
    : options_(options),
      network_(kSeed,
               [&] {
                 bus::Misfortune none;
                 none.min_delay = none.max_delay = options.network_delay;
                 return none;
               }()),
      server_transport_(network_),
      server_endpoint_(server_transport_, bus::kServer, kSeed),
      server_(std::make_unique<server::Server>(
          server_endpoint_, store, nullptr, ServerOptionsOf(1), [this] { return network_.now().count(); },
          [this] { return ++tokens_; })),
      client_transport_(network_),
      client_(client_transport_, kClient, kSeed) {
  network_.SetFiltered();
  for (int i = 0; i < options.workers; ++i) {
    workers_.push_back(std::make_unique<FleetWorker>(network_, i, options.slots, options.job_time));
  }
}

void Fleet::Submit() {
  for (int i = 0; i < options_.experiments; ++i) {
    legopt_msg::submit_request request{};
    request.submission_id = "submission " + std::to_string(i);
    request.spec_json = SpecOf("e" + std::to_string(i), options_.jobs / options_.experiments);
    spec_bytes_ = request.spec_json.size();
    bus::CallOptions patient;
    patient.timeout = std::chrono::minutes(1);
    client_.Call(
        bus::kServer, bus::MessageType::kSubmit, bus::Encode(request), patient, [this](bus::CallResult&& result) {
          const auto reply = bus::Decode<legopt_msg::submit_reply>(result.body);
          accepted_ +=
              result.status == bus::CallResult::kOk && reply && ResultStatus{reply->status} == ResultStatus::kAccepted
                  ? 1
                  : 0;
        });
  }
}

bool Fleet::Run(const std::function<void()>& look) {
  const microseconds end = network_.now() + options_.longest_time;
  Submit();
  while (accepted_ < options_.experiments && network_.now() < end) Step();
  accepted_at_ = network_.now();
  server_cpu_ = {};
  const std::int64_t stride = std::max<std::int64_t>(1, options_.jobs / kLooks);
  for (std::int64_t next = stride; jobs_done() < options_.jobs && network_.now() < end;) {
    Step();
    if (jobs_done() < next) continue;
    look();
    next += stride;
  }
  return jobs_done() == options_.jobs;
}

void Fleet::Step() {
  ServerTurn();
  client_.Poll(microseconds(0));
  const microseconds now = network_.now();
  for (const auto& worker : workers_) {
    if (worker->due(now)) worker->Turn(now);
  }
  network_.Advance(kFleetTurn);
}

// Only turns in which there is something to do: a real server sleeps through the others.
void Fleet::ServerTurn() {
  const microseconds now = network_.now();
  const auto arrival = server_transport_.next_arrival();
  const auto timer = server_endpoint_.next_timer();
  const bool due =
      (arrival && *arrival <= now) || (timer && *timer <= now) || server_->WaitTime(2 * kFleetTurn) == microseconds(0);
  if (!due) return;
  const std::chrono::nanoseconds before = ThreadCpu();
  server_endpoint_.Poll(microseconds(0));
  server_->Work();
  server_cpu_ += ThreadCpu() - before;
}

std::int64_t Fleet::jobs_done() const {
  const auto done = [](std::int64_t sum, const auto& entry) {
    return sum + entry.second.jobs_by_state[db::JobState::kDone];
  };
  const auto& experiments = scheduler().experiments();
  return std::accumulate(experiments.begin(), experiments.end(), std::int64_t{0}, done);
}

double Fleet::busy_share() const {
  microseconds busy{0};
  for (const auto& worker : workers_) busy += worker->busy();
  const double slots = static_cast<double>(options_.workers) * options_.slots;
  return static_cast<double>(busy.count()) / (slots * static_cast<double>(elapsed().count()));
}

}  // namespace legopt::simulation
