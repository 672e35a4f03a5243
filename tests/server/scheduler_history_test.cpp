// Random histories of scheduler and store under crashes, lost, repeated and late messages, and disk faults.
//
// Each seed is one history in virtual time. Afterwards what was acknowledged is compared with what the store holds: a
// job lost, a result accepted twice, overwritten or never sent, a wrong state or count is a failure that names its
// seed. LEGOPT_HISTORY_SEEDS=N runs N seeds instead of the default.

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <functional>
#include <map>
#include <random>
#include <set>

#include "tests/server/scheduler_fixture.h"

namespace legopt::server {
namespace {

using namespace std::chrono_literals;
using db::JobState;

constexpr int kNumWorkers = 3;
constexpr microseconds kChaosEnds{120'000'000};
constexpr microseconds kGiveUp{600'000'000};

class History {
 public:
  explicit History(std::uint64_t seed) : random_(seed) { StartServer(); }

  void Run() {
    for (int i = 0; i < 3; ++i) SubmitUntilAcknowledged(i);
    if (Chance(0.5)) {
      At(Between(1s, 60s), [this] { CancelUntilAcknowledged(1 + static_cast<std::int64_t>(random_() % 3)); });
    }
    for (int i = 0; i < kNumWorkers; ++i) StartWorker(i);
    At(now_.steady + 50ms, [this] { ServerRound(); });
    At(Between(1s, 5s), [this] { Nemesis(); });
    while (!events_.empty() && !Finished()) {
      const auto next = events_.begin();
      now_.wall_us += (next->first - now_.steady).count();
      now_.steady = next->first;
      const std::function<void()> action = std::move(next->second);
      events_.erase(next);
      action();
      if (now_.steady > kGiveUp) {
        ADD_FAILURE() << "not finished in time";
        return;
      }
    }
    Check();
  }

 private:
  struct Worker {
    bus::EndpointId endpoint = 0;
    std::int64_t worker_id = 0;
    std::int64_t server_instance = 0;
    std::uint64_t life = 0;  // events of earlier lives are void
    microseconds paused_until{0};
    std::vector<legopt_msg::lease> leases;
  };
  // A message for the server: runs the handler now and gives back how to send the reply after the commit.
  using Request = std::function<std::function<void()>()>;

  // --- Chance and time ---
  bool Chance(double probability) { return static_cast<double>(random_() >> 11) * 0x1.0p-53 < probability; }
  microseconds Within(microseconds low, microseconds high) {
    return low + microseconds(random_() % static_cast<std::uint64_t>((high - low).count() + 1));
  }
  microseconds Between(microseconds low, microseconds high) { return now_.steady + Within(low, high); }
  void At(microseconds time, std::function<void()> action) { events_.emplace(time, std::move(action)); }
  bool Chaos() const { return now_.steady < kChaosEnds; }

  // --- The network: loss, repetition, delay (which reorders) ---
  void Send(const Request& request) {
    if (Chaos() && Chance(0.2)) return;
    const int copies = Chaos() && Chance(0.1) ? 2 : 1;
    for (int i = 0; i < copies; ++i) {
      At(Between(0ms, 50ms), [this, request] {
        if (server_up_) arrived_.push_back(request);
      });
    }
  }
  void Reply(std::function<void()> deliver) {
    if (Chaos() && Chance(0.2)) return;
    At(Between(0ms, 50ms), std::move(deliver));
  }

  // --- The server ---
  void StartServer() {
    server_up_ = true;
    arrived_.clear();
    replies_.clear();
    ops_.clear();
    options_.server_instance = ++instance_;
    options_.retention = 10s;
    scheduler_ = std::make_unique<Scheduler>(
        options_, store_.LoadOpenState(), [this] { return static_cast<std::int64_t>(++token_); },
        Scheduler::Lookup{[this](std::int64_t job, int attempt) { return store_.FindAttempt(job, attempt); },
                          [this](const std::string& hash) { return store_.FindMethodOptions(hash); }},
        now_);
  }

  void KillServer() {
    server_up_ = false;
    At(Between(10ms, 4s), [this] { StartServer(); });
  }

  // One poll round: handle what arrived, commit, then reply. May die before or after the commit.
  void ServerRound() {
    At(now_.steady + 5ms, [this] { ServerRound(); });
    if (!server_up_) return;
    if (ops_.empty()) {
      for (Request& request : std::exchange(arrived_, {})) replies_.push_back(request());
      scheduler_->Tick(now_, ops_);
    }
    if (Chaos() && Chance(0.0005)) return KillServer();
    try {
      store_.Apply(ops_);
    } catch (const db::StoreError& error) {
      ASSERT_TRUE(error.transient()) << error.what();
      return;  // the same operations are tried again in the next round
    }
    ops_.clear();
    if (Chaos() && Chance(0.0005)) return KillServer();
    for (auto& reply : std::exchange(replies_, {})) {
      if (reply) reply();
    }
    CheckCounts();
  }

