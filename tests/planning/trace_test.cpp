// The stored trace of a solve's convergence. It contains everything that the curve of the best point so far needs, its
// bytes decode to the same records or to a clear error, and the records of every registered solver end at its result.

#include "legopt/planning/internal/trace.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <iterator>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>
#include <random>
#include <set>
#include <tuple>

#include "legopt/planning/problem_solver.h"
#include "legopt/solvers/methods/method.h"
#include "legopt/types/input_error.h"
#include "tests/dataset/test_data.h"
#include "tests/folders.h"
#include "tests/solvers/methods/iterations_key.h"

namespace legopt {
namespace {

using Records = std::vector<IterationRecord>;

/// Returns a random history of three windows with two restarts each.
Records RandomHistory(int per_descent, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> logarithm(-6, 1), cost(100, 200);
  Records history;
  for (int window = 0; window < 3; ++window) {
    for (int restart = 0; restart < 2; ++restart) {
      for (int i = 0; i < per_descent; ++i) {
        IterationRecord record{.step = static_cast<int>(history.size()), .window = window, .restart = restart};
        record.penalty = i < per_descent / 2 ? 100 : 1000;
        record.trust_box = 0.1;
        record.cost = cost(random);
        record.violation = std::pow(10, logarithm(random));
        record.accepted = random() % 3 == 0;
        record.evaluations = 10 * static_cast<std::int64_t>(history.size());
        record.elapsed_us = 100 * static_cast<std::int64_t>(history.size());
        history.push_back(record);
      }
    }
  }
  return history;
}

/// Returns after every step the smallest violation, and the lowest cost among points below the tolerance, of its
/// window.
std::map<int, std::pair<double, double>> BestCurve(const Records& records, double tolerance) {
  std::map<int, std::pair<double, double>> curve;
  std::pair<double, double> best;
  int window = -1;
  for (const IterationRecord& record : records) {
    if (record.window != window) best = {HUGE_VAL, HUGE_VAL};
    window = record.window;
    const auto before = best;
    best.first = std::min(best.first, record.violation);
    if (record.violation < tolerance) best.second = std::min(best.second, record.cost);
    if (best != before) curve[record.step] = best;
  }
  return curve;
}

bool Equal(const IterationRecord& a, const IterationRecord& b) {
  const auto all = [](const IterationRecord& r) {
    return std::tuple(r.step, r.window, r.restart, r.start, r.penalty, r.trust_box, r.cost, r.violation, r.accepted,
                      r.evaluations, r.elapsed_us);
  };
  return all(a) == all(b);
}

bool Contains(const Records& records, const IterationRecord& record) {
  return std::any_of(records.begin(), records.end(), [&](const auto& r) { return Equal(r, record); });
}

const IterationRecord& LastAccepted(const Records& records) {
  return *std::find_if(records.rbegin(), records.rend(), [](const auto& r) { return r.accepted; });
}

TEST(Condensing, KeepsTheCurveOfTheBestSoFarForEveryTolerance) {
  for (const unsigned seed : {1U, 2U, 3U}) {
    const Records history = RandomHistory(200, seed);
    const Records kept = CondenseTrace(history);
    EXPECT_LT(kept.size(), history.size() / 4);
    for (const double tolerance : {1e-3, 4e-4, 1e-4, 1e-5}) {
      EXPECT_EQ(BestCurve(kept, tolerance), BestCurve(history, tolerance)) << tolerance;
    }
    EXPECT_TRUE(std::is_sorted(kept.begin(), kept.end(), [](auto& a, auto& b) { return a.step < b.step; }));
  }
}

TEST(Condensing, KeepsTheLastAcceptedRecordOfEveryDescent) {
  const Records history = RandomHistory(50, 7);
  const Records kept = CondenseTrace(history);
  std::map<std::tuple<int, int, double>, IterationRecord> last;
  for (const IterationRecord& record : history) {
    if (record.accepted) last[{record.window, record.restart, record.penalty}] = record;
  }
  EXPECT_EQ(last.size(), 12U);
  for (const auto& [descent, record] : last) EXPECT_TRUE(Contains(kept, record)) << record.step;
}

TEST(Condensing, ThinsEvenlyRatherThanDroppingAll) {
  Records history = RandomHistory(2000, 3);
  for (std::size_t i = 0; i < history.size(); ++i) history[i].violation = 1.0 / static_cast<double>(i + 1);
  for (const bool accepted_at_the_end : {true, false}) {
    if (!accepted_at_the_end) std::for_each(history.end() - 3000, history.end(), [](auto& r) { r.accepted = false; });
    const Records kept = CondenseTrace(history, 100);
    EXPECT_EQ(kept.size(), 100U);
    EXPECT_TRUE(Equal(kept.front(), history.front()));
    EXPECT_TRUE(Equal(LastAccepted(kept), LastAccepted(history)));
    int widest = 0;
    for (std::size_t i = 1; i < kept.size(); ++i) widest = std::max(widest, kept[i].step - kept[i - 1].step);
    EXPECT_LE(widest, 2 * static_cast<int>(history.size()) / 99);
  }
}

TEST(Condensing, WhatIsNotFiniteIsNeverBest) {
  Records history = {{.step = 0, .violation = std::numeric_limits<double>::quiet_NaN()},
                     {.step = 1, .cost = std::numeric_limits<double>::infinity(), .violation = 0}};
  EXPECT_TRUE(CondenseTrace(history).empty());
  EXPECT_TRUE(CondenseTrace({}).empty());
}

TEST(TraceBytes, BecomeTheSameRecords) {
  const Records records = CondenseTrace(RandomHistory(500, 5));
  const std::vector<std::uint8_t> bytes = EncodeTrace(records);
  const Records read = DecodeTrace(bytes, "job 1");
  ASSERT_EQ(read.size(), records.size());
  for (std::size_t i = 0; i < read.size(); ++i) EXPECT_TRUE(Equal(read[i], records[i])) << i;
  EXPECT_TRUE(EncodeTrace({}).empty());
  EXPECT_TRUE(DecodeTrace({}, "job 1").empty());
}

TEST(TraceBytes, OfTheLongestTraceStayWithinTheMessage) {
  constexpr std::size_t kMostBytes = std::size_t{1} << 20;  // bus/worker_call_fields.h
  std::mt19937_64 random(1);
  Records records(kMaxTraceRecords);
  for (IterationRecord& record : records) {
    record.cost = std::bit_cast<double>(random());
    record.violation = std::bit_cast<double>(random());
    record.penalty = std::bit_cast<double>(random());
    record.trust_box = std::bit_cast<double>(random());
    record.evaluations = record.elapsed_us = static_cast<std::int64_t>(random());
    record.step = record.window = record.restart = record.start = static_cast<int>(random());
  }
  EXPECT_LT(EncodeTrace(records).size(), kMostBytes / 2);
}

TEST(TraceBytes, DifferOnlyBehindTheirFirstPartWhenTimesDo) {
  Records records = CondenseTrace(RandomHistory(100, 5));
  const std::vector<std::uint8_t> first = EncodeTrace(records);
  for (IterationRecord& record : records) record.elapsed_us *= 3;
  const std::vector<std::uint8_t> second = EncodeTrace(records);
  std::uint32_t length = 0;
  std::memcpy(&length, first.data(), sizeof length);
  const auto end = static_cast<std::ptrdiff_t>(sizeof length + length);
  EXPECT_TRUE(std::equal(first.begin(), first.begin() + end, second.begin()));
  EXPECT_NE(first, second);
}

TEST(TraceBytes, DamageIsAnErrorThatNamesTheSource) {
  const std::vector<std::uint8_t> bytes = EncodeTrace(CondenseTrace(RandomHistory(100, 5)));
  const auto expect_refused = [](std::span<const std::uint8_t> damaged) {
    try {
      DecodeTrace(damaged, "job 7");
      ADD_FAILURE() << "taken";
    } catch (const InputError& error) {
      EXPECT_NE(std::string(error.what()).find("job 7: trace"), std::string::npos) << error.what();
    }
  };
  for (const std::size_t size : {std::size_t{1}, std::size_t{4}, std::size_t{20}, bytes.size() - 1}) {
    expect_refused(std::span(bytes).first(size));
  }
  const std::vector<std::uint8_t> noise(100, 0x5a);
  expect_refused(noise);
  std::vector<std::uint8_t> other_length = bytes;
  other_length[0] ^= 1U;
  expect_refused(other_length);
  std::mt19937 random(1);
  for (int i = 0; i < 200; ++i) {  // any changed byte gives the records or an error
    std::vector<std::uint8_t> altered = bytes;
    altered[random() % altered.size()] = static_cast<std::uint8_t>(random());
    try {
      DecodeTrace(altered, "job 7");
    } catch (const InputError&) {
    }
  }
}

// --- Every solver of the registry ------------------------------------------------------------------------------------

class SolverTrace : public ::testing::TestWithParam<std::string> {
 protected:
  static SolveOutcome Solve(Task task, const Method& method) {
    static const auto dataset = Dataset::Load(SourceFolder() + "/data/garage-small");
    return ProblemSolver(dataset).Solve(task, dataset->problems(task).front().id, Initialization::kInCollision, method,
                                        {});
  }

