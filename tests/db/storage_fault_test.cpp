// A full disk, an I/O error, a failing sync or the end of the process at every single call that changes the disk: no
// acknowledgement without commit, no wrong row, and the work continues automatically afterwards. Acceptance figures
// 17, 18.
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <fstream>
#include <functional>
#include <iterator>
#include <set>
#include <string>
#include <vector>

#include "db/audit.h"
#include "db/connection.h"
#include "db/sqlite_store.h"
#include "tests/db/faulty_vfs.h"
#include "tests/db/store_samples.h"

namespace legopt::db {
namespace {

using Fault = FaultyVfs::Fault;
constexpr int kJobs = 50;
constexpr int kJobsPerCommit = 10;

// A run of 50 jobs as the server does it: every batch is retried until the store accepts it, and then acknowledged.
class JobRun {
 public:
  explicit JobRun(std::filesystem::path path) : path_(std::move(path)) {}

  // Continues from the state on disk to the end. Calls `acknowledged` with the jobs of each commit, whose results are
  // then acknowledged. Returns false if the store refused permanently.
  bool Finish(const std::function<void(const std::vector<std::int64_t>&)>& acknowledged) {
    const auto store = Open();
    if (store == nullptr) return false;
    OpenState state = store->LoadOpenState();
    if (state.experiments.empty()) {
      if (!Apply(*store, {CreateExperiment{SampleExperiment(1, 1, 1, kJobs / 2)}, PutWorker{SampleWorker(1)}})) {
        return false;
      }
      state = store->LoadOpenState();
    }
    if (state.open.empty() || state.open[0].experiment_id != 1) return Change(*store);
    std::vector<StoreOp> batch;
    std::vector<std::int64_t> jobs;
    for (std::int64_t job = 1; job <= kJobs; ++job) {
      const OpenJob& open = state.open[0].jobs[static_cast<std::size_t>(job - 1)];
      if (open.state == JobState::kDone) continue;
      batch.emplace_back(LeaseJob{job, 1, 1000 + job, 1, 1});
      batch.emplace_back(AcceptResult{job, 1, SampleResult(static_cast<double>(job)), "", "log", 2});
      jobs.push_back(job);
      if (job % kJobsPerCommit != 0) continue;
      if (!Apply(*store, batch)) return false;
      acknowledged(jobs);
      batch.clear();
      jobs.clear();
      Tidy(*store);
    }
    return Apply(*store, {FinishExperiment{1, 3}}) && Change(*store);
  }

  // Retries a start that failed for lack of space or by an I/O error, as a supervisor would.
  std::unique_ptr<Store> Open() {
    for (int attempt = 0; attempt < kPatience; ++attempt) {
      try {
        return OpenSqliteStore(path_);
      } catch (const StoreError& error) {
        last_ = error.what();
      }
    }
    return nullptr;
  }

  const std::string& last() const { return last_; }

  // Performs operator commands: renames and tags experiment 1; creates experiment 2, retries it after a stop by the
  // wall-time limit, and deletes it. The state left by each step determines the next one.
  bool Change(Store& store) {
    ResultRecord stopped = SampleResult();
    stopped.solver_status = SolveStatus::kTimeLimit;
    OpenState state = store.LoadOpenState();
    if (state.next_experiment_id == 2) {
      std::vector<StoreOp> ops = {RenameExperiment{1, "renamed"}, TagExperiment{1, "tag", true},
                                  CreateExperiment{SampleExperiment(2, kJobs + 1, 3, 1)}};
      for (std::int64_t job = kJobs + 1; job <= kJobs + 2; ++job) {
        ops.insert(ops.end(), {LeaseJob{job, 1, 1000 + job, 1, 1}, AcceptResult{job, 1, stopped, "", "", 2}});
      }
      ops.emplace_back(FinishExperiment{2, 4});
      if (!Apply(store, ops)) return false;
      state = store.LoadOpenState();
    }
    if (state.experiments.size() == 1) return true;  // deleted
    if (state.experiments[1].solved == 2 && !Apply(store, {RetryExperiment{2, true, 5}})) return false;
    state = store.LoadOpenState();
    if (!state.open.empty() && !Apply(store, {CancelExperiment{2, 6}})) return false;
    return Apply(store, {DeleteExperiment{2}});
  }

 private:
  static constexpr int kPatience = 20;