  void Nemesis() {
    if (!Chaos()) {
      store_.FailWith({});
      return;
    }
    At(Between(500ms, 6s), [this] { Nemesis(); });
    switch (random_() % 4) {
      case 0:
        if (server_up_) KillServer();
        break;
      case 1:
        StartWorker(static_cast<int>(random_() % kNumWorkers));  // the old process is gone
        break;
      case 2:
        workers_[random_() % kNumWorkers].paused_until = Between(1s, 40s);
        break;
      default:
        store_.FailWith(Chance(0.5) ? db::StoreErrorCode::kFull : db::StoreErrorCode::kIo);
        At(Between(10ms, 15s), [this] { store_.FailWith({}); });
    }
  }

  // --- The client ---
  void SubmitUntilAcknowledged(int number) {
    if (acknowledged_.contains(number)) return;
    legopt_msg::submit_request request{};
    request.submission_id = "submission " + std::to_string(number);
    request.spec_json = SampleSpec(5 + 3 * number).dump();
    Send([this, number, request]() -> std::function<void()> {
      const auto reply = scheduler_->Submit(now_, request, ops_);
      return [this, number, reply] {
        Reply([this, number, reply] {
          EXPECT_NE(reply.status, 2) << reply.message;
          const auto [known, first] = acknowledged_.emplace(number, reply.experiment_id);
          EXPECT_EQ(known->second, reply.experiment_id) << "one submission, two experiments";
        });
      };
    });
    At(Between(300ms, 600ms), [this, number] { SubmitUntilAcknowledged(number); });
  }

  void CancelUntilAcknowledged(std::int64_t experiment_id) {
    if (cancelled_.contains(experiment_id)) return;
    legopt_msg::cancel_request request{};
    request.experiment_id = experiment_id;
    Send([this, request]() -> std::function<void()> {
      const auto reply = scheduler_->Cancel(now_, request, ops_);
      return [this, request, reply] {
        if (reply.status != 0) return;
        // From the commit on, nothing more may be accepted.
        accepted_at_cancel_[request.experiment_id] = AcceptedOf(request.experiment_id);
        Reply([this, request] { cancelled_.insert(request.experiment_id); });
      };
    });
    At(Between(300ms, 600ms), [this, experiment_id] { CancelUntilAcknowledged(experiment_id); });
  }

  // --- Workers: lease, beat, work for a while, deliver until answered ---
  void StartWorker(int index) {
    Worker& worker = workers_[index];
    worker = Worker{};
    worker.endpoint = static_cast<bus::EndpointId>(++next_endpoint_);
    worker.life = next_endpoint_;
    EachBeat(index, worker.life);
  }

  // Runs `action` on the worker unless that life is over; waits while it is paused.
  void Later(int index, std::uint64_t life, microseconds time, const std::function<void(Worker&)>& action) {
    At(time, [this, index, life, action] {
      Worker& worker = workers_[index];
      if (worker.life != life) return;
      if (worker.paused_until > now_.steady) return Later(index, life, worker.paused_until, action);
      action(worker);
    });
  }
  void Answer(int index, std::uint64_t life, const std::function<void(Worker&)>& action) {
    Reply([this, index, life, action] { Later(index, life, now_.steady, action); });
  }

  void EachBeat(int index, std::uint64_t life) {
    Later(index, life, Between(900ms, 1100ms), [this, index, life](Worker&) { EachBeat(index, life); });
    Worker& worker = workers_[index];
    if (worker.worker_id == 0) return Hello(index, life);
    Beat(index, life);
    if (worker.leases.size() < 3) AskForJobs(index, life);
  }

  void Hello(int index, std::uint64_t life) {
    legopt_msg::hello_request request{};
    request.protocol_version = bus::kProtocolVersion;
    request.worker_name = "w";
    request.slots = 2;
    legopt_msg::dataset_ref dataset{};
    dataset.name = "garage";
    dataset.hash = HashOf('d');
    request.datasets = {dataset};
    const bus::EndpointId endpoint = workers_[index].endpoint;
    Send([this, index, life, endpoint, request]() -> std::function<void()> {
      const auto reply = scheduler_->Hello(now_, endpoint, request, ops_);
      return [this, index, life, reply] {
        Answer(index, life, [reply](Worker& worker) {
          worker.worker_id = reply.worker_id;
          worker.server_instance = reply.server_instance;
        });
      };
    });
  }

