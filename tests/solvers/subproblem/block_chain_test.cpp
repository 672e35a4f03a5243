// The factor of a chain of blocks compared with Eigen's of the whole matrix.

#include "legopt/solvers/subproblem/block_chain.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <limits>
#include <vector>

#include "legopt/problem/program.h"

namespace legopt {
namespace {

constexpr int kSize = 11, kBlocks = 4;

/// A positive definite matrix of four blocks with diagonal couplings and additional rows, passed to a BlockChain as
/// tiled or as dense.
template <typename Real>
class Chain {
 public:
  Chain(const std::vector<int>& rows, bool tiled) : stride_(PaddedSize(kSize)), rows_(rows), tiled_(tiled) {
    std::srand(11);
    Spoil();
    chain_.Reset(kBlocks, stride_, true);
    for (int t = 0; t + 1 < kBlocks; ++t) chain_.SetCoupling(t, tiled, rows[static_cast<size_t>(t)]);
    Draw();
  }

  /// Makes another matrix of the same shape.
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
        for (int j = 0; j < stride_; ++j)
          chain_.block(t)[i * stride_ + j] = static_cast<Real>(whole_(t * stride_ + i, t * stride_ + j));
      }
    }
  }

  bool Eliminate() {
    for (int t = 0; t < kBlocks; ++t) {
      if (!chain_.Eliminate(t, couplings_[t].data(), kPivotFloor)) return false;
    }
    return true;
  }

  /// Returns the difference between the chain's and the whole matrix's solution for a right-hand side.
  double Error() {
    EXPECT_TRUE(Eliminate());
    const Eigen::VectorXd right = Eigen::VectorXd::Random(kBlocks * stride_);
    AlignedNumbers<Real> b(right.begin(), right.end());
    for (int t = 0; t < kBlocks; ++t) chain_.SolveForward(t, b);
    chain_.SolveBack(b);
    const Eigen::VectorXd x =
        Eigen::VectorX<Real>::Map(b.data(), static_cast<Eigen::Index>(b.size())).template cast<double>();
    return (x - whole_.ldlt().solve(right)).norm();
  }

  BlockChain<Real>& chain() { return chain_; }

  /// Accuracy of a solution, for the random matrices of this class.
  static constexpr double kAccuracy =
      1e-12 / std::numeric_limits<double>::epsilon() * std::numeric_limits<Real>::epsilon();
  static constexpr Real kPivotFloor = Real{50} * std::numeric_limits<Real>::epsilon();

 private:
  /// Fills the buffers with values of an earlier matrix of another shape.
  void Spoil() {
    constexpr int kOtherBlocks = 7, kOtherStride = 20;
    const AlignedNumbers<Real> dense(size_t{kOtherStride} * kOtherStride, Real{1e3F});
    chain_.Reset(kOtherBlocks, kOtherStride, true);
    for (int t = 0; t + 1 < kOtherBlocks; ++t) chain_.SetCoupling(t, false, 0);
    for (int t = 0; t < kOtherBlocks; ++t) {
      std::fill_n(chain_.block(t), kOtherStride * kOtherStride, Real{1e3F});
      for (int i = 0; i < kOtherStride; ++i) chain_.block(t)[i * kOtherStride + i] = Real{1e6F};
      EXPECT_TRUE(chain_.Eliminate(t, dense.data(), kPivotFloor));
    }
  }

  Eigen::Block<Eigen::MatrixXd> Part(int t, int u) { return whole_.block(t * stride_, u * stride_, kSize, kSize); }

  void Couple(int t) {
    const Eigen::VectorXd diagonal = -2.0 * Eigen::VectorXd::Ones(kSize) + Eigen::VectorXd::Random(kSize);
    Part(t, t + 1).diagonal() = diagonal;
    const int width = tiled_ ? 4 : stride_;
    AlignedNumbers<Real>& c = couplings_[t];
    c.assign(static_cast<size_t>(stride_ * width), Real{0});
    for (int i = 0; i < kSize; ++i)
      c[static_cast<size_t>(i * width + (tiled_ ? i % 4 : i))] = static_cast<Real>(diagonal[i]);
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
  AlignedNumbers<Real> couplings_[kBlocks];
  BlockChain<Real> chain_;
};

template <typename Real>
class BlockChainOf : public ::testing::Test {};
using Reals = ::testing::Types<double, float>;
TYPED_TEST_SUITE(BlockChainOf, Reals, );

TYPED_TEST(BlockChainOf, SolvesWithCouplingsOfEveryKind) {
  for (const std::vector<int>& rows : {std::vector<int>{0, 0, 0}, {1, 0, 3}, {6, 2, 1}}) {
    for (const bool tiled : {false, true})
      EXPECT_LT(Chain<TypeParam>(rows, tiled).Error(), Chain<TypeParam>::kAccuracy) << tiled << ' ' << rows[0];
  }
  EXPECT_LT(Chain<TypeParam>({9, 7, 0}, false).Error(), Chain<TypeParam>::kAccuracy);
}

// Like an interior-point method: one shape, a sequence of matrices.
TYPED_TEST(BlockChainOf, SolvesMatrixAfterMatrix) {
  for (const bool tiled : {false, true}) {
    Chain<TypeParam> chain({3, 0, 6}, tiled);
    for (int k = 0; k < 3; ++k) {
      EXPECT_LT(chain.Error(), chain.kAccuracy) << tiled << ' ' << k;
      chain.Draw();
    }
  }
}

TYPED_TEST(BlockChainOf, CanBeMadeAnew) {
  Chain<TypeParam> chain({6, 6, 6}, true);
  chain.Error();
  chain.chain().Reset(1, 4, false);
  std::fill_n(chain.chain().block(0), 16, TypeParam{0});
  for (int i = 0; i < 4; ++i) chain.chain().block(0)[5 * i] = TypeParam{4};
  ASSERT_TRUE(chain.chain().Eliminate(0, nullptr, chain.kPivotFloor));
  AlignedNumbers<TypeParam> b = {4, 8, 12, 16};
  chain.chain().SolveForward(0, b);
  chain.chain().SolveBack(b);
  EXPECT_EQ(b, (AlignedNumbers<TypeParam>{1, 2, 3, 4}));
}

TEST(BlockChainDeathTest, RefusesWhatItHasNoRoomFor) {
  BlockChain<double> chain;
  chain.Reset(3, 4, true);
  EXPECT_DEATH(chain.SetCoupling(2, false, 0), "coupled with the next one");
  EXPECT_DEATH(chain.SetCoupling(0, true, kernels::kMaxExtraRows + 1), "few rows");
}

TYPED_TEST(BlockChainOf, SaysWhenAFactorIsNotFinite) {
  Chain<TypeParam> chain({0, 0, 0}, true);
  chain.chain().block(2)[0] = std::numeric_limits<TypeParam>::quiet_NaN();
  EXPECT_FALSE(chain.Eliminate());
}

}  // namespace
}  // namespace legopt