  bool Apply(Store& store, const std::vector<StoreOp>& ops) {
    for (int attempt = 0; attempt < kPatience; ++attempt) {
      try {
        store.Apply(ops);
        return true;
      } catch (const StoreError& error) {
        last_ = error.what();
        if (!error.transient()) return false;
      }
    }
    return false;
  }

  // Checkpoints may fail as well; the log then remains in use.
  void Tidy(Store& store) {
    try {
      store.Idle();
    } catch (const StoreError& error) {
      last_ = error.what();
    }
  }

  std::filesystem::path path_;
  std::string last_;
};

class StorageFault : public testing::Test {
 protected:
  // Empties the folder.
  void Clear() {
    for (const auto& entry : std::filesystem::directory_iterator(folder_.path())) std::filesystem::remove(entry.path());
  }

  // Puts an empty database into the folder. Separate tests inject faults during its creation, which takes as many
  // calls.
  void Fresh() {
    Clear();
    if (empty_.empty()) {
      OpenSqliteStore(path_);
      std::ifstream file(path_, std::ios::binary);
      empty_.assign(std::istreambuf_iterator<char>(file), {});
      return;
    }
    std::ofstream(path_, std::ios::binary) << empty_;
  }

  // If the process died while creating the file, opening it completes it.
  void ExpectEmpty(const std::string& when) {
    EXPECT_TRUE(OpenSqliteStore(path_)->LoadOpenState().experiments.empty()) << when;
    for (const AuditDiagnostic& defect : Audit(path_))
      ADD_FAILURE() << when << ": " << defect.rule << ": " << defect.detail;
  }

  void ExpectWhole(const std::string& when) {
    for (const AuditDiagnostic& defect : Audit(path_))
      ADD_FAILURE() << when << ": " << defect.rule << ": " << defect.detail;
    Connection connection(path_, Connection::Mode::kReadOnly);
    EXPECT_EQ(connection.QueryInt("SELECT count(*) FROM results WHERE cost = job_id"), kJobs) << when;
    EXPECT_EQ(connection.QueryInt("SELECT count(*) FROM attempts"), kJobs) << when << ": nothing twice";
    EXPECT_EQ(connection.QueryText("SELECT group_concat(state || name || tag) FROM experiments JOIN experiment_tags"),
              "donerenamedtag")
        << when;
    EXPECT_EQ(connection.QueryInt("SELECT largest FROM deleted_ids WHERE kind = 'job'"), kJobs + 2) << when;
  }

  // Injects the fault at call 1, 2, 3, ... until a run ends before the fault occurs. Returns the number of calls.
  std::int64_t InjectAtEveryCall(Fault fault, std::int64_t length) {
    FaultyVfs vfs;
    for (std::int64_t call = 1;; ++call) {
      Fresh();
      const std::string when = "call " + std::to_string(call);
      vfs.Arm(fault, call, length);
      JobRun run(path_);
      std::set<std::int64_t> acknowledged;
      const bool finished = run.Finish([&](const std::vector<std::int64_t>& jobs) {
        // Acknowledged results are on disk: another connection reads them.
        const auto faults = vfs.faults();
        Connection other(path_, Connection::Mode::kReadOnly);
        for (const std::int64_t job : jobs) {
          EXPECT_TRUE(acknowledged.insert(job).second);
          EXPECT_EQ(other.QueryInt("SELECT count(*) FROM results WHERE job_id = " + std::to_string(job)), 1) << when;
        }
        EXPECT_EQ(vfs.faults(), faults);
      });
      EXPECT_TRUE(finished) << when << ": " << run.last();
      EXPECT_EQ(acknowledged.size(), static_cast<std::size_t>(kJobs)) << when;
      const bool struck = vfs.faults() > 0;
      vfs.Disarm();
      ExpectWhole(when);
      if (!struck || HasFailure()) return call - 1;
    }
  }

  // Injects the fault during creation of the file, at every `step`th call.
  std::int64_t InjectDuringCreation(Fault fault, std::int64_t length, std::int64_t step) {
    FaultyVfs vfs;
    for (std::int64_t call = 1;; call += step) {
      Clear();
      const std::string when = "call " + std::to_string(call);
      vfs.Arm(fault, call, length);
      JobRun run(path_);
      EXPECT_NE(run.Open(), nullptr) << when << ": " << run.last();
      const bool struck = vfs.faults() > 0;
      vfs.Disarm();
      ExpectEmpty(when);
      if (!struck || HasFailure()) return call - 1;
    }
  }

