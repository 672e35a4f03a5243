#include "legopt/judge/solution_file.h"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cmath>
#include <csignal>
#include <limits>
#include <nlohmann/json.hpp>
#include <random>

#include "legopt/dataset/problem_definition.h"
#include "legopt/input/json.h"
#include "tests/dataset/test_data.h"

namespace legopt {
namespace {

using test::MessageOf;
using test::ReadText;
using test::WriteText;
using ::testing::AllOf;
using ::testing::HasSubstr;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

class SolutionFileTest : public testing::Test {
 protected:
  SolutionFile Read(const std::string& text) {
    WriteText(path_, text);
    return ReadSolutions(path_);
  }
  /// Reads a file with one problem and this `solution` list.
  SolutionFile ReadList(const std::string& solutions) {
    return Read(R"({"problems": [{"id": 4, "definition": ["l_foot,1 0 0 0 1 2 3 ,"], "solution": )" + solutions +
                "}]}");
  }
  std::string Message(const std::string& solutions) {
    return MessageOf([&] { ReadList(solutions); });
  }
  test::TemporaryFolder folder_;
  std::filesystem::path path_ = folder_.path() / "solutions.json";
};

TEST_F(SolutionFileTest, ReadsTheLegOptFormat) {
  const SolutionFile file = Read(R"({"robot": "atlas", "scenario": "garage", "task": "posture", "problems": [
    {"id": 4, "definition": ["l_foot,1 0 0 0 1 2 3 ,"], "solution": [
      {"method": "A", "timeSec": 1.5, "x": ["1\n2.5\n-3e-2\n"], "success": true, "initType": "nominal"},
      {"method": "B", "timeSec": 2, "x": [[1, 2, null], "nan 4"]}]},
    {"id": 5}]})");
  EXPECT_EQ(file.robot, "atlas");
  EXPECT_EQ(file.scenario, "garage");
  EXPECT_EQ(file.task, Task::kPosture);
  ASSERT_EQ(file.problems.size(), 2u);
  EXPECT_EQ(file.problems[0].definition.id, 4);
  EXPECT_EQ(file.problems[0].definition.stances.size(), 1u);
  EXPECT_TRUE(file.problems[1].definition.stances.empty());
  EXPECT_TRUE(file.problems[1].solutions.empty());
  const Solution& a = file.problems[0].solutions.at(0);
  EXPECT_EQ(a.method, "A");
  EXPECT_EQ(a.time_s, 1.5);
  EXPECT_EQ(a.waypoints.at(0), Eigen::Vector3d(1, 2.5, -0.03));
  EXPECT_EQ(a.success, true);
  EXPECT_EQ(a.init_type, "nominal");
  const Solution& b = file.problems[0].solutions.at(1);
  ASSERT_EQ(b.waypoints.size(), 2u);
  EXPECT_TRUE(std::isnan(b.waypoints[0][2]));
  EXPECT_TRUE(std::isnan(b.waypoints[1][0]));
  EXPECT_FALSE(b.success.has_value());
}

TEST_F(SolutionFileTest, TaskIsInferredWhenMissing) {
  EXPECT_EQ(ReadList("[]").task, Task::kPosture);
  EXPECT_EQ(Read(R"({"problems": [{"id": 0, "definition": ["f,1 0 0 0 0 0 0", "f,1 0 0 0 0 0 0"]}]})").task,
            Task::kMotion);
}