  static void ExpectOrdered(const SolveOutcome& outcome) {
    const Records& records = outcome.history;
    ASSERT_FALSE(records.empty());
    for (std::size_t i = 1; i < records.size(); ++i) {
      EXPECT_EQ(records[i].step, records[i - 1].step + 1);
      EXPECT_GE(records[i].elapsed_us, records[i - 1].elapsed_us) << i;
      EXPECT_GE(records[i].evaluations, records[i - 1].evaluations) << i;
      EXPECT_GE(records[i].window, records[i - 1].window) << i;
    }
    EXPECT_GT(records.front().evaluations, 0);
    EXPECT_LE(records.back().evaluations, outcome.term_evaluations);
    EXPECT_LE(records.back().elapsed_us, outcome.wall_us);
  }

  static int Starts(const Records& records) {
    std::set<std::tuple<int, int, int>> starts;
    for (const IterationRecord& record : records) starts.insert({record.window, record.restart, record.start});
    return static_cast<int>(starts.size());
  }
};

TEST_P(SolverTrace, EndsAtTheResultOfAPosture) {
  for (const int max_iterations : {3, 60}) {  // a poor result, after restarts, and a better one
    nlohmann::json description = {
        {"solver", GetParam()}, {"multi_starts", 2}, {"options", {{test::IterationsKey(GetParam()), max_iterations}}}};
    if (GetParam() != "ipopt") description["options"]["max_penalty_iterations"] = max_iterations == 3 ? 1 : 11;
    const SolveOutcome outcome = Solve(Task::kPosture, Method::FromJson(description, "test"));
    ExpectOrdered(outcome);
    const Records kept = CondenseTrace(outcome.history);
    EXPECT_EQ(LastAccepted(kept).violation, outcome.max_violation);
    EXPECT_EQ(LastAccepted(kept).cost, outcome.cost);
    EXPECT_LE(LastAccepted(kept).restart, outcome.restarts);
    EXPECT_LE(Starts(outcome.history), outcome.starts);
  }
}

TEST_P(SolverTrace, EndsAtTheResultOfEveryWindow) {
  nlohmann::json description = {{"solver", GetParam()}, {"options", {{test::IterationsKey(GetParam()), 20}}}};
  if (GetParam() != "ipopt") description["options"]["max_penalty_iterations"] = 3;
  const SolveOutcome outcome = Solve(Task::kMotion, Method::FromJson(description, "test"));
  ExpectOrdered(outcome);
  double largest = 0;
  const Records kept = CondenseTrace(outcome.history);
  const int tried = std::min(outcome.windows_solved + 1, outcome.windows);
  for (int window = 0; window < tried; ++window) {
    Records of_window;
    std::copy_if(kept.begin(), kept.end(), std::back_inserter(of_window), [&](auto& r) { return r.window == window; });
    if (std::none_of(of_window.begin(), of_window.end(), [](auto& r) { return r.accepted; })) continue;
    largest = std::max(largest, LastAccepted(of_window).violation);
  }
  EXPECT_EQ(largest, outcome.max_violation);
}

std::vector<std::string> SolverWords() {
  std::vector<std::string> words;
  for (const SolverEntry& entry : SolverRegistry()) words.push_back(entry.word);
  return words;
}

INSTANTIATE_TEST_SUITE_P(Registry, SolverTrace, ::testing::ValuesIn(SolverWords()),
                         [](const auto& word) { return word.param; });

}  // namespace
}  // namespace legopt
