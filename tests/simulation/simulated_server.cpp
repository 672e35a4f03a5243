#include "tests/simulation/simulated_server.h"

#include <numeric>

namespace legopt::simulation {
namespace {

constexpr microseconds kAccountsEvery{400'000};

}  // namespace

server::SchedulerOptions QuickTimes() {
  server::SchedulerOptions options;
  options.lease = microseconds(3'000'000);
  options.grace = microseconds(500'000);
  options.heartbeat = microseconds(200'000);
  options.retention = microseconds(6'000'000);
  return options;
}

SimulatedServer::SimulatedServer(World& world, Disk& disk, Record& record, server::SchedulerOptions options)
    : Process(world), disk_(disk), record_(record), options_(options) {}

SimulatedServer::~SimulatedServer() { DestroyObjects(); }

bool SimulatedServer::Start() {
  try {
    store_ = std::make_unique<FaultyStore>(
        disk_.Open(), life(), faults_,
        [this](std::span<const db::StoreOp> operations) { record_.OnCommit(operations); });
    endpoint_ = std::make_unique<bus::Endpoint>(transport(), bus::kServer, world().Draw());
    server::ServerOptions options;
    options.scheduler = options_;
    options.scheduler.server_instance = static_cast<std::int64_t>(world().Draw() >> 1U) | 1;
    options.version = "simulated";
    options.pid = 1;
    server_ = std::make_unique<server::Server>(
        *endpoint_, *store_, nullptr, options, [this] { return wall_clock_us_ + world().now().count(); },
        [this] { return static_cast<std::int64_t>(world().Draw() >> 1U) | 1; });
  } catch (const db::StoreError& error) {
    if (!error.transient()) record_.Violation(std::string("wrong state: the server cannot start: ") + error.what());
    DestroyObjects();
    return false;
  }
  return true;
}

void SimulatedServer::DestroyObjects() {
  server_.reset();
  endpoint_.reset();
  store_.reset();
  disk_.Close();
}

microseconds SimulatedServer::next_turn() const {
  constexpr microseconds kLongestWait{1'000'000};
  const microseconds wait = server_->WaitTime(kLongestWait);
  return std::min(world().now() + wait, endpoint_->next_timer().value_or(microseconds::max()));
}

void SimulatedServer::Turn() {
  try {
    endpoint_->Poll(microseconds(0));
    if (life().alive()) server_->Work();
  } catch (const db::StoreError& error) {
    // Only transient errors are allowed, and the server handles these itself.
    record_.Violation(std::string("wrong state: the store refuses an operation of the server: ") + error.what());
    Kill(microseconds(1'000'000));
    return;
  }
  if (!life().alive()) return;
  if (endpoint_->counters().handler_failures > 0) record_.Violation("wrong state: a handler of the server failed");
  CheckAccounts();
}

// Checks that every job is in one state, and that the server's state agrees with the disk.
void SimulatedServer::CheckAccounts() {
  if (world().now() < next_accounts_ || !server_->settled() || faults_.reads) return;
  next_accounts_ = world().now() + kAccountsEvery;
  const auto& known = server_->scheduler().experiments();
  const db::OpenState state = store_->LoadOpenState();
  if (state.experiments.size() != known.size()) record_.Violation("wrong state: the server knows other experiments");
  for (const db::ExperimentSummary& stored : state.experiments) {
    const auto found = known.find(stored.experiment_id);
    if (found == known.end()) continue;
    const auto total =
        std::accumulate(std::begin(stored.jobs_by_state), std::end(stored.jobs_by_state), std::int64_t{0});
    const bool equal = stored.jobs_by_state == found->second.jobs_by_state;
    if (total != stored.num_jobs || !equal || found->second.solved != stored.solved ||
        found->second.state != stored.state) {
      record_.Violation("wrong state: the accounts of experiment " + std::to_string(stored.experiment_id) +
                        " do not agree");
    }
  }
}

}  // namespace legopt::simulation