  void Beat(int index, std::uint64_t life) {
    Worker& worker = workers_[index];
    legopt_msg::heartbeat_request request{};
    request.worker_id = worker.worker_id;
    request.server_instance = worker.server_instance;
    for (const auto& lease : worker.leases) {
      legopt_msg::lease_state state{};
      state.job_id = lease.job_id;
      state.attempt = lease.attempt;
      state.token = lease.token;
      request.leases.push_back(state);
    }
    const bus::EndpointId endpoint = worker.endpoint;
    Send([this, index, life, endpoint, request]() -> std::function<void()> {
      const auto reply = scheduler_->Heartbeat(now_, endpoint, request);
      Answer(index, life, [this, index, life, request, reply](Worker& w) {
        if (reply.status == 2) Hello(index, life);
        for (std::size_t i = 0; i < request.leases.size(); ++i) {
          if (reply.verdicts[i] == 0) continue;
          // Told to stop: half of the workers have finished by then and deliver all the same.
          for (const auto& lease : w.leases) {
            if (lease.token == request.leases[i].token) Deliver(index, life, lease, Chance(0.5) ? 0 : 4);
          }
        }
      });
      return {};
    });
  }

  void AskForJobs(int index, std::uint64_t life) {
    Worker& worker = workers_[index];
    legopt_msg::lease_request request{};
    request.worker_id = worker.worker_id;
    request.server_instance = worker.server_instance;
    request.max_jobs = 1 + static_cast<int>(random_() % 3);
    request.dataset_hashes = {HashOf('d')};
    const bus::EndpointId endpoint = worker.endpoint;
    Send([this, index, life, endpoint, request]() -> std::function<void()> {
      const auto reply = scheduler_->Lease(now_, endpoint, request, ops_);
      for (const auto& lease : reply.jobs) {
        EXPECT_TRUE(tokens_.insert(lease.token).second) << "a token twice";
      }
      return [this, index, life, reply] {
        Answer(index, life, [this, index, life, reply](Worker& w) {
          if (reply.status == 2) return Hello(index, life);
          for (const auto& lease : reply.jobs) {
            w.leases.push_back(lease);
            Work(index, life, lease);
          }
        });
      };
    });
  }

  void Work(int index, std::uint64_t life, const legopt_msg::lease& lease) {
    // One job in eight is poison: it crashes whoever runs it.
    const bool poison = lease.job_id % 8 == 3;
    const int outcome = poison ? 1 : Chance(0.05) ? 1 + static_cast<int>(random_() % 5) : 0;
    Later(index, life, Between(20ms, 3s),
          [this, index, life, lease, outcome](Worker&) { Deliver(index, life, lease, outcome); });
  }

  void Deliver(int index, std::uint64_t life, const legopt_msg::lease& lease, int outcome) {
    const auto held = [](Worker& w, const legopt_msg::lease& l) {
      return std::find_if(w.leases.begin(), w.leases.end(), [&](const auto& other) { return other.token == l.token; });
    };
    if (held(workers_[index], lease) == workers_[index].leases.end()) return;  // answered
    const auto result = ResultFor(workers_[index].worker_id, lease, outcome);
    if (outcome == 0) sent_[lease.job_id].insert(lease.attempt);
    Send([this, index, life, lease, result, held]() -> std::function<void()> {
      const auto reply = scheduler_->Result(now_, result, ops_);
      return [this, index, life, lease, result, reply, held] {
        if (reply.status == 0 && result.outcome == 0) {
          EXPECT_TRUE(accepted_.emplace(lease.job_id, lease.attempt).second) << "job " << lease.job_id << " twice";
        }
        Answer(index, life, [lease, held](Worker& w) {
          const auto lease_held = held(w, lease);
          if (lease_held != w.leases.end()) w.leases.erase(lease_held);
        });
      };
    });
    Later(index, life, Between(400ms, 800ms),
          [this, index, life, lease, outcome](Worker&) { Deliver(index, life, lease, outcome); });
  }

  // --- The checker ---
  bool Finished() {
    if (Chaos() || acknowledged_.size() < 3 || !server_up_ || !ops_.empty()) return false;
    const db::OpenState state = store_.LoadOpenState();
    return state.open.empty() && state.experiments.size() == 3;
  }

