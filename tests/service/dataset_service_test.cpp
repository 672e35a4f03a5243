// Policy: one file is the complete result, for any way of starting server and workers. A dataset that only the client
// has is stored by the server and fetched by workers that were started without --dataset. A wrong archive, one that is
// too large, or a server that stores none causes a warning, never a failed submission.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <random>

#include "legopt/dataset/internal/dataset_content.h"
#include "tests/client/program_run.h"
#include "tests/dataset/synthetic_dataset.h"
#include "tests/dataset/test_data.h"
#include "tests/folders.h"
#include "tests/service/deployment.h"

namespace legopt::service {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

constexpr int kDatasetMismatchCode = static_cast<int>(app::ExitCode::kDatasetMismatch);

// Returns printable characters, 6 random bits each.
std::string Noise(std::size_t bytes) {
  std::string noise(bytes, ' ');
  std::mt19937 random(1);
  for (char& c : noise) c = static_cast<char>('?' + random() % 64);
  return noise;
}

class DatasetServiceTest : public testing::Test {
 protected:
  void SetUp() override {
    if (const std::string why = Deployment::Unavailable(); !why.empty()) GTEST_SKIP() << "NO MULTICAST HERE: " << why;
    // Inherited by programs that the test starts: the user's cache must not affect the test.
    ::setenv("XDG_CACHE_HOME", (folder_ / "cache").c_str(), 1);
    fs::copy(SourceFolder() + "/data/garage-small", folder_ / "mine", fs::copy_options::recursive);
    test::WriteText(folder_ / "suite.yaml",
                    "tasks: [{task: posture, problems: [0-2]}]\ninitializations: [good]\nmethods: [{solver: sqp}]\n"
                    "dataset: mine\n");
    hash_ = HashOfDataset(folder_ / "mine", {});
    deployment_.emplace();
  }

  client::ProgramResult Submit(std::vector<std::string> words = {}) const {
    words.insert(words.begin(), {"submit", "suite.yaml", "--port", std::to_string(deployment_->port())});
    return client::RunLegopt(words, folder_.path());
  }
  std::unique_ptr<client::ChildProcess> StartWorker(std::vector<std::string> arguments = {}) const {
    arguments.insert(arguments.end(), {"--slots", "1"});
    return deployment_->StartWorker("legopt-worker", arguments);
  }
  void ExpectStoredArchives(const std::string& count) const {
    EXPECT_EQ(deployment_->Query("SELECT count(*) FROM dataset_archives").at(0), count);
  }
  // Moves the results as to another machine: one file, without the dataset's folder and the worker's cache.
  fs::path MoveResultsAway() {
    deployment_->server().Signal(SIGTERM);
    EXPECT_TRUE(deployment_->server().Wait(std::chrono::seconds(20)));
    fs::remove_all(folder_ / "mine");
    fs::create_directory(folder_ / "elsewhere");
    const fs::path copy = folder_ / "elsewhere" / "results.sqlite";
    fs::copy_file(deployment_->database(), copy);
    ::setenv("XDG_CACHE_HOME", (folder_ / "elsewhere" / "cache").c_str(), 1);
    return copy;
  }
  client::ProgramResult Read(std::vector<std::string> words, const fs::path& database) const {
    words.insert(words.end(), {"--db", database.string()});
    return client::RunLegopt(words, database.parent_path());
  }
  static const std::vector<std::vector<std::string>>& Readers() {
    static const std::vector<std::vector<std::string>> readers = {{"export", "1", "--out", "out.json"},
                                                                  {"replay", "1"},
                                                                  {"view", "1", "--out", "view.html"},
                                                                  {"report", "--out", "report.html"}};
    return readers;
  }

