// The factor of a chain of blocks against Eigen's of the whole matrix.

#include "legopt/subproblem/block_chain.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <vector>

#include "legopt/program/program.h"

namespace legopt {
namespace {

constexpr int kSize = 11, kBlocks = 4;

/// A positive definite matrix of four blocks with diagonal couplings and rows beside them, given to a BlockChain as
/// tiled or as dense.
class Chain {
 public:
  Chain(const std::vector<int>& rows, bool tiled) : stride_(PaddedSize(kSize)), rows_(rows), tiled_(tiled) {
    std::srand(11);
    Spoil();
    chain_.Reset(kBlocks, stride_, true);
    for (int t = 0; t + 1 < kBlocks; ++t) chain_.SetCoupling(t, tiled, rows[static_cast<size_t>(t)]);
    Draw();
  }

  /// Another matrix of the same shape.
  void Draw() {
    const int all = kBlocks * stride_;
    whole_ = Eigen::MatrixXd::Zero(all, all);
    for (int t = 0; t < kBlocks; ++t) {
      const Eigen::MatrixXd random = Eigen::MatrixXd::Random(kSize, kSize);
      Part(t, t) = random * random.transpose();
      Part(t, t).diagonal().array() += 30.0;
    }
    for (int t = 0; t + 1 < kBlocks; ++t) Couple(t);
    for (int i = 0; i < all; ++i) {
      if (i % stride_ >= kSize) whole_(i, i) = 1.0;
    }
    for (int t = 0; t < kBlocks; ++t) {
      for (int i = 0; i < stride_; ++i) {
        for (int j = 0; j < stride_; ++j) chain_.block(t)[i * stride_ + j] = whole_(t * stride_ + i, t * stride_ + j);
      }
    }
  }

  bool Eliminate() {
    for (int t = 0; t < kBlocks; ++t) {
      if (!chain_.Eliminate(t, couplings_[t].data(), 1e-14)) return false;
    }
    return true;
  }

  /// What is missing of the chain's solution of a right side to the whole matrix's.
  double Error() {
    EXPECT_TRUE(Eliminate());
    const Eigen::VectorXd right = Eigen::VectorXd::Random(kBlocks * stride_);
    AlignedDoubles b(right.begin(), right.end());
    for (int t = 0; t < kBlocks; ++t) chain_.SolveForward(t, b);
    chain_.SolveBack(b);
    const Eigen::VectorXd x = Eigen::VectorXd::Map(b.data(), static_cast<Eigen::Index>(b.size()));
    return (x - whole_.ldlt().solve(right)).norm();
  }

  BlockChain& chain() { return chain_; }

 private:
  /// What an earlier matrix of another shape has left in the buffers.
  void Spoil() {
    constexpr int kOtherBlocks = 7, kOtherStride = 20;
    const Eigen::MatrixXd dense = Eigen::MatrixXd::Constant(kOtherStride, kOtherStride, 1e3);
    chain_.Reset(kOtherBlocks, kOtherStride, true);
    for (int t = 0; t + 1 < kOtherBlocks; ++t) chain_.SetCoupling(t, false, 0);
    for (int t = 0; t < kOtherBlocks; ++t) {
      std::fill_n(chain_.block(t), kOtherStride * kOtherStride, 1e3);
      for (int i = 0; i < kOtherStride; ++i) chain_.block(t)[i * kOtherStride + i] = 1e6;
      EXPECT_TRUE(chain_.Eliminate(t, dense.data(), 1e-14));
    }
  }

  Eigen::Block<Eigen::MatrixXd> Part(int t, int u) { return whole_.block(t * stride_, u * stride_, kSize, kSize); }

  void Couple(int t) {
    const Eigen::VectorXd diagonal = -2.0 * Eigen::VectorXd::Ones(kSize) + Eigen::VectorXd::Random(kSize);
    Part(t, t + 1).diagonal() = diagonal;
    const int width = tiled_ ? 4 : stride_;
    AlignedDoubles& c = couplings_[t];
    c.assign(static_cast<size_t>(stride_ * width), 0.0);
    for (int i = 0; i < kSize; ++i) c[static_cast<size_t>(i * width + (tiled_ ? i % 4 : i))] = diagonal[i];
    for (int r = 0; r < rows_[static_cast<size_t>(t)]; ++r) {
      Eigen::VectorXd left = Eigen::VectorXd::Zero(stride_), right = left;
      left.head(kSize).setRandom();
      right.head(kSize).setRandom();
      Part(t, t + 1) += left.head(kSize) * right.head(kSize).transpose();
      std::copy(left.begin(), left.end(), chain_.left(t, r));
      std::copy(right.begin(), right.end(), chain_.right(t, r));
    }
    Part(t + 1, t) = Part(t, t + 1).transpose();
  }

  int stride_;
  std::vector<int> rows_;
  bool tiled_;
  Eigen::MatrixXd whole_;
  AlignedDoubles couplings_[kBlocks];
  BlockChain chain_;
};

TEST(BlockChain, SolvesWithCouplingsOfEveryKind) {
  for (const std::vector<int>& rows : {std::vector<int>{0, 0, 0}, {1, 0, 3}, {6, 2, 1}}) {
    for (const bool tiled : {false, true}) EXPECT_LT(Chain(rows, tiled).Error(), 1e-12) << tiled << ' ' << rows[0];
  }
  EXPECT_LT(Chain({9, 7, 0}, false).Error(), 1e-12);
}

// As an interior point does, with one shape and matrix after matrix.
TEST(BlockChain, SolvesMatrixAfterMatrix) {
  for (const bool tiled : {false, true}) {
    Chain chain({3, 0, 6}, tiled);
    for (int k = 0; k < 3; ++k) {
      EXPECT_LT(chain.Error(), 1e-12) << tiled << ' ' << k;
      chain.Draw();
    }
  }
}

TEST(BlockChain, CanBeMadeAnew) {
  Chain chain({6, 6, 6}, true);
  chain.Error();
  chain.chain().Reset(1, 4, false);
  std::fill_n(chain.chain().block(0), 16, 0.0);
  for (int i = 0; i < 4; ++i) chain.chain().block(0)[5 * i] = 4.0;
  ASSERT_TRUE(chain.chain().Eliminate(0, nullptr, 1e-14));
  AlignedDoubles b = {4, 8, 12, 16};
  chain.chain().SolveForward(0, b);
  chain.chain().SolveBack(b);
  EXPECT_EQ(b, (AlignedDoubles{1, 2, 3, 4}));
}

TEST(BlockChainDeathTest, RefusesWhatItHasNoRoomFor) {
  BlockChain chain;
  chain.Reset(3, 4, true);
  EXPECT_DEATH(chain.SetCoupling(2, false, 0), "coupled with the next one");
  EXPECT_DEATH(chain.SetCoupling(0, true, BlockChain::kMostRows + 1), "few rows");
}

TEST(BlockChain, SaysWhenAFactorIsNotFinite) {
  Chain chain({0, 0, 0}, true);
  chain.chain().block(2)[0] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(chain.Eliminate());
}

}  // namespace
}  // namespace legopt