TEST_F(SolutionFileTest, FaultsNameProblemMethodAndKey) {
  EXPECT_THAT(Message(R"([{"timeSec": 1, "x": []}])"), HasSubstr("problem 4, solution 0, method: the key is missing"));
  EXPECT_THAT(Message(R"([{"method": "A", "timeSec": -1, "x": []}])"), HasSubstr("must not be negative"));
  EXPECT_THAT(Message(R"([{"method": "A", "x": []}])"), AllOf(HasSubstr("method 'A'"), HasSubstr("timeSec")));
  EXPECT_THAT(Message(R"([{"method": "A", "timeSec": "fast", "x": []}])"), HasSubstr("timeSec: must be a number"));
  EXPECT_THAT(Message(R"([{"method": "A", "timeSec": 1}])"), HasSubstr("x: the key is missing"));
  EXPECT_THAT(Message(R"([{"method": "A", "timeSec": 1, "x": "1 2"}])"), HasSubstr("list of waypoints"));
  EXPECT_THAT(Message(R"([{"method": "", "timeSec": 1, "x": []}])"), HasSubstr("method: must not be empty"));
  EXPECT_THAT(Message(R"([{"method": "A", "timeSec": 1, "x": []}, {"method": "A", "timeSec": 1, "x": []}])"),
              HasSubstr("two solutions"));
  EXPECT_THAT(MessageOf([&] { Read("{}"); }), HasSubstr("list of problems"));
  EXPECT_THAT(MessageOf([&] { Read("[1"); }), HasSubstr("not valid JSON"));
  EXPECT_THAT(MessageOf([&] { Read(R"({"problems": [{"id": 1e999}]})"); }),
              AllOf(HasSubstr("problems[0].id: must be an integer"), HasSubstr("1e999")));
  EXPECT_THAT(MessageOf([&] { ReadSolutions(folder_.path() / "none.json"); }), HasSubstr("cannot be read"));
}

// One solution with a bad number between two good ones: the good ones are read, the bad one is marked.
TEST_F(SolutionFileTest, ABadNumberSpoilsItsSolutionOnly) {
  struct Case {
    std::string waypoint;
    std::string described;
    double value;
  };
  const double inf = std::numeric_limits<double>::infinity();
  for (const Case& bad : {Case{R"("1\n1e400\n3")", "number 1 is '1e400', which no double holds", inf},
                          Case{R"("1\n-1e400\n3")", "number 1 is '-1e400', which no double holds", -inf},
                          Case{R"("1\n2x\n3")", "number 1 is '2x', not a number", kNan},
                          Case{R"("1 oops 3")", "number 1 is 'oops', not a number", kNan},
                          Case{R"([1, 1e400, 3])", "number 1 is '1e400', which no double holds", inf},
                          Case{R"([1, "2", 3])", "number 1 is '2', not a number", kNan},
                          Case{R"([1, {"a": [NaN]}, 3])", "number 1 is '{\"a\":[\"NaN\"]}', not a number", kNan},
                          Case{R"([1, true, 3])", "number 1 is 'true', not a number", kNan}}) {
    SCOPED_TRACE(bad.waypoint);
    const SolutionFile file = ReadList(R"([{"method": "A", "timeSec": 1, "x": ["1 2 3"]},
      {"method": "B", "timeSec": 1, "x": ["1 2 3", )" +
                                       bad.waypoint + R"(, "4 oops"]},
      {"method": "C", "timeSec": 1, "x": [[1, 2, 3]]}])");
    const std::vector<Solution>& solutions = file.problems.at(0).solutions;
    ASSERT_EQ(solutions.size(), 3u);
    EXPECT_FALSE(solutions[0].unreadable || solutions[2].unreadable);
    EXPECT_EQ(solutions[0].waypoints.at(0), Eigen::Vector3d(1, 2, 3));
    ASSERT_TRUE(solutions[1].unreadable);
    EXPECT_EQ(solutions[1].unreadable->Describe(), "waypoint 1: " + bad.described);
    ASSERT_EQ(solutions[1].waypoints.size(), 3u);
    ASSERT_EQ(solutions[1].waypoints[1].size(), 3);
    const double read = solutions[1].waypoints[1][1];
    EXPECT_TRUE(std::isnan(bad.value) ? std::isnan(read) : read == bad.value) << read;
    EXPECT_EQ(solutions[1].waypoints[1][2], 3);
  }
  const SolutionFile file = ReadList(R"([{"method": "A", "timeSec": 1, "x": ["1 2 3", {"q": 1}]}])");
  EXPECT_EQ(file.problems.at(0).solutions.at(0).unreadable->Describe(),
            R"(waypoint 1 is '{"q":1}', neither a text of numbers nor a list)");
}

