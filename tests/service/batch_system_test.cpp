// Workers under a batch system, a container engine or a service manager: signals to every process of a job at once, in
// any group or session, KILL afterwards, a part of the machine only, no server. Real processes over real LCM, stub
// jobs. The tests check that attempts are charged only if a worker dies while solving.

#include <gtest/gtest.h>
#include <sched.h>
#include <sys/types.h>

#include <csignal>
#include <optional>

#include "app/exit_codes.h"
#include "db/read_only_database.h"
#include "db/store_error.h"
#include "tests/figures/process_facts.h"
#include "tests/service/deployment.h"
#include "tests/temporary_folder.h"

namespace legopt::service {
namespace {

using app::ExitCode;

using std::chrono::milliseconds;
using std::chrono::seconds;
using Worker = std::unique_ptr<client::ChildProcess>;
using Lines = std::vector<std::string>;

constexpr milliseconds kPatience = seconds(60);
constexpr int kLongJob_ms = 6'000;  // long enough to be seen running on a busy machine
constexpr char kNohup[] = "/usr/bin/nohup";

// Adds a process and all its descendants, children first, so that a parent gets its signal after its children.
void AddTree(pid_t root, std::vector<pid_t>& processes) {
  for (const pid_t child : figures::ChildrenOf(root)) AddTree(child, processes);
  processes.push_back(root);
}

std::vector<pid_t> ProcessesOf(const std::vector<Worker>& workers) {
  std::vector<pid_t> processes;
  for (const Worker& worker : workers) AddTree(worker->pid(), processes);
  return processes;
}

void SignalAll(const std::vector<pid_t>& processes, std::initializer_list<int> signals) {
  for (const int signal : signals) {
    for (const pid_t process : processes) ::kill(process, signal);
  }
}

class BatchSystemTest : public testing::Test {
 protected:
  void SetUp() override {
    if (const std::string why = Deployment::Unavailable(); !why.empty()) GTEST_SKIP() << "NO MULTICAST HERE: " << why;
    deployment_.emplace();
    deployment_->StartServer();
  }

  std::vector<Worker> StartWorkers(int count, const std::string& drain_s) {
    std::vector<Worker> workers;
    for (int i = 0; i < count; ++i) {
      workers.push_back(deployment_->StartStubWorker({"--slots", "2", "--drain", drain_s}));
    }
    return workers;
  }

  // Waits for the workers' own reports, since the server records a lease before its worker receives it.
  bool WaitUntilRunning(std::int64_t experiment, std::size_t jobs) {
    return deployment_->WaitFor(experiment,
                                [jobs](const nlohmann::json& status) { return status.at("running").size() == jobs; });
  }

  bool WaitUntilAllReleased(std::int64_t experiment) {
    return deployment_->WaitFor(experiment,
                                [](const nlohmann::json& status) { return status.at("jobs").at("leased") == 0; });
  }

  static void ExpectExit(client::ChildProcess& worker, ExitCode code) {
    const auto exit = worker.Wait(kPatience);
    ASSERT_TRUE(exit) << "still there";
    EXPECT_EQ(exit->Describe(), "exit code " + std::to_string(StatusOf(code))) << worker.ErrorTail();
  }

  Lines Charges() { return deployment_->Query("SELECT state, max(attempts - returned) FROM jobs GROUP BY state"); }

