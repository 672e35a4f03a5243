// Policy: `legopt run` produces a judged table by one command, always ends all its processes, and resumes an
// interrupted run.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sched.h>
#include <signal.h>
#include <sys/mount.h>
#include <sys/wait.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <memory>
#include <nlohmann/json.hpp>

#include "app/data_folder.h"
#include "bus/endpoint.h"
#include "bus/lcm_transport.h"
#include "client/report/result_source.h"
#include "client/service/managed_pool.h"
#include "program_run.h"
#include "test_database.h"

namespace legopt::client {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

class RunCommand : public testing::Test {
 protected:
  void SetUp() override {
    for (const char* program : {"legopt-server", "legopt-worker"}) {
      if (!std::filesystem::exists(BuiltProgram(program))) GTEST_SKIP() << program << " is not built";
    }
    if (!bus::ProbeMulticastRoute(bus::LcmOptions{}.group).usable) GTEST_SKIP() << "no multicast route here";
  }

  std::string Suite(int repetitions) {
    const auto file = folder_.path() / "small.yaml";
    std::ofstream(file)
        << "tasks: posture\nproblems: [0-2]\nmethods: [{solver: sqp}]\nlimits: {wall_time_s: 20}\nrepetitions: "
        << repetitions << "\n";
    return file.string();
  }

  ProgramResult Run(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), "run");
    return RunLegopt(arguments, folder_.path());
  }

  std::int64_t Count(const std::string& sql) {
    return OpenResults({Db(), {}})->Query("SELECT count(*) AS n FROM " + sql).At(0, "n").get<std::int64_t>();
  }

  virtual std::string Db() const { return (folder_.path() / "run.sqlite").string(); }

  TemporaryFolder folder_;
};

