#include "tests/simulation/history.h"

#include <memory>

#include "tests/simulation/checker.h"
#include "tests/simulation/experiment_text.h"
#include "tests/simulation/nemesis.h"

namespace legopt::simulation {
namespace {

constexpr microseconds kChaosEnds{25'000'000};
constexpr microseconds kGiveUp{300'000'000};
constexpr microseconds kRestCheck{100'000};
constexpr std::uint64_t kSqliteEvery = 4;
constexpr double kWallLimit_s = 8;
constexpr microseconds kShortJobs{300'000};
constexpr microseconds kQuickJobs{30'000};  // prefetched by the dozen
constexpr int kManyJobs = 60;
constexpr microseconds kLongJobs{6'000'000};  // two leases

class History {
 public:
  explicit History(std::uint64_t seed)
      : world_(seed),
        disk_(MakeDisk(seed)),
        server_(world_, *disk_, record_, QuickTimes()),
        nemesis_(world_, {server_, workers_, clients_}) {
    if (world_.Chance(0.3)) job_behaviour_.longest = kShortJobs;
    if (world_.Chance(0.4)) job_behaviour_.longest = kLongJobs;
    if (world_.Chance(0.2)) job_behaviour_.longest = kQuickJobs;
    const std::uint64_t num_workers = 2 + world_.Below(3);
    for (std::uint64_t i = 0; i < num_workers; ++i) {
      const int slots = 1 + static_cast<int>(world_.Below(2));
      // One worker has the external solver, so that every job can end.
      const auto solver = i == 0 ? DeclaredSolver::kRight : static_cast<DeclaredSolver>(world_.Below(4));
      workers_.push_back(std::make_unique<SimulatedWorker>(world_, record_, i + 1, slots, job_behaviour_, solver));
    }
    for (int i = 0; i < 2; ++i) clients_.push_back(std::make_unique<SimulatedClient>(world_, record_, server_));
  }

  HistoryOutcome Play() {
    PlanExperiments();
    world_.At(world_.Within(microseconds(0), microseconds(3'000'000)), [this] { nemesis_.Strike(kChaosEnds); });
    HistoryOutcome outcome;
    if (!world_.Run([this] { return AtRest(); }, kGiveUp)) record_.Violation("lost: not all jobs end");
    const StoredState state = disk_->Read();
    outcome.faults = FaultsOf(record_, state, job_behaviour_);
    if (const std::string faults = disk_->Examine(); !faults.empty())
      outcome.faults.push_back("wrong state: " + faults);
    outcome.transcript = world_.transcript();
    outcome.datagrams = world_.datagrams();
    outcome.jobs = static_cast<std::int64_t>(state.jobs.size());
    outcome.attempts = static_cast<std::int64_t>(state.attempts.size());
    outcome.stale = static_cast<std::int64_t>(state.stale.size());
    outcome.server_lives = server_.lives();
    return outcome;
  }

 private:
  static std::unique_ptr<Disk> MakeDisk(std::uint64_t seed) {
    if (seed % kSqliteEvery == 0) return std::make_unique<SqliteDisk>();
    return std::make_unique<MemoryDisk>();
  }

  void PlanExperiments() {
    const std::uint64_t num_experiments = 1 + world_.Below(4);
    for (std::uint64_t i = 0; i < num_experiments; ++i) {
      const std::string id = "submission " + std::to_string(i);
      const int more = job_behaviour_.longest == kQuickJobs ? kManyJobs : 0;
      const int num_jobs = 3 + more + static_cast<int>(world_.Below(22));
      const std::string text = ExperimentText("e" + std::to_string(i), num_jobs, kWallLimit_s, world_.Chance(0.5),
                                              i % 3 == 2, world_.Chance(0.3));
      world_.At(world_.Within(microseconds(0), microseconds(10'000'000)), [this, id, text, num_jobs] {
        // Sometimes two clients submit the same experiment.
        for (auto& client : clients_) {
          if (world_.Chance(0.6) || client == clients_.front()) client->Submit(id, text, num_jobs);
        }
      });
      if (world_.Chance(0.25)) {
        world_.At(world_.Within(microseconds(10'000'000), microseconds(20'000'000)),
                  [this, id] { clients_.back()->Cancel(id); });
      }
    }
    planned_ = num_experiments;
    PlanOperatorCommands();
  }

  // One client sends all commands: other clients have no record of the experiments it has stopped.
  void PlanOperatorCommands() {
    constexpr double kRetried = 0.3, kTimeLimited = 0.6;
    SimulatedClient& user = *clients_.back();
    for (std::uint64_t i = 0; i < planned_; ++i) {
      const std::string id = "submission " + std::to_string(i);
      const auto decide = [&](double probability, std::function<void()> action) {
        if (!world_.Chance(probability)) return;
        world_.At(world_.Within(microseconds(8'000'000), microseconds(24'000'000)), std::move(action));
      };
      const bool now = world_.Chance(0.5);
      const microseconds duration = world_.Within(microseconds(500'000), microseconds(8'000'000));
      decide(0.25, [&user, id, now, duration] { user.StopAndResume(id, now, duration); });
      const bool time_limited = world_.Chance(kTimeLimited);
      decide(kRetried, [&user, id, time_limited] { user.Retry(id, time_limited); });
      decide(0.15, [&user, id] { user.Label(id, "labelled " + id); });
      decide(0.15, [&user, id] { user.Delete(id); });
      decide(0.2, [&user, id, priority = 1 + static_cast<int>(i)] { user.RaisePriority(id, priority); });
    }
  }

  // Returns whether all calls are answered, all jobs over, and all results delivered.
  bool AtRest() {
    if (world_.now() < kChaosEnds || world_.now() < next_look_) return false;
    next_look_ = world_.now() + kRestCheck;
    if (!server_.up() || !server_.server()->settled() || server_.server()->scheduler().num_leases() > 0 ||
        server_.server()->scheduler().num_queued() > 0) {
      return false;
    }
    for (const auto& client : clients_) {
      if (!client->up() || !client->done()) return false;
    }
    for (const auto& worker : workers_) {
      if (worker->up() && worker->pool()->num_leases() > 0) return false;
    }
    return server_.server()->scheduler().experiments().size() + record_.delete_asked.size() >= planned_;
  }

  World world_;
  Record record_;
  JobBehaviour job_behaviour_;
  std::unique_ptr<Disk> disk_;
  SimulatedServer server_;
  std::vector<std::unique_ptr<SimulatedWorker>> workers_;
  std::vector<std::unique_ptr<SimulatedClient>> clients_;
  Nemesis nemesis_;
  std::uint64_t planned_ = 0;
  microseconds next_look_{0};
};

}  // namespace

HistoryOutcome RunHistory(std::uint64_t seed) { return History(seed).Play(); }

}  // namespace legopt::simulation
