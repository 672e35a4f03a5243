// Policy: the unit is the problem. Repetitions are combined into one number for each problem, and jobs that did not
// run have no effect.

#include "legopt/statistics/problem_scores.h"

#include <array>
#include <cmath>
#include <limits>

#include "legopt/statistics/hypothesis_tests.h"
#include "legopt/statistics/internal/checks.h"
#include "tests/statistics/refusal.h"

namespace legopt::statistics {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;
constexpr Repetition kQueued{};

Repetition Solved(double value) { return {.end = RunOutcome::kSolved, .value = value}; }
Repetition Failed(double value) { return {.end = RunOutcome::kFailed, .value = value}; }

ProblemScore Score(std::initializer_list<Repetition> runs) { return ScoreOf(std::vector<Repetition>(runs)); }

TEST(ProblemScores, RepetitionsAreAveraged) {
  const ProblemScore score = Score({Solved(2.0), Failed(10.0), Solved(4.0), Failed(20.0)});
  EXPECT_EQ(score.Share(), 0.5);
  EXPECT_EQ(score.MeanSolvedValue(), 3.0);
  EXPECT_EQ(score.Charged(100.0), 51.5);
  EXPECT_EQ(score.Charged(kInfinity), kInfinity);
  EXPECT_EQ(score.Spent(), 9.0);
  EXPECT_EQ(Score({Solved(2.0)}).Charged(kInfinity), 2.0);
}

TEST(ProblemScores, MissingIsNotFailed) {
  const ProblemScore score =
      Score({Solved(2.0), kQueued, Failed(8.0), {.end = RunOutcome::kMissing, .value = std::nan("")}});
  EXPECT_EQ(score.missing, 2);
  EXPECT_EQ(score.finished(), 2);
  EXPECT_EQ(score.Share(), 0.5);
  EXPECT_EQ(score.Charged(100.0), 51.0);
}

TEST(ProblemScores, AProblemThatNeverRanHasNoNumbers) {
  for (const ProblemScore& score : {ScoreOf({}), Score({kQueued, kQueued})}) {
    EXPECT_EQ(score.finished(), 0);
    EXPECT_TRUE(std::isnan(score.Share()));
    EXPECT_TRUE(std::isnan(score.MeanSolvedValue()));
    EXPECT_TRUE(std::isnan(score.Charged(1.0)));
    EXPECT_TRUE(std::isnan(score.Spent()));
  }
}

TEST(ProblemScores, AProblemThatAlwaysFailedNeverArrives) {
  const ProblemScore score = Score({Failed(3.0), Failed(5.0)});
  EXPECT_EQ(score.Share(), 0.0);
  EXPECT_EQ(score.MeanSolvedValue(), kInfinity);
  EXPECT_EQ(score.Spent(), 4.0);
}

TEST(ProblemScores, PairsAreCountedByProblem) {
  const ProblemScore solved = Score({Solved(1.0)});
  const ProblemScore failed = Score({Failed(1.0)});
  const ProblemScore missing = Score({kQueued});
  const std::array first{solved, solved, failed, failed, missing, solved, missing};
  const std::array second{solved, failed, solved, failed, solved, missing, missing};
  const PairCounts counts = CountPairs(first, second);
  EXPECT_EQ(counts.both, 1);
  EXPECT_EQ(counts.only_first, 1);
  EXPECT_EQ(counts.only_second, 1);
  EXPECT_EQ(counts.neither, 1);
  EXPECT_EQ(counts.missing, 3);
  EXPECT_EQ(counts.pairs(), 4);
  EXPECT_THAT(CommonlySolved(first, second), ElementsAre(0));
}

TEST(ProblemScores, TenRepetitionsOfOneProblemAreOnePair) {
  const std::vector<Repetition> all_solved(10, Solved(1.0));
  const std::vector<Repetition> all_failed(10, Failed(1.0));
  const std::array first{ScoreOf(all_solved)};
  const std::array second{ScoreOf(all_failed)};
  const PairCounts counts = CountPairs(first, second);
  EXPECT_EQ(counts.pairs(), 1);
  EXPECT_EQ(McNemar(counts.only_first, counts.only_second).mid_p, 0.5);  // not 1e-3 as for ten
}

TEST(ProblemScores, SharesAreComparedAsFractions) {
  const std::array first{Score({Solved(1.0), Failed(1.0), Failed(1.0)}), Score({Solved(1.0), Failed(1.0)})};
  const std::array second{Score({Solved(1.0), Solved(1.0), Failed(1.0), Failed(1.0), Failed(1.0), Failed(1.0)}),
                          Score({Solved(1.0), Solved(1.0), Failed(1.0)})};
  const PairCounts counts = CountPairs(first, second);
  EXPECT_EQ(counts.both, 1);         // 1/3 and 2/6
  EXPECT_EQ(counts.only_second, 1);  // 1/2 and 2/3
  EXPECT_THAT(CommonlySolved(first, second), ElementsAre(0, 1));
}

TEST(ProblemScores, NoProblems) {
  EXPECT_EQ(CountPairs({}, {}).pairs(), 0);
  EXPECT_THAT(CommonlySolved({}, {}), IsEmpty());
}

TEST(ProblemScores, RefuseBadInput) {
  EXPECT_REFUSED(Score({Solved(-1.0)}), "ScoreOf: value[0]: must be a finite number, not below 0 (got '-1')");
  EXPECT_REFUSED(Score({Failed(std::nan(""))}), "got 'nan'");
  EXPECT_REFUSED(Score({Solved(1.0)}).Charged(-1.0), "Charged: charge[0]");
  const std::vector<ProblemScore> one(1);
  EXPECT_REFUSED(CountPairs(one, {}), "CountPairs: first: must be as long as its counterpart, 0 (got '1')");
  EXPECT_REFUSED(CommonlySolved({}, one), "CommonlySolved: first");
}

TEST(ProblemScores, ChargesAreAveragedOverProblems) {
  const std::vector<ProblemScore> problems = {
      ScoreOf(std::vector<Repetition>{{RunOutcome::kSolved, 1.0}, {RunOutcome::kFailed, 50.0}}),
      ScoreOf(std::vector<Repetition>{{RunOutcome::kSolved, 3.0}, {RunOutcome::kMissing, 0.0}}),
      ScoreOf(std::vector<Repetition>{{RunOutcome::kMissing, 0.0}})};
  EXPECT_DOUBLE_EQ(MeanCharged(problems, 1000.0), ((1.0 + 1000.0) / 2 + 3.0) / 2);
  EXPECT_TRUE(std::isnan(MeanCharged(std::span(problems).last(1), 1000.0)));
}

}  // namespace
}  // namespace legopt::statistics
