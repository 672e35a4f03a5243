// The protocol over a channel in memory: messages to a solver, messages it may send, and the cost of each violation.

#include "worker/external/external_solver.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <deque>
#include <limits>
#include <random>
#include <thread>

#include "tests/solvers/analytic_program.h"
#include "tests/worker/external/scripted_channel.h"

namespace legopt::external {
namespace {

using Eigen::Vector2d;
using Eigen::VectorXd;
using nlohmann::json;
using ::testing::HasSubstr;
using ::testing::SizeIs;

constexpr char kHello[] = R"({"type":"hello","protocol":1,"name":"played","version":"1"})";

/// Nearest point to (2, 1) with x0 + x1 = 1 and x0 <= 0.5, within [-3, 3]: (0.5, 0.5).
class Nearest : public AnalyticProgram {
 public:
  Nearest() : AnalyticProgram(Vector2d(-3.0, -3.0), Vector2d(3.0, 3.0)) {
    Add(TermKind::kCost, [](const VectorXd& x) { return VectorXd(x - Vector2d(2.0, 1.0)); });
    Add(TermKind::kEquality, [](const VectorXd& x) { return One(x[0] + x[1] - 1.0); });
    Add(TermKind::kInequality, [](const VectorXd& x) { return One(x[0] - 0.5); });
  }
};

ScriptedChannel::Line Say(std::string line) {
  return [line = std::move(line)](const json&) { return line; };
}

std::string Ask(const std::vector<double>& x, bool gradients = false) {
  return json{{"type", "evaluate"}, {"id", 7}, {"x", x}, {"gradients", gradients}}.dump();
}

std::string End(const std::vector<double>& x, const std::string& status = "converged") {
  return json{{"type", "solution"}, {"x", x}, {"status", status}}.dump();
}

class ExternalSolverTest : public ::testing::Test {
 protected:
  /// Runs a scripted solver on `program` from x_.
  SolverResult Solve(AnalyticProgram& program, std::deque<ScriptedChannel::Line> script, bool ends = false) {
    ExternalSolver solver(
        {.declaration = std::string(64, '0'), .budget_s = budget_s_},
        {.name = "played", .settings = {{"ftol", 1e-6}}, .silence_s = silence_s_, .cancel_grace_s = cancel_grace_s_},
        [&] {
          ++starts_;
          return std::make_unique<ScriptedChannel>(script, &heard_, ends);
        });
    SolverResult result;
    for (int i = 0; i < solves_; ++i) result = solver.Solve(program, x_, context_);
    return result;
  }

  /// Returns the reason for which a scripted solve is aborted.
  std::string FaultOf(std::deque<ScriptedChannel::Line> script, bool ends = false) {
    Nearest program;
    try {
      Solve(program, std::move(script), ends);
    } catch (const SolverFault& fault) {
      return fault.what();
    }
    return "none";
  }