  std::string empty_;                                        // bytes of an empty database
  TemporaryFolder folder_{TemporaryFolder::Place::kMemory};  // memory: hundreds of runs must not wait for a disk
  std::filesystem::path path_ = folder_ / "results.sqlite";
};

TEST_F(StorageFault, AnIoErrorAtAnyCallPasses) {
  const std::int64_t calls = InjectAtEveryCall(Fault::kIoError, 1);
  EXPECT_GT(calls, 100);
  RecordProperty("calls", static_cast<int>(calls));
}

TEST_F(StorageFault, AFullDiskAtAnyCallPassesOnceThereIsSpace) { EXPECT_GT(InjectAtEveryCall(Fault::kFull, 6), 100); }

TEST_F(StorageFault, AFailingSyncIsNoCommit) { EXPECT_GT(InjectAtEveryCall(Fault::kSyncFailed, 2), 10); }

TEST_F(StorageFault, MakingTheFileOutlivesAFaultAtAnyCall) {
  constexpr std::int64_t kFullFor = 6, kUnsyncedFor = 2;
  EXPECT_GT(InjectDuringCreation(Fault::kIoError, 1, 1), 50);
  EXPECT_GT(InjectDuringCreation(Fault::kFull, kFullFor, kFullFor), 50);
  EXPECT_GT(InjectDuringCreation(Fault::kSyncFailed, kUnsyncedFor, 1), 5);
}

TEST_F(StorageFault, DeathWhileTheFileIsMadeLeavesNoHalf) {
  for (std::int64_t call = 1;; ++call) {
    Clear();
    const pid_t child = fork();
    ASSERT_GE(child, 0);
    if (child == 0) {
      FaultyVfs vfs;
      vfs.Arm(Fault::kDie, call);
      _exit(JobRun(path_).Open() != nullptr ? 0 : 2);
    }
    int status = 0;
    waitpid(child, &status, 0);
    ASSERT_TRUE(WIFEXITED(status));
    ASSERT_TRUE(WEXITSTATUS(status) == 9 || WEXITSTATUS(status) == 0) << WEXITSTATUS(status);
    ExpectEmpty("death before call " + std::to_string(call));
    if (WEXITSTATUS(status) == 0 || HasFailure()) {
      EXPECT_GT(call, 50);
      return;
    }
  }
}

// The process ends before the call, after half of a write. The next process finds everything acknowledged intact.
TEST_F(StorageFault, DeathAtAnyCallLosesNothingAcknowledged) {
  for (std::int64_t call = 1;; ++call) {
    Fresh();
    int ends[2];
    ASSERT_EQ(pipe(ends), 0);
    const pid_t child = fork();
    ASSERT_GE(child, 0);
    if (child == 0) {
      FaultyVfs vfs;
      vfs.Arm(Fault::kDie, call);
      const bool finished = JobRun(path_).Finish([&](const std::vector<std::int64_t>& jobs) {
        const std::vector<char> bytes(jobs.begin(), jobs.end());
        if (write(ends[1], bytes.data(), bytes.size()) != static_cast<ssize_t>(bytes.size())) _exit(1);
      });
      _exit(finished ? 0 : 2);
    }
    close(ends[1]);
    std::set<std::int64_t> acknowledged;
    for (char byte = 0; read(ends[0], &byte, 1) == 1;) acknowledged.insert(byte);
    close(ends[0]);
    int status = 0;
    waitpid(child, &status, 0);
    ASSERT_TRUE(WIFEXITED(status));
    ASSERT_TRUE(WEXITSTATUS(status) == 9 || WEXITSTATUS(status) == 0) << WEXITSTATUS(status);
    const std::string when = "death before call " + std::to_string(call);
    {
      JobRun run(path_);
      ASSERT_NE(run.Open(), nullptr) << when << ": " << run.last();
      Connection connection(path_, Connection::Mode::kReadOnly);
      for (const std::int64_t job : acknowledged) {
        ASSERT_EQ(connection.QueryInt("SELECT count(*) FROM results WHERE job_id = " + std::to_string(job)), 1) << when;
      }
      for (const AuditDiagnostic& defect : Audit(path_))
        ADD_FAILURE() << when << ": " << defect.rule << ": " << defect.detail;
    }
    JobRun rest(path_);
    ASSERT_TRUE(rest.Finish([](const std::vector<std::int64_t>&) {})) << when << ": " << rest.last();
    ExpectWhole(when);
    if (WEXITSTATUS(status) == 0 || HasFailure()) {
      EXPECT_GT(call, 100);
      return;
    }
  }
}

}  // namespace
}  // namespace legopt::db