// Same behaviour as Python's json module and all correct parsers of decimal numbers.
TEST_F(SolutionFileTest, NumbersBelowAllDoublesAreZeroAndNanStaysOne) {
  const SolutionFile file = ReadList(
      R"([{"method": "A, NaN \\ \" 1e400", "timeSec": 1, "x": ["1e-400 -1e-400 5e-324", [1e-400, NaN, -Infinity]]}])");
  const Solution& solution = file.problems.at(0).solutions.at(0);
  EXPECT_EQ(solution.method, "A, NaN \\ \" 1e400");
  EXPECT_FALSE(solution.unreadable) << solution.unreadable->Describe();
  EXPECT_EQ(solution.waypoints.at(0), Eigen::Vector3d(0, 0, 5e-324));
  EXPECT_EQ(solution.waypoints.at(1)[0], 0);
  EXPECT_TRUE(std::isnan(solution.waypoints.at(1)[1]));
  EXPECT_EQ(solution.waypoints.at(1)[2], -std::numeric_limits<double>::infinity());
}

TEST_F(SolutionFileTest, JointNamesComeBack) {
  SolutionFile file;
  file.joints = {"hip", "knee"};
  WriteSolutions(path_, file);
  EXPECT_EQ(ReadSolutions(path_).joints, file.joints);
  EXPECT_EQ(ReadSolutions(path_).path, path_.string());
  EXPECT_TRUE(ReadList("[]").joints.empty());
  for (const char* bad : {R"("hip")", "[]", R"(["hip", 3])"}) {
    EXPECT_THAT(MessageOf([&] { Read(std::string(R"({"problems": [], "joints": )") + bad + "}"); }),
                AllOf(HasSubstr("solutions.json: joints: must be a list of names"), HasSubstr("in the order of x")));
  }
}