  VectorXd x_ = Vector2d(0.0, 0.0);
  SolverContext context_;
  std::vector<json> heard_;
  double silence_s_ = 5.0, cancel_grace_s_ = 0.02, budget_s_ = 0.0;
  int starts_ = 0, solves_ = 1;
};

TEST_F(ExternalSolverTest, TellsTheWholeProgram) {
  Nearest program;
  program.AddShaped({"wish", TermKind::kPreference, 0, 1, -1, 4.0}, [](const VectorXd& x) { return One(x[1]); });
  std::mt19937_64 generator(5);
  context_.generator = &generator;
  const std::uint64_t seed = std::mt19937_64(5)() >> 11;
  Solve(program, {Say(kHello), Say(End({0.5, 0.5}))});
  ASSERT_THAT(heard_, SizeIs(1));
  EXPECT_EQ(heard_[0], (json{{"type", "solve"},
                             {"protocol", 1},
                             {"variables", 2},
                             {"waypoints", 1},
                             {"lower", {-3.0, -3.0}},
                             {"upper", {3.0, 3.0}},
                             {"rows",
                              {{{"kind", "equality"}, {"first", 0}, {"size", 2}},
                               {{"kind", "inequality"}, {"first", 0}, {"size", 2}},
                               {{"kind", "preference"}, {"first", 0}, {"size", 2}, {"weight", 4.0}}}},
                             {"round", 0},
                             {"seed", seed},
                             {"tolerance", 1e-4},
                             {"settings", {{"ftol", 1e-6}}}}));
}

TEST_F(ExternalSolverTest, HasNoBoundsAsNull) {
  AnalyticProgram program = Plane();
  program.Add(TermKind::kCost, [](const VectorXd& x) { return x; });
  Solve(program, {Say(kHello), Say(End({0, 0}))});
  EXPECT_EQ(heard_.at(0)["lower"], (json{nullptr, nullptr}));
  EXPECT_EQ(heard_.at(0)["upper"], (json{nullptr, nullptr}));
}

TEST_F(ExternalSolverTest, AnswersWithValuesAndDerivatives) {
  Nearest program;
  x_ = Vector2d(1.0, -1.0);
  json answer;
  Solve(program, {Say(kHello), Say(Ask({1.0, 1.0}, true)), [&](const json& heard) {
                    answer = heard;
                    return End({0, 0}, "limit");
                  }});
  // At (2, 0): cost 0 + 1, equality 1, inequality 1.5.
  EXPECT_EQ(answer["type"], "evaluation");
  EXPECT_EQ(answer["id"], 7);
  EXPECT_EQ(answer["finite"], true);
  EXPECT_DOUBLE_EQ(answer["cost"], 1.0);
  EXPECT_DOUBLE_EQ(answer["violation"], 1.5);
  EXPECT_EQ(answer["values"], (json{1.0, 1.5}));
  EXPECT_NEAR(answer["gradient"][0], 0.0, 1e-6);
  EXPECT_NEAR(answer["gradient"][1], -2.0, 1e-6);
  EXPECT_NEAR(answer["jacobian"][0][1], 1.0, 1e-6);
  EXPECT_NEAR(answer["jacobian"][1][0], 1.0, 1e-6);
  EXPECT_NEAR(answer["jacobian"][1][1], 0.0, 1e-6);
}

TEST_F(ExternalSolverTest, LeavesOutDerivativesThatNobodyWants) {
  Nearest program;
  Solve(program, {Say(kHello), Say(Ask({0.1, 0.1})), Say(End({0.5, 0.5}))});
  EXPECT_TRUE(heard_.at(1).contains("values"));
  EXPECT_FALSE(heard_.at(1).contains("gradient"));
  EXPECT_FALSE(heard_.at(1).contains("jacobian"));
}

TEST_F(ExternalSolverTest, AProgramWithoutARobotHasNoContacts) {
  Nearest program;
  const std::string ask = R"({"type":"evaluate","id":7,"x":[0.1,0.1],"gradients":false,"contacts":true})";
  Solve(program, {Say(kHello), Say(ask), Say(End({0.5, 0.5}))});
  EXPECT_EQ(heard_.at(1)["contacts"], json::array());
}

TEST_F(ExternalSolverTest, SaysWhereNothingIsFinite) {
  AnalyticProgram program = Plane(3.0);
  program.Add(TermKind::kCost,
              [](const VectorXd& x) { return One(x[0] > 1.0 ? std::numeric_limits<double>::quiet_NaN() : x[0]); });
  const SolverResult result = Solve(program, {Say(kHello), Say(Ask({2, 0}, true)), Say(End({2, 0}))});
  EXPECT_EQ(heard_.at(1), (json{{"type", "evaluation"}, {"id", 7}, {"finite", false}}));
  EXPECT_EQ(x_, Vector2d(0, 0)) << "a point that is not finite is never returned";
  EXPECT_TRUE(result.feasible);
}

TEST_F(ExternalSolverTest, TakesAGoodSolutionByItsOwnJudgement) {
  Nearest program;
  const SolverResult result = Solve(program, {Say(kHello), Say(Ask({0.4, 0.6})), Say(End({0.5, 0.5}))});
  EXPECT_EQ(result.status, SolveStatus::kConvergedFeasible);
  EXPECT_TRUE(result.feasible);
  EXPECT_EQ(x_, Vector2d(0.5, 0.5));
  EXPECT_DOUBLE_EQ(result.value.cost, 2.5);
  EXPECT_EQ(result.iterations, 1);
}

TEST_F(ExternalSolverTest, DoesNotBelieveASolverThatClaimsTooMuch) {
  Nearest program;
  const SolverResult result = Solve(program, {Say(kHello), Say(End({2.0, 1.0}))});
  EXPECT_EQ(result.status, SolveStatus::kConvergedInfeasible);
  EXPECT_FALSE(result.feasible);
  EXPECT_EQ(x_, Vector2d(0, 0)) << "the start violates less";
}

TEST_F(ExternalSolverTest, ReturnsTheBestPointThatWasAskedFor) {
  Nearest program;
  const SolverResult result =
      Solve(program, {Say(kHello), Say(Ask({0.5, 0.5})), Say(Ask({0.0, 1.0})), Say(End({2.0, 1.0}, "failed"))});
  EXPECT_EQ(x_, Vector2d(0.5, 0.5));
  EXPECT_EQ(result.status, SolveStatus::kIterationLimit);
}

TEST_F(ExternalSolverTest, KeepsPointsWithinTheBounds) {
  AnalyticProgram program = Plane(3.0);
  program.Add(TermKind::kCost, [](const VectorXd& x) { return VectorXd(x - Vector2d(9.0, 9.0)); });
  Solve(program, {Say(kHello), Say(Ask({50, -50})), Say(End({50, 50}))});
  EXPECT_DOUBLE_EQ(heard_.at(1)["cost"], 36.0 + 144.0);
  EXPECT_EQ(x_, Vector2d(3, 3));
}

TEST_F(ExternalSolverTest, MapsItsWordsOnTheFeasibilityOfThePoint) {
  Nearest program;
  EXPECT_EQ(Solve(program, {Say(kHello), Say(End({0.5, 0.5}, "limit"))}).status, SolveStatus::kIterationLimit);
  x_.setZero();
  EXPECT_EQ(Solve(program, {Say(kHello), Say(End({0.0, 0.1}, "limit"))}).status, SolveStatus::kIterationLimit);
  x_.setZero();
  EXPECT_EQ(Solve(program, {Say(kHello), Say(End({0.0, 0.1}, "failed"))}).status, SolveStatus::kNumericalFailure);
}

TEST_F(ExternalSolverTest, CountsTheEffortOfItsRequests) {
  Nearest program;
  const std::int64_t before = program.TermEvaluations();
  Solve(program, {Say(kHello), Say(End({0.5, 0.5}))});
  const std::int64_t without = program.TermEvaluations() - before;
  x_.setZero();
  Solve(program, {Say(kHello), Say(Ask({0.1, 0.1})), Say(Ask({0.2, 0.2})), Say(End({0.5, 0.5}))});
  EXPECT_GT(program.TermEvaluations() - before - without, without) << "two requests more";
}

TEST_F(ExternalSolverTest, KeepsItsHistory) {
  Nearest program;
  std::vector<IterationRecord> history;
  context_.history = &history;
  Solve(program, {Say(kHello), Say(R"({"type":"progress","cost":4.5,"violation":0.25})"), Say(End({0.5, 0.5}))});
  ASSERT_THAT(history, SizeIs(2));
  EXPECT_EQ(history[0].cost, 4.5);
  EXPECT_EQ(history[0].violation, 0.25);
  EXPECT_DOUBLE_EQ(history[1].cost, 2.5) << "the returned point";
}

TEST_F(ExternalSolverTest, HasAHistoryWithoutReportsOfProgress) {
  Nearest program;
  std::vector<IterationRecord> history;
  context_.history = &history;
  Solve(program,
        {Say(kHello), Say(Ask({0, 0})), Say(Ask({0.25, 0.5})), Say(Ask({0.25, 0.25})), Say(End({0, 0}, "failed"))});
  ASSERT_THAT(history, SizeIs(3));
  EXPECT_DOUBLE_EQ(history[0].violation, 1.0) << "the first one";
  EXPECT_DOUBLE_EQ(history[1].violation, 0.25) << "a better one";
  EXPECT_TRUE(history[2].accepted) << "the returned point";
}

TEST_F(ExternalSolverTest, IsAskedForItsBestPointAtTheEndOfItsBudget) {
  Nearest program;
  budget_s_ = 0.01;
  cancel_grace_s_ = 60.0;
  const auto ask_late = [this](const json&) {
    std::this_thread::sleep_for(std::chrono::duration<double>(2 * budget_s_));
    return Ask({0, 0});
  };
  const SolverResult result = Solve(program, {Say(kHello), ask_late, Say(End({0.5, 0.5}, "limit"))});
  EXPECT_EQ(heard_.back(), (json{{"type", "cancel"}}));
  EXPECT_EQ(result.status, SolveStatus::kTimeLimit);
  EXPECT_TRUE(result.budget_spent);
  EXPECT_TRUE(result.feasible) << "the point that it sent is evaluated and kept";
  EXPECT_EQ(x_, Vector2d(0.5, 0.5));
}

TEST_F(ExternalSolverTest, AWallTimeLimitIsNoBudget) {
  Nearest program;
  context_.stop = [&] { return heard_.empty() ? std::nullopt : std::optional(SolveStatus::kTimeLimit); };
  EXPECT_FALSE(Solve(program, {Say(kHello), Say(End({0.5, 0.5}))}).budget_spent);
}

// A row that appears only at x0 > 1 and has no slot at the initial guess.
TEST_F(ExternalSolverTest, GoesOnWithTheRowsThatItMet) {
  AnalyticProgram program = Plane(3.0);
  program.Add(TermKind::kCost, [](const VectorXd& x) { return VectorXd(x - Vector2d(3.0, 0.0)); });
  program.AddShaped(
      {"contact", TermKind::kInequality}, [](const VectorXd& x) { return x[0] > 1.0 ? One(x[0] - 2.0) : VectorXd(); },
      -1.0);
  const SolverResult result = Solve(program, {Say(kHello), Say(End({3, 0})), Say(End({-1, 0}))});
  ASSERT_THAT(heard_, SizeIs(2));
  EXPECT_THAT(heard_[0]["rows"], SizeIs(1));
  EXPECT_EQ(heard_[0]["round"], 0);
  EXPECT_EQ(result.status, SolveStatus::kConvergedFeasible);
  EXPECT_TRUE(result.feasible);
}

TEST_F(ExternalSolverTest, ServesOneProcessForManySolves) {
  Nearest program;
  solves_ = 3;
  Solve(program, {Say(kHello), Say(End({0.5, 0.5})), Say(End({0, 0})), Say(End({0, 0}))});
  EXPECT_EQ(starts_, 1);
  EXPECT_THAT(heard_, SizeIs(3));
}

TEST_F(ExternalSolverTest, CancelsAtTheRequestWhereTheEffortIsOver) {
  Nearest program;
  context_.stop = [&] {
    return heard_.size() >= 2 ? std::optional(SolveStatus::kEffortLimit) : std::nullopt;  // solve, one evaluation
  };
  const SolverResult result =
      Solve(program, {Say(kHello), Say(Ask({0.5, 0.5})), Say(Ask({0, 0})), Say(End({0.2, 0.8}))});
  EXPECT_EQ(result.status, SolveStatus::kEffortLimit);
  EXPECT_EQ(heard_.back(), (json{{"type", "cancel"}}));
  EXPECT_THAT(heard_, SizeIs(3)) << "the second request is not answered";
  EXPECT_EQ(x_, Vector2d(0.5, 0.5)) << "what was met before";
}

TEST_F(ExternalSolverTest, CancelsASilentSolverForAPerson) {
  Nearest program;
  context_.stop = [&] { return heard_.empty() ? std::nullopt : std::optional(SolveStatus::kCancelled); };
  const SolverResult result = Solve(program, {Say(kHello)});
  EXPECT_EQ(result.status, SolveStatus::kCancelled) << "within the grace time, without an error";
  EXPECT_EQ(heard_.back(), (json{{"type", "cancel"}}));
}

TEST_F(ExternalSolverTest, IsStartedAnewAfterAFault) {
  Nearest program;
  ExternalSolver solver({.declaration = std::string(64, '0')}, {.name = "played"}, [&] {
    ++starts_;
    std::deque<ScriptedChannel::Line> script = {Say(kHello), Say(starts_ == 1 ? "garbage" : End({0.5, 0.5}))};
    return std::make_unique<ScriptedChannel>(std::move(script), &heard_);
  });
  EXPECT_THROW(solver.Solve(program, x_, context_), SolverFault);
  EXPECT_EQ(solver.Solve(program, x_, context_).status, SolveStatus::kConvergedFeasible);
  EXPECT_EQ(starts_, 2);
}

struct Misdeed {
  const char* name;
  std::vector<std::string> lines;
  const char* reason;
};

class MisdeedTest : public ExternalSolverTest, public ::testing::WithParamInterface<Misdeed> {};

TEST_P(MisdeedTest, IsNamed) {
  std::deque<ScriptedChannel::Line> script;
  for (const std::string& line : GetParam().lines) script.push_back(Say(line));
  const std::string fault = FaultOf(script, true);
  EXPECT_THAT(fault, HasSubstr("solver 'played' (external) "));
  EXPECT_THAT(fault, HasSubstr(GetParam().reason));
}

INSTANTIATE_TEST_SUITE_P(
    All, MisdeedTest,
    ::testing::Values(
        Misdeed{"Garbage", {kHello, "Traceback (most recent"}, "no JSON object of the protocol"},
        Misdeed{"NotANumber", {kHello, R"({"type":"evaluate","id":1,"x":[NaN,0],"gradients":true})"}, "NaN"},
        Misdeed{"Infinite", {kHello, R"({"type":"evaluate","id":1,"x":[1e999,0],"gradients":true})"}, "no JSON object"},
        Misdeed{"Null", {kHello, R"({"type":"solution","x":[null,0],"status":"limit"})"}, "a list of finite numbers"},
        Misdeed{"Bare", {kHello, "[1, 2]"}, "no JSON object"},
        Misdeed{"Deep", {kHello, std::string(100'000, '[')}, "no JSON object"},
        Misdeed{"Untyped", {kHello, R"({"x":[0,0]})"}, "without a type"},
        Misdeed{"UnknownType", {kHello, R"({"type":"rebalance"})"}, "unknown type 'rebalance'"},
        Misdeed{"TooManyNumbers", {kHello, Ask({0, 0, 0})}, "with 3 numbers in 'x' where the program has 2 variables"},
        Misdeed{"TooFewNumbers", {kHello, End({0})}, "with 1 numbers in 'x' where the program has 2 variables"},
        Misdeed{"NoPoint", {kHello, R"({"type":"solution","status":"limit"})"}, "'solution' without 'x'"},
        Misdeed{"PointIsText", {kHello, R"({"type":"solution","x":"0","status":"limit"})"}, "not a list of numbers"},
        Misdeed{"UnknownStatus", {kHello, End({0, 0}, "fine")}, "one of converged, limit, failed"},
        Misdeed{"GradientsAreNumbers",
                {kHello, R"({"type":"evaluate","id":1,"x":[0,0],"gradients":1})"},
                "'gradients' is not true or false"},
        Misdeed{"ContactsAreNumbers",
                {kHello, R"({"type":"evaluate","id":1,"x":[0,0],"gradients":true,"contacts":1})"},
                "'contacts' is not true or false"},
        Misdeed{"IdIsText",
                {kHello, R"({"type":"evaluate","id":"1","x":[0,0],"gradients":true})"},
                "'id' is not a whole number"},
        Misdeed{"ProgressWithoutNumbers",
                {kHello, R"({"type":"progress","cost":"low","violation":0})"},
                "'cost' is not a finite number"},
        Misdeed{"NoHello", {Ask({})}, "began with 'evaluate' and not with 'hello'"},
        Misdeed{
            "OldProtocol", {R"({"type":"hello","protocol":2,"name":"n","version":"1"})"}, "'protocol' is not 1: '2'"},
        Misdeed{"TwoHellos", {kHello, kHello}, "said 'hello' a second time"},
        Misdeed{"Exit", {kHello}, "ended with exit code 3"}, Misdeed{"ExitAtOnce", {}, "ended with exit code 3"}),
    [](const auto& misdeed) { return misdeed.param.name; });

TEST_F(ExternalSolverTest, SilenceIsNamed) {
  silence_s_ = 0.05;
  EXPECT_THAT(FaultOf({}), HasSubstr("did not say hello within 0.05 s"));
  EXPECT_THAT(FaultOf({Say(kHello)}), HasSubstr("sent nothing for 0.05 s"));
}

TEST_F(ExternalSolverTest, EndlessProgressIsNamed) {
  std::deque<ScriptedChannel::Line> script(100'002, Say(R"({"type":"progress","cost":1,"violation":0})"));
  script.push_front(Say(kHello));
  EXPECT_THAT(FaultOf(script), HasSubstr("more than 100000 lines of progress"));
}

TEST_F(ExternalSolverTest, AskingForOnePointForEverIsNamed) {
  std::deque<ScriptedChannel::Line> script(1'100, Say(Ask({0.5, 0.5})));
  script.push_front(Say(kHello));
  EXPECT_THAT(FaultOf(script), HasSubstr("asked for the same point 1000 times in a row"));
}

TEST_F(ExternalSolverTest, ControlsOfATerminalAreNotHandedOn) {
  EXPECT_THAT(FaultOf({Say(kHello), Say("\x1b[2J")}), HasSubstr("\\x1b[2J"));
}

}  // namespace
}  // namespace legopt::external