TEST_F(RunCommand, EndsWithTheTable) {
  const auto result = Run({Suite(1), "--db", Db(), "--format", "json"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const auto table = nlohmann::json::parse(result.out);
  EXPECT_EQ(table.at("jobs"), 6);
  EXPECT_EQ(table.at("finished"), 6);
  EXPECT_THAT(result.err, AllOf(HasSubstr("6 of 6 jobs"), HasSubstr("legopt table 1 --db")));
  EXPECT_EQ(Count("results"), 6);
}

TEST_F(RunCommand, ItsTableTakesTheOptionsOfTable) {
  const std::vector<std::string> options = {"--time-unit", "s", "--width", "50", "--color", "always"};
  std::vector<std::string> run = {Suite(1), "--db", Db()}, table = {"table", "1", "--db", Db(), "--no-pager"};
  run.insert(run.end(), options.begin(), options.end());
  table.insert(table.end(), options.begin(), options.end());
  const auto ran = Run(run);
  ASSERT_EQ(ran.exit_code, 0) << ran.err;
  EXPECT_EQ(ran.out, "\n" + RunLegopt(table, folder_.path()).out);
  EXPECT_THAT(ran.out, AllOf(HasSubstr("\033["), HasSubstr("Time (s)")));
}

// The server's key exists in memory only: no other program can talk to the server, and the key is never printed.
TEST_F(RunCommand, OtherProgramsCannotControlIt) {
  const std::string port = std::to_string(bus::FindFreePortPair(bus::RandomSeed()));
  RunningProgram program(BuiltProgram("legopt"),
                         std::vector<std::string>{"run", Suite(300), "--db", Db(), "--port", port}, folder_.path());
  ASSERT_TRUE(program.WaitForError("Ctrl-C stops"));
  for (const std::vector<std::string>& command : {std::vector<std::string>{"status"}, {"cancel", "1"}}) {
    std::vector<std::string> arguments = command;
    arguments.insert(arguments.end(), {"--port", port, "--timeout", "5"});
    const auto refused = RunLegopt(arguments, folder_.path());
    EXPECT_EQ(refused.exit_code, 2);
    EXPECT_THAT(refused.err, HasSubstr("this deployment uses a key"));
  }
  for (const char* child : {"legopt-server", "legopt-worker"}) {
    for (const pid_t pid : WaitForChildren(program.pid(), child)) {
      for (const char* file : {"cmdline", "environ"}) {
        std::ifstream stream("/proc/" + std::to_string(pid) + "/" + file, std::ios::binary);
        const std::string text{std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
        EXPECT_THAT(text, Not(testing::ContainsRegex("[0-9a-f]{64}"))) << child << " " << file;
        if (std::string(file) == "cmdline") {
          EXPECT_THAT(text, HasSubstr("/dev/fd/"));
        }
      }
    }
  }
  ::kill(program.pid(), SIGINT);
  EXPECT_EQ(program.Wait().exit_code, 8);
}

// A namespace like a container without network: only loopback is up.
TEST_F(RunCommand, NeedsNoRouteForTheGroup) {
  for (const char* options : {"-n", "-rn"}) {
    if (std::system(("unshare " + std::string(options) + " true 2>/dev/null").c_str()) != 0) continue;
    const std::string script = "ip link set lo up && exec \"$0\" \"$@\"";
    RunningProgram program(
        "/usr/bin/unshare",
        {options, "sh", "-c", script, BuiltProgram("legopt").string(), "run", Suite(1), "--db", Db()}, folder_.path());
    const auto result = program.Wait();
    EXPECT_EQ(result.exit_code, 0) << result.err;
    EXPECT_EQ(Count("results"), 6);
    return;
  }
  GTEST_SKIP() << "NOT TESTED: 'unshare -n' and 'unshare -rn' are refused here";
}

TEST_F(RunCommand, NamesTheDatabaseAfterSuiteAndTime) {
  ASSERT_EQ(Run({Suite(1)}).exit_code, 0);
  int databases = 0;
  for (const auto& entry : std::filesystem::directory_iterator(folder_.path())) {
    const auto name = entry.path().filename().string();
    if (name.rfind("small-20", 0) == 0 && entry.path().extension() == ".sqlite") ++databases;
  }
  EXPECT_EQ(databases, 1);
}

TEST_F(RunCommand, TheSameContentIsNotComputedTwice) {
  ASSERT_EQ(Run({Suite(1), "--db", Db()}).exit_code, 0);
  const auto attempts = Count("attempts");
  const auto again = Run({Suite(1), "--db", Db()});
  EXPECT_EQ(again.exit_code, 0) << again.err;
  EXPECT_THAT(again.err, HasSubstr("in the database already"));
  EXPECT_EQ(Count("experiments"), 1);
  EXPECT_EQ(Count("results"), 6);
  EXPECT_EQ(Count("attempts"), attempts);
  ASSERT_EQ(Run({Suite(1), "--db", Db(), "--again"}).exit_code, 0);
  EXPECT_EQ(Count("experiments"), 2);
}

// With one more method and another name, known results are reused bit by bit, and their number is reported.
TEST_F(RunCommand, OverlappingSuiteReusesResults) {
  ASSERT_EQ(Run({Suite(1), "--db", Db()}).exit_code, 0);
  const auto larger = (folder_.path() / "larger.yaml").string();
  std::ofstream(larger) << "tasks: posture\nproblems: [0-3]\nmethods: [{solver: sqp}, {solver: sqp, multi_starts: 1}]\n"
                           "limits: {wall_time_s: 25}\n";
  const auto dry = Run({larger, "--db", Db(), "--dry-run"});
  EXPECT_THAT(dry.out, HasSubstr("6 of 16 jobs have a finished result of build "));
  const auto dry_json = nlohmann::json::parse(Run({larger, "--db", Db(), "--dry-run", "--format", "json"}).out);
  EXPECT_EQ(dry_json.at("known_results").at("builds").at(0).at("jobs"), 6);
  const auto result = Run({larger, "--db", Db(), "--format", "json"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const auto table = nlohmann::json::parse(result.out);
  EXPECT_EQ(table.at("finished"), 16);
  EXPECT_EQ(table.at("taken_over"), 6);
  EXPECT_THAT(result.err, HasSubstr("6 reused"));
  EXPECT_EQ(Count("jobs WHERE taken_from IS NOT NULL"), 6);
  EXPECT_EQ(Count("attempts"), 6 + 16);
  const std::string same = "jobs AS j JOIN results AS r USING (job_id) JOIN results AS s ON s.job_id = j.taken_from ";
  EXPECT_EQ(Count(same + "WHERE s.wall_us = r.wall_us AND s.cost = r.cost AND s.trace = r.trace"), 6);
  const auto source = OpenResults({Db(), {}});
  const std::string job =
      source->Query("SELECT min(job_id) AS job FROM jobs WHERE taken_from IS NOT NULL").At(0, "job").dump();
  const auto shown =
      nlohmann::json::parse(RunLegopt({"show", job, "--db", Db(), "--format", "json"}, folder_.path()).out);
  EXPECT_TRUE(shown.at("taken_from").is_number());
  EXPECT_EQ(RunLegopt({"replay", job, "--db", Db()}, folder_.path()).exit_code, 0) << "the same bits";
  EXPECT_THAT(RunLegopt({"table", "2", "--db", Db(), "--statistics"}, folder_.path()).out,
              HasSubstr("6 results were reused"));
  EXPECT_THAT(RunLegopt({"compare", "1", "2", "--db", Db()}, folder_.path()).out,
              HasSubstr("reused from other experiments"));
  EXPECT_EQ(RunLegopt({"service", "doctor", "--db", Db()}, folder_.path()).exit_code, 0);
  EXPECT_THAT(Run({larger, "--db", Db(), "--dry-run"}).out, HasSubstr("submitted before, as 2"));
  EXPECT_THAT(Run({larger, "--db", Db(), "--dry-run", "--again"}).out, HasSubstr("all jobs are solved again"));
  ASSERT_EQ(Run({larger, "--db", Db(), "--again"}).exit_code, 0);
  EXPECT_EQ(Count("jobs WHERE taken_from IS NOT NULL"), 6);
}

TEST_F(RunCommand, ExportAndEvaluateAgree) {
  ASSERT_EQ(Run({Suite(1), "--db", Db()}).exit_code, 0);
  const auto exported = RunLegopt({"export", "1", "--db", Db(), "--out", "out.json"}, folder_.path());
  ASSERT_EQ(exported.exit_code, 0) << exported.err;
  const auto streamed = RunLegopt({"export", "1", "--db", Db(), "--out", "-"}, folder_.path());
  ASSERT_EQ(streamed.exit_code, 0) << streamed.err;
  EXPECT_EQ(nlohmann::json::parse(streamed.out), nlohmann::json::parse(std::ifstream(folder_.path() / "out.json")));
  EXPECT_FALSE(std::filesystem::exists(folder_.path() / "-"));
  const auto judged = RunLegopt({"evaluate", "out.json", "--format", "json"}, folder_.path());
  ASSERT_EQ(judged.exit_code, 0) << judged.err;
  const auto report = nlohmann::json::parse(judged.out);
  EXPECT_EQ(report.at("solutions").size(), 6U);
  EXPECT_TRUE(report.at("warnings").empty()) << report.at("warnings");
  std::int64_t solved = 0;
  for (const auto& method : report.at("methods")) solved += method.at("solved").get<std::int64_t>();
  EXPECT_EQ(solved, Count("results WHERE verdict_literal = 'success'"));
}

// The file alone is the complete result, even on a machine without the dataset's folder.
TEST_F(RunCommand, AResultCarriesItsDataset) {
  ::setenv("XDG_CACHE_HOME", folder_.path().c_str(), 1);  // the user's cache must not affect the test
  const auto dataset = folder_.path() / "mine";
  std::filesystem::copy(app::DataFolder() / "garage-small", dataset);
  ASSERT_EQ(Run({Suite(1), "--dataset", "mine", "--db", Db()}).exit_code, 0);
  ASSERT_EQ(Run({Suite(1), "--dataset", "mine", "--db", "bare.sqlite", "--no-dataset"}).exit_code, 0);
  EXPECT_EQ(RunLegopt({"replay", "1", "--db", "bare.sqlite"}, folder_.path()).exit_code, 0)
      << "the submission's folder";
  const auto moved = folder_.path() / "moved";
  std::filesystem::rename(dataset, moved);
  std::filesystem::copy(app::DataFolder() / "garage-easier", dataset);
  EXPECT_EQ(RunLegopt({"replay", "1", "--db", "bare.sqlite"}, folder_.path()).exit_code, 5) << "another dataset there";
  std::filesystem::remove_all(dataset);
  EXPECT_EQ(Count("dataset_archives"), 1);
  for (const std::vector<std::string>& command : {std::vector<std::string>{"export", "1", "--out", "out.json"},
                                                  {"replay", "1"},
                                                  {"view", "1", "--out", "v.html"}}) {
    auto arguments = command;
    arguments.insert(arguments.end(), {"--db", Db()});
    const auto whole = RunLegopt(arguments, folder_.path());
    EXPECT_EQ(whole.exit_code, 0) << command.front() << ": " << whole.err;
    arguments.back() = "bare.sqlite";
    EXPECT_EQ(RunLegopt(arguments, folder_.path()).exit_code, 5) << command.front();
    arguments.insert(arguments.end(), {"--dataset", "garage-small"});
    EXPECT_EQ(RunLegopt(arguments, folder_.path()).exit_code, 0) << command.front() << " with an embedded name";
  }
  const auto report = RunLegopt({"report", "--db", Db(), "--out", "r.html"}, folder_.path());
  EXPECT_EQ(report.exit_code, 0) << report.err;
  EXPECT_THAT(report.err, Not(HasSubstr("was not found")));
}

// The name of a dataset in LegOpt's format is that of its folder; the stored one must be called the same.
TEST_F(RunCommand, AFolderInLegOptsFormatKeepsItsName) {
  ::setenv("XDG_CACHE_HOME", folder_.path().c_str(), 1);
  const auto dataset = folder_.path() / "walker";
  const auto garage = app::DataFolder() / "garage-small";
  std::filesystem::create_directories(dataset / "robot");
  std::filesystem::copy(garage / "robot.urdf", dataset / "robot");
  std::filesystem::copy(garage / "problems-posture.json", dataset / "problemsposture.json");
  std::filesystem::copy(app::DataFolder() / "biped" / "scene.obj", dataset);
  const auto run = Run({Suite(1), "--dataset", "walker", "--db", Db()});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  std::filesystem::remove_all(dataset);
  const auto exported = [&] {
    const auto result = RunLegopt({"export", "1", "--db", Db(), "--out", "-"}, folder_.path());
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return result.out;
  };
  const std::string first = exported();
  EXPECT_EQ(nlohmann::json::parse(first).at("scenario"), "walker");
  EXPECT_EQ(exported(), first);
}

TEST_F(RunCommand, AFullStandardOutputIsOneFaultWhateverTheCommand) {
  if (!std::filesystem::exists("/dev/full")) GTEST_SKIP() << "no /dev/full here";
  ASSERT_EQ(Run({Suite(1), "--db", Db()}).exit_code, 0);
  const auto into_full = [&](const std::string& arguments) {
    const std::string command = "'" + BuiltProgram("legopt").string() + "' " + arguments + " --db '" + Db() +
                                "' > /dev/full 2> '" + (folder_.path() / "err.txt").string() + "'";
    const int status = std::system(command.c_str());
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  };
  const int of_table = into_full("table 1");
  EXPECT_NE(of_table, 0);
  EXPECT_EQ(into_full("export 1 --out -"), of_table);
  std::ifstream stream(folder_.path() / "err.txt");
  const std::string err(std::istreambuf_iterator<char>(stream), {});
  EXPECT_THAT(err, AllOf(HasSubstr("standard output"), Not(HasSubstr("problems written"))));
}

TEST_F(RunCommand, InterruptedItKeepsWhatIsDoneAndGoesOnLater) {
  const int kRepetitions = 500;
  const auto suite = Suite(kRepetitions);
  {
    RunningProgram program(BuiltProgram("legopt"), {"run", suite, "--db", Db()}, folder_.path());
    ASSERT_TRUE(program.WaitForError("Ctrl-C stops"));
    ::kill(program.pid(), SIGINT);
    const auto result = program.Wait();
    EXPECT_EQ(result.exit_code, 8) << result.err;
    EXPECT_THAT(result.err, HasSubstr("To go on"));
    EXPECT_THAT(result.out, HasSubstr("left)"));
  }
  const auto done = Count("results");
  EXPECT_LT(done, 6 * kRepetitions);
  const auto result = Run({suite, "--db", Db()});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(Count("experiments"), 1);
  EXPECT_EQ(Count("results"), 6 * kRepetitions);
}

TEST_F(RunCommand, KilledChildrenAreStartedAgain) {
  const int kRepetitions = 300;
  RunningProgram program(BuiltProgram("legopt"), {"run", Suite(kRepetitions), "--db", Db()}, folder_.path());
  ASSERT_TRUE(program.WaitForError("Ctrl-C stops"));
  for (const char* name : {"legopt-worker", "legopt-server"}) {
    const auto children = WaitForChildren(program.pid(), name);
    ASSERT_EQ(children.size(), 1U) << name;
    ::kill(children[0], SIGKILL);
    ASSERT_TRUE(program.WaitForError(std::string(name) + " ended with signal 9"));
  }
  const auto result = program.Wait();
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(Count("results"), 6 * kRepetitions);
}

TEST_F(RunCommand, SignalsOfOthersToItsChildrenChangeNothing) {
  RunningProgram program(BuiltProgram("legopt"), {"run", Suite(200), "--db", Db()}, folder_.path());
  ASSERT_TRUE(program.WaitForError("Ctrl-C stops"));
  for (const char* name : {"legopt-worker", "legopt-server"}) {
    const auto children = WaitForChildren(program.pid(), name);
    ASSERT_EQ(children.size(), 1U) << name;
    ::kill(children[0], SIGTERM);
  }
  const auto result = program.Wait();
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.err, HasSubstr("1200 of 1200 jobs"));
}

TEST_F(RunCommand, KilledItLeavesNoProcessBehind) {
  std::vector<int> children;
  {
    RunningProgram program(BuiltProgram("legopt"), {"run", Suite(500), "--db", Db()}, folder_.path());
    ASSERT_TRUE(program.WaitForError("Ctrl-C stops"));
    for (const char* name : {"legopt-worker", "legopt-server"}) {
      for (const int pid : WaitForChildren(program.pid(), name)) children.push_back(pid);
    }
    ASSERT_EQ(children.size(), 2U);
    ::kill(program.pid(), SIGKILL);
  }
  for (const int pid : children) WaitForEnd(pid);
}

TEST_F(RunCommand, CommandsItPrintsNameTheDataset) {
  std::filesystem::copy(app::DefaultDatasetFolder(), folder_.path() / "my data",
                        std::filesystem::copy_options::recursive);
  const auto result = Run({Suite(1), "--db", Db(), "--dataset", "my data"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.err, HasSubstr("--dataset '" + (folder_.path() / "my data").string() + "' --out"));
  EXPECT_THAT(Run({Suite(1), "--db", Db()}).err, Not(HasSubstr("--dataset")));
}

// A small disk, visible to this process and its children, which a file fills. Only root can mount one.
class SmallDisk {
 public:
  explicit SmallDisk(std::filesystem::path folder) : folder_(std::move(folder)) {
    std::filesystem::create_directory(folder_);
    mounted_ = ::unshare(CLONE_NEWNS) == 0 && ::mount("none", "/", nullptr, MS_REC | MS_PRIVATE, nullptr) == 0 &&
               ::mount("none", folder_.c_str(), "tmpfs", 0, "size=64m") == 0;
  }
  ~SmallDisk() {
    if (mounted_) ::umount2(folder_.c_str(), MNT_DETACH);
  }
  SmallDisk(const SmallDisk&) = delete;
  SmallDisk& operator=(const SmallDisk&) = delete;
  bool mounted() const { return mounted_; }
  void Fill() {
    const std::string block(std::size_t{1} << 16U, 'x');
    std::ofstream file(Filler(), std::ios::binary);
    while (file.write(block.data(), static_cast<std::streamsize>(block.size())).flush()) {
    }
  }
  void Free() { std::filesystem::remove(Filler()); }

 private:
  std::filesystem::path Filler() const { return folder_ / "filler"; }
  std::filesystem::path folder_;
  bool mounted_ = false;
};

class RunOnAFullDisk : public RunCommand {
 protected:
  void SetUp() override {
    RunCommand::SetUp();
    if (IsSkipped()) return;
    disk_ = std::make_unique<SmallDisk>(folder_.path() / "disk");
    if (!disk_->mounted()) GTEST_SKIP() << "NOT TESTED: a small disk can only be mounted by root";
    program_ = std::make_unique<RunningProgram>(
        BuiltProgram("legopt"), std::vector<std::string>{"run", Suite(kRepetitions), "--db", "disk/run.sqlite"},
        folder_.path());
    ASSERT_TRUE(program_->WaitForError("Ctrl-C stops"));
    disk_->Fill();
    ASSERT_TRUE(program_->WaitForError("cannot write its database"));
    ASSERT_TRUE(program_->WaitForError("the database cannot be written")) << "plain lines say it, too";
  }

  static constexpr int kRepetitions = 500;
  std::string Db() const override { return (folder_.path() / "disk" / "run.sqlite").string(); }

  std::unique_ptr<SmallDisk> disk_;
  std::unique_ptr<RunningProgram> program_;
};

TEST_F(RunOnAFullDisk, SaysSoAndGoesOnWhenThereIsSpaceAgain) {
  disk_->Free();
  ASSERT_TRUE(program_->WaitForError("writes its database again"));
  const auto result = program_->Wait();
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.err, HasSubstr("the database cannot be written"));
  EXPECT_EQ(Count("results"), 6 * kRepetitions);
}

TEST_F(RunOnAFullDisk, InterruptedItHasTheExitCodeOfAnUnusableDatabase) {
  ::kill(program_->pid(), SIGINT);
  const auto result = program_->Wait();
  EXPECT_EQ(result.exit_code, 6) << result.err;
  EXPECT_THAT(result.err, HasSubstr("free space on the disk"));
}

TEST_F(RunCommand, CorruptSceneMeshIsNamedBeforeAnythingIsStored) {
  const auto dataset = folder_.path() / "broken";
  std::filesystem::create_directories(dataset);
  for (const char* file : {"robot.urdf", "problems-posture.json"}) {
    std::filesystem::copy(app::DefaultDatasetFolder() / file, dataset / file);
  }
  std::ofstream(dataset / "hall.stl") << std::string(300, 'x');
  std::ofstream(dataset / "scene.yaml") << "objects:\n- {name: hall, shape: mesh, file: hall.stl}\n";
  std::ifstream original(app::DefaultDatasetFolder() / "dataset.yaml");
  std::ofstream copy(dataset / "dataset.yaml");
  for (std::string line; std::getline(original, line) && line.rfind("files:", 0) != 0;) {
    if (line.rfind("scene:", 0) == 0) line = "scene: scene.yaml";
    if (line.find("motion") == std::string::npos) copy << line << "\n";
  }
  copy.close();
  RunLegopt({"dataset", "hash", dataset.string()}, folder_.path());
  const auto result = Run({Suite(1), "--db", Db(), "--dataset", dataset.string()});
  EXPECT_EQ(result.exit_code, 2) << result.err;
  EXPECT_THAT(result.err, AllOf(HasSubstr("hall.stl"), HasSubstr("scene object 'hall'")));
  EXPECT_FALSE(std::filesystem::exists(Db()));
  const auto doctor = RunLegopt({"service", "doctor", "--dataset", dataset.string()}, folder_.path());
  EXPECT_EQ(doctor.exit_code, 2);
  EXPECT_THAT(doctor.out, HasSubstr("hall.stl"));
}

TEST(LastErrorMessage, AnErrorComesBeforeWhatFollowsFromIt) {
  const std::string stamp = "[2026-11-21 14:00:00.000] [legopt-worker] ";
  EXPECT_EQ(
      LastErrorMessage("legopt-worker", stamp + "[error] x.stl: no triangles\n" + stamp + "[warning] slot 1: exited"),
      "x.stl: no triangles");
  EXPECT_EQ(LastErrorMessage("legopt-worker", stamp + "[warning] slot 1: exited"), "");
  EXPECT_EQ(LastErrorMessage("legopt-worker", stamp + "[warning] no key\nlegopt-worker: 2 slots"), "");
  EXPECT_EQ(LastErrorMessage("legopt-worker", "error: of another program"), "");
  EXPECT_EQ(LastErrorMessage("legopt-worker", stamp + "[warning] [legopt-worker] [error] quoted"), "");
  EXPECT_EQ(LastErrorMessage("legopt-worker", stamp + "[error] [legopt-worker] [error] twice"),
            "[legopt-worker] [error] twice");
  EXPECT_EQ(LastErrorMessage("legopt-server", "legopt-server: error: a [b] c"), "a [b] c");
  EXPECT_EQ(LastErrorMessage("legopt-server", ""), "");
}

TEST_F(RunCommand, UnwritableDatabase) {
  const auto result = Run({Suite(1), "--db", "/nowhere/results.sqlite"});
  EXPECT_EQ(result.exit_code, 6) << result.err;
  EXPECT_THAT(result.err, AllOf(HasSubstr("legopt: error: "), HasSubstr("/nowhere")));
}

}  // namespace
}  // namespace legopt::client