  test::TemporaryFolder folder_;
  std::string hash_;
  std::optional<Deployment> deployment_;
};

TEST_F(DatasetServiceTest, ADatasetOfTheClientAloneIsSolvedByAWorkerWithoutItAndTravelsWithTheResults) {
  deployment_->StartServer();
  const auto worker = StartWorker();
  ASSERT_TRUE(deployment_->WaitForWorkers(1));
  const auto submitted = Submit({"--wait"});
  ASSERT_EQ(submitted.exit_code, 0) << submitted.err << worker->ErrorTail();
  EXPECT_THAT(submitted.err, Not(HasSubstr("warning")));
  ExpectStoredArchives("1");
  EXPECT_EQ(deployment_->Query("SELECT count(*) FROM results").at(0), "3");
  EXPECT_TRUE(fs::exists(folder_ / "cache" / "legopt" / "datasets" / hash_)) << "the worker has fetched it";
  const fs::path copy = MoveResultsAway();
  for (const auto& command : Readers()) {
    const auto read = Read(command, copy);
    EXPECT_EQ(read.exit_code, 0) << command.front() << ": " << read.err;
    EXPECT_THAT(read.err, Not(HasSubstr("was not found"))) << command.front();
  }
}

TEST_F(DatasetServiceTest, AWorkerWithWorkFetchesWhenThatIsDone) {
  deployment_->StartServer();
  test::WriteText(folder_ / "first.yaml",
                  "tasks: [{task: posture, problems: [0-9]}]\ninitializations: [good]\nmethods: [{solver: sqp}]\n");
  const auto first =
      client::RunLegopt({"submit", "first.yaml", "--port", std::to_string(deployment_->port())}, folder_.path());
  ASSERT_EQ(first.exit_code, 0) << first.err;
  ASSERT_EQ(Submit().exit_code, 0);
  ExpectStoredArchives("2");
  const auto worker = StartWorker();
  EXPECT_TRUE(deployment_->WaitUntilDone(1));
  EXPECT_TRUE(deployment_->WaitUntilDone(2)) << worker->ErrorTail();
  EXPECT_EQ(deployment_->Query("SELECT count(*) FROM workers").at(0), "1") << "the same worker as before";
}

TEST_F(DatasetServiceTest, NoDatasetKeepsTheDatasetOutOfTheDatabase) {
  deployment_->StartServer();
  const auto worker = StartWorker({"--dataset", (folder_ / "mine").string()});
  const auto submitted = Submit({"--wait", "--no-dataset"});
  ASSERT_EQ(submitted.exit_code, 0) << submitted.err;
  EXPECT_THAT(submitted.err, Not(HasSubstr("warning")));
  ExpectStoredArchives("0");
  const fs::path copy = MoveResultsAway();
  EXPECT_EQ(Read({"export", "1", "--out", "out.json"}, copy).exit_code, kDatasetMismatchCode);
}

TEST_F(DatasetServiceTest, AServerThatStoresNoneIsAWarning) {
  deployment_->SetServerArguments({"--no-dataset"});
  deployment_->StartServer();
  const auto submitted = Submit();
  EXPECT_EQ(submitted.exit_code, 0) << submitted.err;
  EXPECT_EQ(submitted.out, "1\n");
  EXPECT_THAT(submitted.err, AllOf(HasSubstr("warning"), HasSubstr("started with --no-dataset")));
  ExpectStoredArchives("0");
}

TEST_F(DatasetServiceTest, AnArchiveOverTheLimitIsAWarning) {
  deployment_->StartServer();
  // Comments that hardly compress, in two files of less than 16 MiB each.
  const std::string noise = Noise(std::size_t{14} << 20);
  std::string robot = test::ReadText(folder_ / "mine" / "robot.urdf");
  robot.insert(robot.rfind("</robot>"), "<!--" + noise + "-->");
  test::WriteText(folder_ / "mine" / "robot.urdf", robot);
  test::WriteText(folder_ / "mine" / "scene.yaml",
                  test::ReadText(folder_ / "mine" / "scene.yaml") + "\n# " + Noise(std::size_t{12} << 20));
  ASSERT_EQ(client::RunLegopt({"dataset", "hash", "mine"}, folder_.path()).exit_code, 0);
  const auto submitted = Submit();
  EXPECT_EQ(submitted.exit_code, 0) << submitted.err;
  EXPECT_THAT(submitted.err, AllOf(HasSubstr("warning"), HasSubstr("a database stores at most 16777216")));
  ExpectStoredArchives("0");
}

TEST_F(DatasetServiceTest, AWrongArchiveIsRefusedWhereverItIsUsed) {
  deployment_->StartServer();
  ASSERT_EQ(Submit({"--no-dataset"}).exit_code, 0);
  const test::SyntheticFolder other(folder_ / "other");
  const auto wrong = [&] { return PackDataset(other.path(), {}); };
  EXPECT_EQ(deployment_->connection().StoreDataset(hash_, wrong), "");
  const auto fetcher = StartWorker();
  ASSERT_TRUE(deployment_->WaitFor(1, [](const nlohmann::json& status) {
    const nlohmann::json& missing = status.at("missing");
    return !missing.empty() && missing.at(0).get<std::string>().find("no worker has dataset") == 0;
  })) << fetcher->ErrorTail();
  EXPECT_FALSE(fetcher->Poll()) << "the worker stays";
  EXPECT_THAT(fetcher->ErrorTail(), AllOf(HasSubstr("could not be fetched"), HasSubstr("another content")));
  const auto owner = StartWorker({"--dataset", (folder_ / "mine").string()});
  ASSERT_TRUE(deployment_->WaitUntilDone(1));
  const auto kept = folder_ / "kept";
  fs::copy(folder_ / "mine", kept, fs::copy_options::recursive);
  const fs::path copy = MoveResultsAway();
  const auto read = Read({"export", "1", "--out", "out.json"}, copy);
  EXPECT_EQ(read.exit_code, kDatasetMismatchCode) << read.err;
  EXPECT_THAT(read.err, AllOf(HasSubstr("warning"), HasSubstr("is not used"), HasSubstr("--dataset")));
  EXPECT_EQ(Read({"export", "1", "--out", "out.json", "--dataset", kept.string()}, copy).exit_code, 0);
  const fs::path cached = folder_ / "elsewhere" / "cache" / "legopt" / "datasets" / hash_;
  fs::create_directories(cached.parent_path());
  fs::copy(kept, cached, fs::copy_options::recursive);
  const auto found = Read({"export", "1", "--out", "out.json"}, copy);
  EXPECT_EQ(found.exit_code, 0) << found.err;
  EXPECT_THAT(found.err, Not(HasSubstr("warning"))) << "the cache has it";
}

}  // namespace
}  // namespace legopt::service