  std::int64_t AcceptedOf(std::int64_t experiment_id) {
    const auto& summary = scheduler_->experiments().at(experiment_id);
    std::int64_t count = 0;
    for (std::int64_t job = summary.first_job_id; job < summary.first_job_id + summary.num_jobs; ++job) {
      count += store_.accepted_result(job) ? 1 : 0;
    }
    return count;
  }

  // After every commit memory and store agree, and every job is counted once.
  void CheckCounts() {
    if (++rounds_ % 50 != 0) return;
    for (const db::ExperimentSummary& stored : store_.LoadOpenState().experiments) {
      const auto& known = scheduler_->experiments().at(stored.experiment_id);
      std::int64_t total = 0;
      for (int state = 0; state < db::kNumJobStates; ++state) {
        ASSERT_EQ(known.jobs_by_state[state], stored.jobs_by_state[state]) << "state " << state;
        total += stored.jobs_by_state[state];
      }
      ASSERT_EQ(total, stored.num_jobs);
      ASSERT_EQ(known.solved, stored.solved);
      ASSERT_EQ(known.state, stored.state);
    }
  }

  void Check() {
    const db::OpenState state = store_.LoadOpenState();
    ASSERT_EQ(state.experiments.size(), 3U) << "one experiment per submission";
    std::int64_t accepted = 0;
    for (const db::ExperimentSummary& summary : state.experiments) {
      const bool cancelled = summary.state == db::ExperimentState::kCancelled;
      if (cancelled_.contains(summary.experiment_id) && cancelled) {
        EXPECT_EQ(AcceptedOf(summary.experiment_id), accepted_at_cancel_.at(summary.experiment_id));
      }
      for (std::int64_t job = summary.first_job_id; job < summary.first_job_id + summary.num_jobs; ++job) {
        CheckJob(job, cancelled);
        accepted += store_.accepted_result(job) ? 1 : 0;
      }
    }
    EXPECT_EQ(accepted, store_.num_accepted());
    for (const auto& [job, attempt] : accepted_) {
      const auto result = store_.accepted_result(job);
      ASSERT_TRUE(result) << "job " << job << ": acknowledged and lost";
      EXPECT_EQ(result->attempt, attempt) << "job " << job << ": overwritten";
    }
  }

  void CheckJob(std::int64_t job, bool cancelled) {
    const JobState state = store_.job_state(job).value();
    const auto result = store_.accepted_result(job);
    EXPECT_EQ(state == JobState::kDone, result.has_value()) << "job " << job;
    EXPECT_TRUE(db::IsTerminal(state)) << "job " << job << " lost";
    EXPECT_TRUE(cancelled || state != JobState::kCancelled) << "job " << job;
    EXPECT_FALSE(job % 8 == 3 && state == JobState::kDone) << "poison";
    if (!result) return;
    EXPECT_TRUE(sent_[job].contains(result->attempt)) << "job " << job << ": a result that nobody sent";
    EXPECT_EQ(result->result.cost, static_cast<double>(job) + result->attempt / 100.0) << "another job's result";
  }

  std::mt19937_64 random_;
  std::multimap<microseconds, std::function<void()>> events_;
  Instant now_{microseconds(0), 1'700'000'000'000'000};

  db::MemoryStore store_;
  SchedulerOptions options_;
  std::unique_ptr<Scheduler> scheduler_;
  Scheduler::Ops ops_;
  std::vector<Request> arrived_;
  std::vector<std::function<void()>> replies_;
  bool server_up_ = false;
  std::int64_t instance_ = 0;
  std::uint64_t token_ = 0;
  std::uint64_t rounds_ = 0;

  std::map<std::size_t, Worker> workers_;
  std::uint64_t next_endpoint_ = 100;

  std::map<int, std::int64_t> acknowledged_;                 // submission -> experiment
  std::map<std::int64_t, int> accepted_;                     // job -> attempt whose result was acknowledged
  std::map<std::int64_t, std::set<int>> sent_;               // job -> attempts that delivered a result
  std::set<std::int64_t> cancelled_;                         // acknowledged
  std::map<std::int64_t, std::int64_t> accepted_at_cancel_;  // experiment -> accepted results at the commit
  std::set<std::int64_t> tokens_;
};

TEST(SchedulerHistory, NothingLostNothingTwiceNothingUnexpected) {
  const char* wanted = std::getenv("LEGOPT_HISTORY_SEEDS");
  const std::uint64_t seeds = wanted != nullptr ? std::strtoull(wanted, nullptr, 10) : 300;
  for (std::uint64_t seed = 1; seed <= seeds; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    History(seed).Run();
    if (HasFailure()) break;
  }
}

}  // namespace
}  // namespace legopt::server