  std::optional<Deployment> deployment_;
};

// --- Signals to all processes ----------------------------------------------------------------------------------------

// Slurm does this at preemption, scancel and the time limit.
TEST_F(BatchSystemTest, ThreeRoundsOfTermToAllProcessesAtWorkChargeNothing) {
  constexpr int kJobs = 4;
  const std::int64_t experiment = deployment_->Submit(StubSpec(kJobs, kLongJob_ms), "a");
  for (int round = 0; round < 3; ++round) {
    const std::vector<Worker> workers = StartWorkers(2, "0.2");
    ASSERT_TRUE(WaitUntilRunning(experiment, kJobs)) << "round " << round;
    const std::vector<pid_t> processes = ProcessesOf(workers);
    ASSERT_EQ(processes.size(), 6U) << "two supervisors with two job processes each";
    SignalAll(processes, {SIGCONT, SIGTERM});
    for (const Worker& worker : workers) ExpectExit(*worker, ExitCode::kOk);
    EXPECT_EQ(Charges(), Lines{"queued|0"}) << "round " << round;
  }
  const std::vector<Worker> staying = StartWorkers(2, "0.2");
  ASSERT_TRUE(deployment_->WaitUntilDone(experiment));
  EXPECT_EQ(Charges(), Lines{"done|1"});
  EXPECT_EQ(deployment_->Query("SELECT DISTINCT outcome FROM attempts ORDER BY outcome"),
            (Lines{"finished", "returned"}));
}

TEST_F(BatchSystemTest, JobsThatEndWithinTheDrainAreDone) {
  const std::int64_t experiment = deployment_->Submit(StubSpec(2, kLongJob_ms), "a");
  const std::vector<Worker> workers = StartWorkers(1, "60");
  ASSERT_TRUE(WaitUntilRunning(experiment, 2));
  for (const int signal : {SIGTERM, SIGUSR1, SIGUSR2}) SignalAll(ProcessesOf(workers), {signal});
  ExpectExit(*workers[0], ExitCode::kOk);
  EXPECT_EQ(deployment_->Query("SELECT state, attempts, returned FROM jobs"), (Lines{"done|1|0", "done|1|0"}));
}

// At the end of its grace period a batch system sends KILL to all processes, long after the jobs were released.
TEST_F(BatchSystemTest, KillOfAllAfterTheDrainChargesNothing) {
  const std::int64_t experiment = deployment_->Submit(StubSpec(4, 60'000), "a");
  const std::vector<Worker> workers = StartWorkers(2, "0.2");
  ASSERT_TRUE(WaitUntilRunning(experiment, 4));
  const std::vector<pid_t> processes = ProcessesOf(workers);
  SignalAll(processes, {SIGCONT, SIGTERM});
  ASSERT_TRUE(WaitUntilAllReleased(experiment));
  for (const Worker& worker : workers) worker->Signal(SIGKILL);
  for (const Worker& worker : workers) worker->Wait(kPatience);
  EXPECT_EQ(Charges(), Lines{"queued|0"});
}

// KILL does not reach all processes at the same instant: supervisors that outlive their job processes determine the
// cause.
TEST_F(BatchSystemTest, KillOfJobProcessesAfterTermChargesNothing) {
  const std::int64_t experiment = deployment_->Submit(StubSpec(4, 60'000), "a");
  const std::vector<Worker> workers = StartWorkers(2, "60");
  ASSERT_TRUE(WaitUntilRunning(experiment, 4));
  std::vector<pid_t> processes = ProcessesOf(workers);
  SignalAll(processes, {SIGCONT, SIGTERM});
  for (const Worker& worker : workers) {
    while (worker->ErrorTail().find("stopping: ") == std::string::npos) ASSERT_FALSE(worker->Wait(milliseconds(20)));
  }
  for (const Worker& worker : workers) std::erase(processes, worker->pid());
  SignalAll(processes, {SIGKILL});
  for (const Worker& worker : workers) ExpectExit(*worker, ExitCode::kOk);
  EXPECT_EQ(Charges(), Lines{"queued|0"});
}

// Warnings that a batch system may send to every process in advance.
TEST_F(BatchSystemTest, WarningsToAllProcessesChangeNothing) {
  const std::int64_t experiment = deployment_->Submit(StubSpec(4, kLongJob_ms), "a");
  const std::vector<Worker> workers = StartWorkers(2, "60");
  ASSERT_TRUE(WaitUntilRunning(experiment, 4));
  SignalAll(ProcessesOf(workers), {SIGUSR1, SIGUSR2});
  ASSERT_TRUE(deployment_->WaitUntilDone(experiment));
  EXPECT_EQ(deployment_->Query("SELECT DISTINCT state, attempts, returned FROM jobs"), Lines{"done|1|0"});
}

TEST_F(BatchSystemTest, ATerminalThatClosesDoesNotEndAWorkerUnderNohup) {
  const std::int64_t experiment = deployment_->Submit(StubSpec(1, kLongJob_ms), "a");
  if (!std::filesystem::exists(kNohup)) GTEST_SKIP() << "NOT TESTED: no " << kNohup;
  const Worker worker =
      deployment_->StartWorker(kNohup, {Program("stub_worker"), "--slots", "1", "--dataset", "stub-d"});
  ASSERT_TRUE(WaitUntilRunning(experiment, 1));
  worker->Signal(SIGHUP);
  ASSERT_TRUE(deployment_->WaitUntilDone(experiment));
  const std::int64_t next = deployment_->Submit(StubSpec(1, 0), "b");
  EXPECT_TRUE(deployment_->WaitUntilDone(next)) << "it takes no more jobs";
}

// A batch job that consists of a whole `legopt run`: client, server, worker and job processes receive the same
// signals, and the client determines the order in which they end. Motions by STOMP take long enough to be running.
TEST(RunUnderABatchSystemTest, TermToAllProcessesReleasesAllJobs) {
  if (const std::string why = Deployment::Unavailable(); !why.empty()) GTEST_SKIP() << "NO MULTICAST HERE: " << why;
  const test::TemporaryFolder folder;
  const std::string database = folder / "results.sqlite";
  client::ChildProcess run(
      Program("legopt"),
      {"run", "baselines", "--tasks", "motion", "--methods", "STOMP", "--workers", "2", "--db", database}, true);
  const auto count = [&](const std::string& what) -> std::int64_t {
    const auto rows = db::ReadOnlyDatabase(database).Query("SELECT count(*) FROM " + what, 1).rows;
    return std::get<std::int64_t>(rows.at(0).at(0));
  };
  const auto is_at_work = [&] {
    try {
      return std::filesystem::exists(database) && count("attempts WHERE outcome = 'running'") == 2;
    } catch (const db::StoreError&) {
      return false;  // still starting
    }
  };
  while (!is_at_work()) ASSERT_FALSE(run.Wait(milliseconds(20))) << run.ErrorTail();
  std::vector<pid_t> processes;
  AddTree(run.pid(), processes);
  ASSERT_EQ(processes.size(), 5U) << "client, server, worker and two job processes";
  SignalAll(processes, {SIGCONT, SIGTERM});
  const auto exit = run.Wait(kPatience);
  ASSERT_TRUE(exit);
  EXPECT_EQ(exit->Describe(), "exit code " + std::to_string(StatusOf(ExitCode::kInterrupted))) << run.ErrorTail();
  EXPECT_GT(count("attempts WHERE outcome = 'returned'"), 0) << "nothing was at work";
  EXPECT_EQ(count("jobs WHERE state = 'queued' AND attempts > returned"), 0);
  EXPECT_EQ(count("attempts WHERE outcome NOT IN ('finished', 'returned')"), 0);
}

// --- A part of the machine -------------------------------------------------------------------------------------------

// Restricts this thread, and the programs that it starts, to one of its processors.
class OneProcessor {
 public:
  OneProcessor() {
    CPU_ZERO(&before_);
    if (sched_getaffinity(0, sizeof before_, &before_) != 0) return;
    int first = 0;
    while (first < CPU_SETSIZE && !CPU_ISSET(first, &before_)) ++first;
    cpu_set_t one;
    CPU_ZERO(&one);
    CPU_SET(first, &one);
    set_ = sched_setaffinity(0, sizeof one, &one) == 0;
  }
  ~OneProcessor() {
    if (set_) sched_setaffinity(0, sizeof before_, &before_);
  }
  OneProcessor(const OneProcessor&) = delete;
  OneProcessor& operator=(const OneProcessor&) = delete;
  bool set() const { return set_; }

 private:
  cpu_set_t before_{};
  bool set_ = false;
};

TEST_F(BatchSystemTest, SlotsAreWhatWasGranted) {
  const OneProcessor granted;
  if (!granted.set()) GTEST_SKIP() << "NOT TESTED: sched_setaffinity is refused here";
  const Worker worker = deployment_->StartStubWorker({});
  ASSERT_TRUE(worker->WaitForLine("legopt-worker: 1 slot: ", kPatience)) << worker->ErrorTail();
  ASSERT_TRUE(deployment_->WaitForWorkers(1));
  EXPECT_EQ(deployment_->connection().Status(0).at("workers").at(0).at("slots"), 1);
  EXPECT_EQ(worker->ErrorTail().find("more than was granted"), std::string::npos) << worker->ErrorTail();
}

TEST_F(BatchSystemTest, MoreSlotsThanGrantedAreAllowedAndReported) {
  const OneProcessor granted;
  if (!granted.set()) GTEST_SKIP() << "NOT TESTED: sched_setaffinity is refused here";
  const Worker worker = deployment_->StartStubWorker({"--slots", "2"});
  ASSERT_TRUE(worker->WaitForLine("legopt-worker: 2 slots: told by --slots; ", kPatience)) << worker->ErrorTail();
  ASSERT_TRUE(deployment_->WaitForWorkers(1));
  EXPECT_EQ(deployment_->connection().Status(0).at("workers").at(0).at("slots"), 2);
  EXPECT_NE(worker->ErrorTail().find("--slots 2 is more than was granted"), std::string::npos) << worker->ErrorTail();
}

// --- Without jobs or server ------------------------------------------------------------------------------------------

TEST_F(BatchSystemTest, AWorkerWithoutJobsLeavesAfterItsIdleTimeout) {
  const Worker worker = deployment_->StartStubWorker({"--slots", "1", "--idle-timeout", "0.3"});
  ExpectExit(*worker, ExitCode::kOk);
  EXPECT_NE(worker->ErrorTail().find("no job for 0.3 s: leaving"), std::string::npos) << worker->ErrorTail();
}

TEST_F(BatchSystemTest, AWorkerWithoutAServerLeavesAfterItsIdleTimeout) {
  deployment_->KillServer();
  const Worker worker = deployment_->StartStubWorker({"--slots", "1", "--idle-timeout", "0.3"});
  ExpectExit(*worker, ExitCode::kOk);
}

// A job longer than the time-out does not count as idle time, and the time-out restarts after it.
TEST_F(BatchSystemTest, AJobIsNoIdleness) {
  const std::int64_t experiment = deployment_->Submit(StubSpec(1, 3'000), "a");
  const Worker worker = deployment_->StartStubWorker({"--slots", "1", "--idle-timeout", "2.5"});
  ASSERT_TRUE(deployment_->WaitUntilDone(experiment));
  EXPECT_EQ(deployment_->Query("SELECT attempts, returned FROM jobs"), Lines{"1|0"});
  ExpectExit(*worker, ExitCode::kOk);
}

}  // namespace
}  // namespace legopt::service