// A limit on file sizes simulates a full disk. Runs in a child, since the limit applies to all files of a process.
TEST_F(SolutionFileTest, AFullDiskLeavesTheOldFileAndNothingElse) {
  SolutionFile file;
  file.problems.push_back({.definition = {.id = 0, .stances = {}}, .solutions = {}});
  file.problems[0].solutions.push_back({.method = "m", .time_s = 1, .waypoints = {Eigen::VectorXd::Ones(50'000)}});
  WriteText(path_, "old");
  const pid_t child = fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    constexpr rlim_t kBytes = 1000;
    const rlimit limit = {kBytes, kBytes};
    std::signal(SIGXFSZ, SIG_IGN);
    setrlimit(RLIMIT_FSIZE, &limit);
    try {
      WriteSolutions(path_, file);
    } catch (const InputError&) {
      _exit(0);
    }
    _exit(1);
  }
  int status = 0;
  ASSERT_EQ(waitpid(child, &status, 0), child);
  EXPECT_EQ(status, 0) << "no InputError";
  EXPECT_EQ(ReadText(path_), "old");
  const std::filesystem::directory_iterator entries(folder_.path());
  EXPECT_EQ(std::distance(begin(entries), end(entries)), 1) << "something is left beside the file";
}

TEST_F(SolutionFileTest, RoundTripKeepsEveryBit) {
  std::mt19937_64 generator(1);
  SolutionFile file{.robot = "atlas", .scenario = "garage", .task = Task::kMotion, .problems = {}};
  for (int id = 0; id < 3; ++id) {
    const Stance stance = ParseStance("l_foot,0.6 0 0 0.8 0.1 0.2 0.3 ,", {.file = "", .field = ""});
    SolvedProblem problem{.definition = {.id = id, .stances = {stance, stance}}, .solutions = {}};
    for (const char* method : {"SQP", "I-SQP, 80%"}) {
      Solution solution{.method = method, .time_s = 0.1 * id, .waypoints = {}, .success = id == 1, .init_type = "good"};
      for (int w = 0; w < 4; ++w) {
        Eigen::VectorXd x(36);
        for (double& value : x) {
          value = std::ldexp(static_cast<double>(generator() >> 11), -50 - static_cast<int>(generator() % 40));
        }
        x[0] = -0.0;
        x[1] = 5e-324;
        solution.waypoints.push_back(x);
      }
      problem.solutions.push_back(solution);
    }
    file.problems.push_back(problem);
  }
  WriteSolutions(path_, file);
  const SolutionFile copy = ReadSolutions(path_);
  EXPECT_EQ(copy.task, file.task);
  ASSERT_EQ(copy.problems.size(), file.problems.size());
  for (size_t p = 0; p < file.problems.size(); ++p) {
    EXPECT_TRUE(copy.problems[p].definition == file.problems[p].definition);
    ASSERT_EQ(copy.problems[p].solutions.size(), 2u);
    for (size_t s = 0; s < 2; ++s) {
      const Solution& a = file.problems[p].solutions[s];
      const Solution& b = copy.problems[p].solutions[s];
      EXPECT_EQ(b.method, a.method);
      EXPECT_EQ(b.time_s, a.time_s);
      EXPECT_EQ(b.success, a.success);
      EXPECT_EQ(b.init_type, a.init_type);
      ASSERT_EQ(b.waypoints.size(), 4u);
      for (size_t w = 0; w < 4; ++w) {
        EXPECT_EQ(0, std::memcmp(a.waypoints[w].data(), b.waypoints[w].data(), 36 * sizeof(double)));
      }
    }
  }
  WriteSolutions(folder_.path() / "again.json", copy);
  EXPECT_EQ(ReadText(folder_.path() / "again.json"), ReadText(path_));
}

TEST_F(SolutionFileTest, NonFiniteNumbersSurvive) {
  SolutionFile file;
  const double inf = std::numeric_limits<double>::infinity();
  file.problems.push_back({.definition = {.id = 0, .stances = {}}, .solutions = {}});
  file.problems[0].solutions.push_back({.method = "m",
                                        .time_s = std::nan(""),
                                        .waypoints = {Eigen::Vector3d(std::nan(""), inf, -inf)},
                                        .success = {},
                                        .init_type = {}});
  WriteSolutions(path_, file);
  const SolutionFile copy = ReadSolutions(path_);
  const Solution& solution = copy.problems[0].solutions[0];
  EXPECT_TRUE(std::isnan(solution.time_s));
  EXPECT_TRUE(std::isnan(solution.waypoints[0][0]));
  EXPECT_EQ(solution.waypoints[0][1], inf);
  EXPECT_EQ(solution.waypoints[0][2], -inf);
}

TEST_F(SolutionFileTest, WritesTextsOfNewlineSeparatedNumbers) {
  SolutionFile file;
  file.problems.push_back({.definition = {.id = 0, .stances = {}}, .solutions = {}});
  file.problems[0].solutions.push_back(
      {.method = "m", .time_s = 1, .waypoints = {Eigen::Vector2d(0.1, -2)}, .success = {}, .init_type = {}});
  WriteSolutions(path_, file);
  EXPECT_EQ(ReadJsonFile(path_)["problems"][0]["solution"][0]["x"][0], "0.1\n-2");
  EXPECT_THAT(MessageOf([&] { WriteSolutions("/nonexistent/out.json", file); }), HasSubstr("cannot be written"));
}

TEST_F(SolutionFileTest, LinksAreFollowedAndStay) {
  const SolutionFile file;
  const std::filesystem::path existing = folder_.path() / "existing.json";
  WriteText(existing, "old");
  std::filesystem::create_symlink("existing.json", folder_.path() / "link.json");
  std::filesystem::create_symlink("absent.json", folder_.path() / "dangling.json");
  for (const auto& [link, target] : {std::pair("link.json", "existing.json"), {"dangling.json", "absent.json"}}) {
    WriteSolutions(folder_.path() / link, file);
    EXPECT_TRUE(std::filesystem::is_symlink(folder_.path() / link)) << link;
    EXPECT_TRUE(std::filesystem::is_regular_file(folder_.path() / target)) << target;
    EXPECT_EQ(ReadText(folder_.path() / target), FormatSolutions(file));
  }
}

TEST_F(SolutionFileTest, WhatIsNoRegularFileIsWrittenIntoAndStays) {
  const SolutionFile file;
  const std::filesystem::path pipe = folder_.path() / "pipe";
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  const int reader = open(pipe.c_str(), O_RDONLY | O_NONBLOCK);
  ASSERT_GE(reader, 0);
  std::filesystem::create_symlink(pipe, folder_.path() / "link");
  WriteSolutions(folder_.path() / "link", file);
  std::string text(4096, '\0');
  text.resize(static_cast<size_t>(std::max<ssize_t>(0, read(reader, text.data(), text.size()))));
  close(reader);
  EXPECT_EQ(text, FormatSolutions(file));
  EXPECT_TRUE(std::filesystem::is_fifo(pipe));
  EXPECT_TRUE(std::filesystem::is_symlink(folder_.path() / "link"));
  EXPECT_THAT(MessageOf([&] { WriteSolutions(folder_.path(), file); }), HasSubstr("cannot be written"));
}

}  // namespace
}  // namespace legopt
