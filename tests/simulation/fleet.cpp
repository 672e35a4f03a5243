#include "tests/simulation/fleet.h"

#include <algorithm>
#include <array>
#include <ctime>
#include <nlohmann/json.hpp>
#include <numeric>
#include <string>

#include "bus/codec.h"
#include "bus/message_key.h"
#include "legopt/types/reply.h"
#include "tests/simulation/experiment_text.h"

namespace legopt::simulation {
namespace {

constexpr bus::EndpointId kClient = 77;
constexpr std::uint64_t kSeed = 1;
constexpr int kMaxProblems = 1000;
constexpr double kFleetWallLimit_s = 60;
constexpr std::int64_t kLooks = 100;

std::chrono::nanoseconds ThreadCpu() {
  timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return std::chrono::seconds(time.tv_sec) + std::chrono::nanoseconds(time.tv_nsec);
}

// Few problems with many repetitions, as a client would request this number of jobs.
std::string SpecOf(const std::string& name, std::int64_t jobs) {
  std::int64_t problems = std::min<std::int64_t>(jobs, kMaxProblems);
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

std::shared_ptr<const bus::MessageKey> FleetKey() {
  constexpr std::array<std::uint8_t, bus::MessageKey::kBytes> kBytes{1, 2, 3};
  return std::make_shared<const bus::MessageKey>(kBytes);
}

bus::FaultModel NetworkOf(const FleetOptions& options) {
  bus::FaultModel network;
  network.min_delay = network.max_delay = options.network_delay;
  network.receive_buffer = options.receive_buffer;
  return network;
}

}  // namespace

Fleet::Fleet(const FleetOptions& options, db::Store& store)
    : options_(options),
      store_(store),
      key_(options.keyed ? FleetKey() : nullptr),
      network_(kSeed, NetworkOf(options)),
      client_transport_(network_, kFleetDeployment, key_),
      client_(client_transport_, kClient, kSeed) {
  network_.SetFiltered();
  StartServer();
  for (int i = 0; i < options.workers; ++i) {
    workers_.push_back(std::make_unique<FleetWorker>(network_, key_, i, options.slots, options.job_time));
  }
}

void Fleet::StartServer() {
  ++lives_;
  server_transport_.emplace(network_, kFleetDeployment, key_);
  if (options_.time_per_datagram > microseconds(0)) {
    server_transport_->LimitPolls(static_cast<std::size_t>(kFleetTurn / options_.time_per_datagram));
  }
  server_endpoint_.emplace(*server_transport_, bus::kServer, static_cast<std::uint64_t>(lives_));
  server_ = std::make_unique<server::Server>(
      *server_endpoint_, store_, nullptr, ServerOptionsOf(lives_), [this] { return network_.now().count(); },
      [this] { return ++tokens_; });
}

void Fleet::StopServer() {
  server_.reset();
  server_endpoint_.reset();
  server_transport_.reset();
}

bool Fleet::AllRegistered() const {
  const std::vector<server::WorkerStatus> known = scheduler().workers();
  return std::ssize(known) == options_.workers &&
         std::all_of(known.begin(), known.end(), [](const server::WorkerStatus& worker) { return worker.online; });
}

bool Fleet::RunUntilRegistered(microseconds limit) {
  constexpr microseconds kLookEvery{50'000};
  for (const microseconds end = network_.now() + limit; network_.now() < end && !AllRegistered();) RunFor(kLookEvery);
  return AllRegistered();
}

void Fleet::RunFor(microseconds duration) {
  for (const microseconds end = network_.now() + duration; network_.now() < end;) Step();
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

// Runs only if there is something to do: a real server sleeps otherwise.
void Fleet::ServerTurn() {
  if (server_ == nullptr) return;
  const microseconds now = network_.now();
  const auto arrival = server_transport_->next_arrival();
  const auto timer = server_endpoint_->next_timer();
  const bool due =
      (arrival && *arrival <= now) || (timer && *timer <= now) || server_->WaitTime(2 * kFleetTurn) == microseconds(0);
  if (!due) return;
  const std::chrono::nanoseconds before = ThreadCpu();
  server_endpoint_->Poll(microseconds(0));
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
