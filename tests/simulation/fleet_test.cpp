// A large fleet and many jobs on one server: nothing is lost, done twice or kept forever, and slots stay busy.
// build/tests/bench/fleet_bench runs the full size.

#include "tests/simulation/fleet.h"

#include <gtest/gtest.h>
#include <malloc.h>
#include <spdlog/spdlog.h>

#include "db/read_only_database.h"
#include "db/sqlite_store.h"
#include "tests/db/store_samples.h"

namespace legopt::simulation {
namespace {

using namespace std::chrono_literals;

// Accepts everything and stores only the methods, so that heap growth is caused by the server.
class ForgetfulStore final : public db::Store {
 public:
  void Apply(std::span<const db::StoreOp> operations) override {
    for (const db::StoreOp& operation : operations) {
      const auto* create = std::get_if<db::CreateExperiment>(&operation);
      if (create == nullptr) continue;
      for (const db::MethodRecord& method : create->experiment.methods) options_[method.hash] = method.options_json;
    }
  }
  db::OpenState LoadOpenState() override { return {}; }
  std::optional<db::AttemptRecord> FindAttempt(std::int64_t, int) override { return std::nullopt; }
  std::optional<db::OpenExperiment> LoadExperiment(std::int64_t) override { return std::nullopt; }
  std::optional<std::string> FindMethodOptions(const std::string& hash) override {
    const auto known = options_.find(hash);
    return known == options_.end() ? std::nullopt : std::optional(known->second);
  }
  std::optional<std::string> FindDatasetArchive(const std::string&) override { return std::nullopt; }
  db::ArchiveFacts FindArchiveFacts(const std::string&) override { return {}; }
  std::vector<db::KnownResult> FindKnownResults(const db::ResultSearch& search) override {
    return std::vector<db::KnownResult>(search.problems.size());
  }

 private:
  std::map<std::string, std::string> options_;
};

class FleetTest : public testing::Test {
 protected:
  static void SetUpTestSuite() { spdlog::set_level(spdlog::level::off); }
};

std::int64_t Number(db::ReadOnlyDatabase& database, const std::string& sql) {
  return std::get<std::int64_t>(database.Query(sql, 1).rows.at(0).at(0));
}

TEST_F(FleetTest, TenThousandJobsOfOneSubmissionAreDoneOnceEach) {
  const db::TemporaryFolder folder;
  const auto store = db::OpenSqliteStore(folder / "fleet.sqlite");
  FleetOptions options;
  options.workers = 100;
  options.jobs = 10'000;
  Fleet fleet(options, *store);
  EXPECT_TRUE(fleet.Run([] {}));
  EXPECT_LT(fleet.spec_bytes(), 16'384U) << "what is sent is the specification, not the jobs";
  db::ReadOnlyDatabase database(folder / "fleet.sqlite");
  EXPECT_EQ(Number(database, "SELECT count(*) FROM jobs WHERE state = 'done'"), 10'000);
  EXPECT_EQ(Number(database, "SELECT count(*) FROM (SELECT DISTINCT cell_id, problem_key, repetition FROM jobs)"),
            10'000);
  EXPECT_EQ(Number(database, "SELECT count(*) FROM results"), 10'000);
  EXPECT_EQ(Number(database, "SELECT count(*) FROM attempts"), 10'000);
  EXPECT_EQ(fleet.scheduler().counters().results_accepted, 10'000U);
  EXPECT_EQ(fleet.scheduler().counters().results_duplicate, 0U);
}

TEST_F(FleetTest, FinishedJobsLeaveNothingInMemory) {
  if (mallinfo2().uordblks == 0) GTEST_SKIP() << "the heap cannot be measured (sanitizer)";
  ForgetfulStore store;
  FleetOptions options;
  options.workers = 50;
  options.jobs = 40'000;
  options.job_time = 100ms;
  Fleet fleet(options, store);
  std::vector<std::size_t> heap;  // after each hundredth of the jobs
  EXPECT_TRUE(fleet.Run([&] { heap.push_back(mallinfo2().uordblks); }));
  ASSERT_EQ(heap.size(), 100U);
  const auto most = [&](std::size_t first) { return *std::max_element(&heap[first], &heap[first + 20]); };
  constexpr std::size_t kBytesPerJob = 4;
  EXPECT_LT(most(75), most(25) + kBytesPerJob * 20'000);
}

TEST_F(FleetTest, SlotsStayBusyHoweverShortTheJobs) {
  for (const auto job_time : {8ms, 20ms, 100ms}) {
    ForgetfulStore store;
    FleetOptions options;
    options.workers = 10;
    options.slots = 2;
    options.job_time = job_time;
    options.jobs = 20 * 4s / job_time;
    options.network_delay = 500us;
    Fleet fleet(options, store);
    double share = 0;
    int looks = 0;
    EXPECT_TRUE(fleet.Run([&] {
      if (++looks == 90) share = fleet.busy_share();  // the last tenth is divided among the workers
    }));
    EXPECT_GT(share, 0.97) << job_time.count() << " ms";
  }
}

// Ten thousand callers fill a receive buffer of 8 MiB at once. Datagrams that wait longer than the first retry must
// not keep it full forever.
TEST_F(FleetTest, TenThousandKeyedWorkersAreBackWithinTenSecondsOfARestart) {
  ForgetfulStore store;
  FleetOptions options;
  options.workers = 10'000;
  options.keyed = true;
  options.receive_buffer = 10'900;
  options.time_per_datagram = 25us;
  Fleet fleet(options, store);
  ASSERT_TRUE(fleet.RunUntilRegistered(10s));
  fleet.StopServer();
  fleet.RunFor(2s);
  fleet.StartServer();
  ASSERT_TRUE(fleet.RunUntilRegistered(10s));
  fleet.RunFor(1s);
  const std::uint64_t challenged = fleet.server_counters().requests_challenged;
  const std::uint64_t received = fleet.server_counters().datagrams_received;
  fleet.RunFor(1s);
  EXPECT_EQ(fleet.server_counters().requests_challenged, challenged) << "every session is remembered";
  constexpr std::uint64_t kHeartbeats = 2 * 10'000;
  EXPECT_LT(fleet.server_counters().datagrams_received - received, kHeartbeats * 5 / 4) << "few are repeated";
}

}  // namespace
}  // namespace legopt::simulation
