// Subsets of terms: sizes, units, passes, and uniform sampling.

#include "legopt/solvers/internal/term_sampler.h"

#include <gtest/gtest.h>

#include <numeric>

#include "tests/solvers/analytic_program.h"

namespace legopt {
namespace {

using Chosen = std::vector<std::uint8_t>;

int Count(const Chosen& chosen) { return std::accumulate(chosen.begin(), chosen.end(), 0); }

class Sampler : public ::testing::Test {
 protected:
  Sampler() : program_(Eigen::VectorXd::Zero(1), Eigen::VectorXd::Ones(1)) {
    for (int i = 0; i < 10; ++i) {
      program_.Add(
          TermKind::kCost, [](const Eigen::VectorXd& x) { return x; }, i < 3 ? 0 : -1);
    }
  }

  AnalyticProgram program_;
  TermSampler sampler_;
  std::mt19937_64 generator_{5};
};

TEST_F(Sampler, TermsOfAUnitAreDrawnTogether) {
  sampler_.Reset(program_, {.percent = 50});
  EXPECT_EQ(sampler_.num_units(), 8);
  EXPECT_EQ(sampler_.batch_size(), 4);
  std::vector<int> hits(10, 0);
  for (int draw = 0; draw < 1000; ++draw) {
    const Chosen& chosen = sampler_.Draw(generator_);
    EXPECT_EQ(chosen[0], chosen[1]);
    EXPECT_EQ(chosen[0], chosen[2]);
    EXPECT_EQ(Count(chosen) - 2 * chosen[0], 4);
    for (size_t i = 0; i < 10; ++i) hits[i] += chosen[i];
  }
  for (const int h : hits) EXPECT_NEAR(h, 500, 80);  // uniform
}

TEST_F(Sampler, BatchesAreFullAndLeaveNothingOut) {
  sampler_.Reset(program_, {.percent = 40});  // 3 of 8
  EXPECT_EQ(sampler_.batches_per_epoch(), 3);
  std::vector<int> hits(10, 0), waited(10, 0);
  constexpr int kBatches = 3000;
  for (int batch = 0; batch < kBatches; ++batch) {
    const Chosen& chosen = sampler_.NextBatch(generator_);
    EXPECT_EQ(Count(chosen) - 2 * chosen[0], 3);
    for (size_t i = 0; i < 10; ++i) {
      hits[i] += chosen[i];
      waited[i] = chosen[i] != 0 ? 0 : waited[i] + 1;
      EXPECT_LT(waited[i], 5) << "two passes";
    }
  }
  for (const int h : hits) EXPECT_NEAR(h, kBatches * 3 / 8.0, 40);
}

TEST_F(Sampler, FullSamplesDrawNothingAndSmallOnesOne) {
  sampler_.Reset(program_, {.percent = 100});
  EXPECT_TRUE(sampler_.everything());
  const std::mt19937_64 before = generator_;
  EXPECT_EQ(Count(sampler_.NextBatch(generator_)), 10);
  EXPECT_TRUE(before == generator_);
  sampler_.Reset(program_, {.percent = 1});
  EXPECT_EQ(sampler_.batch_size(), 1);
}

TEST_F(Sampler, SameGeneratorSameDraws) {
  sampler_.Reset(program_, {.percent = 50});
  std::vector<Chosen> first;
  for (int i = 0; i < 5; ++i) first.push_back(sampler_.Draw(generator_));
  TermSampler other;
  other.Reset(program_, {.percent = 50});
  std::mt19937_64 generator(5);
  for (int i = 0; i < 5; ++i) EXPECT_EQ(other.Draw(generator), first[static_cast<size_t>(i)]);
}

}  // namespace
}  // namespace legopt
