#include "tests/simulation/simulated_worker.h"

#include <csignal>
#include <utility>

#include "bus/codec.h"
#include "tests/simulation/experiment_text.h"
#include "worker/job_executor.h"

namespace legopt::simulation {
namespace {

constexpr microseconds kRestart{400'000};
constexpr std::uint64_t kLivesPerWorker = 100'000;

}  // namespace

bool AlwaysCrashes(const JobBehaviour& manners, std::int64_t job_id) {
  constexpr std::int64_t kWhich = 3;
  return manners.crash_every > 0 && job_id % manners.crash_every == kWhich % manners.crash_every;
}

double CostOf(std::int64_t job_id, int attempt) { return static_cast<double>(job_id) + attempt / 128.0; }

/// The program's link, with a record of leases, sent messages and answers.
class SimulatedWorker::ObservedLink final : public worker::ServerLink {
 public:
  ObservedLink(bus::Endpoint& endpoint, Record& record, DeclaredSolver solver)
      : link_(endpoint), record_(record), solver_(solver) {}

  microseconds now() const override { return link_.now(); }
  void Call(bus::MessageType type, std::string body, microseconds timeout,
            std::function<void(bus::CallResult&&)> callback) override {
    if (type == bus::MessageType::kResult) {
      const auto request = bus::Decode<legopt_msg::result_request>(body).value();
      record_.OnReport(request);
      callback = [this, request, callback = std::move(callback)](bus::CallResult&& result) {
        if (result.status == bus::CallResult::kOk) {
          record_.OnAnswer(request, ResultStatus{bus::Decode<legopt_msg::result_reply>(result.body).value().status});
        }
        callback(std::move(result));
      };
    } else if (type == bus::MessageType::kLease) {
      callback = [this, callback = std::move(callback)](bus::CallResult&& result) {
        if (result.status == bus::CallResult::kOk) {
          const auto reply = bus::Decode<legopt_msg::lease_reply>(result.body).value();
          for (const auto& lease : reply.jobs) {
            record_.OnLease(lease);
            CheckSolver(lease);
          }
        }
        callback(std::move(result));
      };
    }
    link_.Call(type, std::move(body), timeout, std::move(callback));
  }
  void Wait(std::span<pollfd> extra, microseconds max_wait) override { link_.Wait(extra, max_wait); }

 private:
  void CheckSolver(const legopt_msg::lease& lease) {
    const bool announced = solver_ == DeclaredSolver::kRight || solver_ == DeclaredSolver::kChanged;
    if (announced || lease.method_hash != std::string(64, kExternalMethodDigit)) return;
    record_.Violation("wrong state: job " + std::to_string(lease.job_id) +
                      " was leased to a worker without its solver");
  }

