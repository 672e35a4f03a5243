#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "bus/endpoint.h"
#include "tests/simulation/process.h"
#include "tests/simulation/record.h"
#include "worker/pool.h"
#include "worker/server_link.h"

namespace legopt::simulation {

/// Behaviour of the jobs of a simulated worker.
struct JobBehaviour {
  microseconds shortest{5'000};
  microseconds longest{1'500'000};
  double misbehaves = 0.05;      ///< fraction of jobs that crash, hang, report an error or break the protocol
  double large = 0.1;            ///< fraction of results that need several chunks
  double deaf = 0.2;             ///< fraction of jobs that ignore cancellation
  double stopped = 0.1;          ///< fraction of results whose solve was stopped by the wall-time limit, half of them
                                 ///< solved
  std::int64_t crash_every = 8;  ///< one job id in this many crashes its process each time; 0: none
};

/// State of the external solver on a worker.
enum class DeclaredSolver {
  kNone,     ///< not declared
  kOther,    ///< declared, with different files
  kChanged,  ///< declared as required by the jobs, but its files have changed since: such jobs are refused
  kRight     ///< declared, with the files that the jobs require
};

/// Returns whether the job crashes every process that runs it.
bool AlwaysCrashes(const JobBehaviour& manners, std::int64_t job_id);

/// Returns the cost that a finished attempt reports, which identifies the attempt of a stored result.
double CostOf(std::int64_t job_id, int attempt);

/// The real Pool with its calls on a bus endpoint and simulated job processes, as a process that can die.
class SimulatedWorker final : public Process {
 public:
  /// All arguments must outlive it. `number` identifies the worker.
  SimulatedWorker(World& world, Record& record, std::uint64_t number, int slots, JobBehaviour manners,
                  DeclaredSolver solver = DeclaredSolver::kRight);
  ~SimulatedWorker() override;

  /// Sends SIGTERM, as a user does; the worker starts again some time after its end.
  void Stop();
  const worker::Pool* pool() const { return pool_.get(); }
  std::uint64_t life_id() const;

 private:
  class ObservedLink;
  // A job process.
  struct Child {
    std::uint64_t generation = 0;  // events of an earlier process of the slot are ignored
    bool up = false;
    std::uint64_t sequence = 0;  // sequence number of its job, 0: none
    std::int64_t job_id = 0;
    int attempt = 0;
  };

  bool Start() override;
  void Turn() override;
  microseconds next_turn() const override;
  void DestroyObjects() override;
  void OnPause() override { record_.ExcusePausedWorker(life_id()); }

  void CarryOutActions();
  void CarryOut(const worker::StartChild& action);
  void CarryOut(const worker::AssignJob& action);
  void CarryOut(const worker::CancelJob& action);
  void CarryOut(const worker::KillChild& action);
  void CarryOut(const worker::LogLine&) {}
  void CarryOut(const worker::ExitWorker&) { exiting_ = true; }
  template <class Call>
  void CarryOut(const Call& action) {
    calls_->CarryOut(action);
  }
  std::vector<worker::Capability> Capabilities() const;
  void Misbehave(int slot);
  void Finish(int slot, legopt_msg::result_request result);
  void ChildExits(int slot, int signal, int exit_code);
  /// Runs `event` later unless that job process has ended by then.
  void Later(int slot, microseconds after, std::function<void()> event);
  /// Runs `event` later unless the process has ended or has another job by then.
  void LaterInJob(int slot, microseconds after, std::function<void()> event);
  legopt_msg::result_request ResultOf(const Child& process);
  Child& child(int slot) { return children_[static_cast<std::size_t>(slot)]; }

  Record& record_;
  std::uint64_t number_;
  int slots_;
  JobBehaviour job_behaviour_;
  DeclaredSolver solver_;
  std::unique_ptr<bus::Endpoint> endpoint_;
  std::unique_ptr<ObservedLink> link_;
  std::unique_ptr<worker::Pool> pool_;
  std::unique_ptr<worker::PoolCalls> calls_;
  std::vector<Child> children_;
  std::vector<std::function<void()>> arrived_;  // events from job processes
  bool exiting_ = false;
};

}  // namespace legopt::simulation