  worker::EndpointLink link_;
  Record& record_;
  DeclaredSolver solver_;
};

SimulatedWorker::SimulatedWorker(World& world, Record& record, std::uint64_t number, int slots, JobBehaviour manners,
                                 DeclaredSolver solver)
    : Process(world), record_(record), number_(number), slots_(slots), job_behaviour_(manners), solver_(solver) {}

SimulatedWorker::~SimulatedWorker() { DestroyObjects(); }

std::uint64_t SimulatedWorker::life_id() const { return number_ * kLivesPerWorker + lives(); }

// --- The process -----------------------------------------------------------------------------------------------------

bool SimulatedWorker::Start() {
  constexpr std::int64_t kFirstAddress = std::int64_t{1} << 32U;
  const auto address = kFirstAddress + static_cast<std::int64_t>(world().Draw() >> 2U);
  endpoint_ = std::make_unique<bus::Endpoint>(transport(), address, world().Draw());
  link_ = std::make_unique<ObservedLink>(*endpoint_, record_, solver_);
  worker::PoolOptions options;
  options.slots = slots_;
  options.name = "worker " + std::to_string(number_);
  options.pid = 1;
  options.protocol_version = bus::kProtocolVersion;
  options.build_id = "simulated";
  options.seed = world().Draw();
  pool_ = std::make_unique<worker::Pool>(options, world().now());
  calls_ = std::make_unique<worker::PoolCalls>(*link_, *pool_);
  children_.assign(static_cast<std::size_t>(slots_), {});
  exiting_ = false;
  return true;
}

// Job processes die with their supervisor.
void SimulatedWorker::DestroyObjects() {
  for (const Child& process : children_) {
    if (process.sequence != 0) record_.OnRunEnded(life_id(), process.job_id);
  }
  children_.clear();
  arrived_.clear();
  calls_.reset();
  pool_.reset();
  link_.reset();
  endpoint_.reset();
}

microseconds SimulatedWorker::next_turn() const {
  if (!arrived_.empty()) return world().now();
  return std::min(pool_->next_deadline(), endpoint_->next_timer().value_or(microseconds::max()));
}

void SimulatedWorker::Turn() {
  link_->Wait({}, microseconds(0));
  for (auto& event : std::exchange(arrived_, {})) event();
  pool_->Tick(world().now());
  CarryOutActions();
  if (exiting_) Exit(kRestart);
}

void SimulatedWorker::Stop() {
  if (!up() || paused()) return;
  pool_->Stop(world().now());
  CarryOutActions();
}

void SimulatedWorker::CarryOutActions() {
  for (auto actions = pool_->TakeActions(); !actions.empty(); actions = pool_->TakeActions()) {
    for (const worker::Action& action : actions) {
      std::visit([this](const auto& specific) { CarryOut(specific); }, action);
    }
  }
}

// --- Job processes ---------------------------------------------------------------------------------------------------

void SimulatedWorker::Later(int slot, microseconds after, std::function<void()> event) {
  const std::uint64_t life = life_id();
  const std::uint64_t generation = child(slot).generation;
  world().After(after, [this, slot, life, generation, event = std::move(event)] {
    if (!up() || life_id() != life || child(slot).generation != generation) return;
    arrived_.push_back([this, slot, generation, event] {
      if (child(slot).generation == generation) event();
    });
  });
}

void SimulatedWorker::LaterInJob(int slot, microseconds after, std::function<void()> event) {
  Later(slot, after, [this, slot, sequence = child(slot).sequence, event = std::move(event)] {
    if (child(slot).sequence == sequence) event();
  });
}

void SimulatedWorker::CarryOut(const worker::StartChild& action) {
  Child& process = child(action.slot);
  const std::uint64_t generation = process.generation + 1;
  process = Child{};
  process.generation = generation;
  process.up = true;
  Later(action.slot, world().Within(microseconds(5'000), microseconds(60'000)),
        [this, slot = action.slot] { pool_->OnChildReady(world().now(), slot, Capabilities()); });
}

std::vector<worker::Capability> SimulatedWorker::Capabilities() const {
  std::vector<worker::Capability> capabilities = {{"garage", std::string(64, 'd')}};
  if (solver_ != DeclaredSolver::kNone) {
    const char digit = solver_ == DeclaredSolver::kOther ? 'f' : kSolverDigit;
    capabilities.push_back({kExternalSolver, std::string(64, digit), CapabilityKind::kSolver});
  }
  return capabilities;
}

void SimulatedWorker::CarryOut(const worker::AssignJob& action) {
  Child& process = child(action.slot);
  process.sequence = action.sequence;
  process.job_id = action.lease.job_id;
  process.attempt = action.lease.attempt;
  record_.OnRun(life_id(), process.job_id);
  if (solver_ == DeclaredSolver::kChanged && action.lease.method_hash == std::string(64, kExternalMethodDigit)) {
    return LaterInJob(action.slot, microseconds(1'000), [this, slot = action.slot] {
      Finish(slot, worker::ResultWithoutSolution(ReportedOutcome::kRefused, "a file of the solver has changed"));
    });
  }
  if (AlwaysCrashes(job_behaviour_, process.job_id) || world().Chance(job_behaviour_.misbehaves))
    return Misbehave(action.slot);
  LaterInJob(action.slot, world().Within(job_behaviour_.shortest, job_behaviour_.longest),
             [this, slot = action.slot] { Finish(slot, ResultOf(child(slot))); });
}

void SimulatedWorker::Misbehave(int slot) {
  const microseconds after = world().Within(microseconds(1'000), job_behaviour_.longest / 4);
  const std::uint64_t how = AlwaysCrashes(job_behaviour_, child(slot).job_id) ? 0 : world().Below(5);
  LaterInJob(slot, after, [this, slot, how] {
    constexpr int kOutOfMemory = worker::kChildOutOfMemory;
    switch (how) {
      case 0:
        return ChildExits(slot, SIGSEGV, 0);
      case 1:
        return ChildExits(slot, 0, kOutOfMemory);
      case 2:
        return Finish(slot, worker::ResultWithoutSolution(ReportedOutcome::kError, "no such problem"));
      case 3:
        return pool_->OnChildGarbage(world().now(), slot, "noise");
      default:
        return;  // hangs until its wall-time limit
    }
  });
}

legopt_msg::result_request SimulatedWorker::ResultOf(const Child& process) {
  legopt_msg::result_request result = worker::ResultWithoutSolution(ReportedOutcome::kFinished, "");
  result.solver_status = "converged_feasible";
  result.wall_us = 1000;
  result.verdict_literal = "success";
  result.verdict_strict = "success";
  result.verdict_solid = result.verdict_physical = "success";
  if (world().Chance(job_behaviour_.stopped)) {
    result.solver_status = "time_limit";
    if (world().Chance(0.5))
      result.verdict_literal = result.verdict_strict = result.verdict_solid = result.verdict_physical = "com";
  }
  result.cost = CostOf(process.job_id, process.attempt);
  result.waypoint_size = 36;
  constexpr std::uint64_t kMostRows = 20;
  result.num_waypoints = world().Chance(job_behaviour_.large) ? 1 + static_cast<int>(world().Below(kMostRows)) : 1;
  result.num_values = result.num_waypoints * result.waypoint_size;
  result.waypoints.assign(static_cast<std::size_t>(result.num_values), result.cost);
  return result;
}

void SimulatedWorker::Finish(int slot, legopt_msg::result_request result) {
  Child& process = child(slot);
  record_.OnRunEnded(life_id(), process.job_id);
  pool_->OnChildResult(world().now(), slot, std::exchange(process.sequence, 0), std::move(result));
}

void SimulatedWorker::ChildExits(int slot, int signal, int exit_code) {
  Child& process = child(slot);
  if (process.sequence != 0) record_.OnRunEnded(life_id(), process.job_id);
  process.sequence = 0;
  process.up = false;
  ++process.generation;
  pool_->OnChildExited(world().now(), slot, {signal, exit_code, "last words", 1 << 20U});
}

void SimulatedWorker::CarryOut(const worker::CancelJob& action) {
  if (child(action.slot).sequence == 0 || world().Chance(job_behaviour_.deaf)) return;
  LaterInJob(action.slot, world().Within(microseconds(1'000), microseconds(100'000)), [this, slot = action.slot] {
    Finish(slot, worker::ResultWithoutSolution(ReportedOutcome::kCancelled, "cancelled"));
  });
}

void SimulatedWorker::CarryOut(const worker::KillChild& action) {
  if (!child(action.slot).up) return;
  Later(action.slot, world().Within(microseconds(500), microseconds(5'000)),
        [this, slot = action.slot] { ChildExits(slot, SIGKILL, 0); });
}

}  // namespace legopt::simulation
