// The hand-written kernels against Eigen.

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <tuple>
#include <vector>

#include "legopt/program/program.h"
#include "legopt/subproblem/block_kernels.h"
#include "legopt/subproblem/dense_kernels.h"

namespace legopt {
namespace {

using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

constexpr kernels::BlockVectors kVectors[] = {kernels::BlockVectors::kFour, kernels::BlockVectors::kTwoFours,
                                              kernels::BlockVectors::kEight};

/// Of one size with the kernels of every processor: they have equal bits, and are right.
class Kernels : public ::testing::TestWithParam<int> {
 protected:
  Kernels() : size_(GetParam()), stride_(PaddedSize(size_)) {
    std::srand(7);
    rows_ = RowMajor::Zero(kRows, stride_);
    rows_.leftCols(size_).setRandom();
    weights_ = Eigen::VectorXd::Random(kRows).cwiseAbs();
    expected_ = rows_.transpose() * weights_.asDiagonal() * rows_;
    expected_ += Eigen::MatrixXd::Identity(stride_, stride_);
    for (int j = 0; j < stride_; j += 4) columns_.push_back(j);
    for (const auto vectors : kVectors) {
      const kernels::BlockKernels* const kernels = kernels::KernelsOf(vectors);
      if (kernels != nullptr) kernels_.push_back(kernels);  // no AVX-512 otherwise
    }
  }

  RowMajor Squares(const kernels::BlockKernels& kernels) const {
    RowMajor m = RowMajor::Identity(stride_, stride_);
    double scratch[4 * kRows];
    kernels.add_squares({rows_.data(), weights_.data(), kRows, columns_, scratch}, m.data(), stride_);
    return m;
  }

  bool Factor(const kernels::BlockKernels& kernels, RowMajor& m, const kernels::Coupling& coupling = {}) const {
    return kernels.factor({}, m.data(), min_pivot_.data(), coupling, stride_);
  }

  /// A factor that nothing is beside.
  kernels::FactoredBlock Alone(const RowMajor& factor) const {
    kernels::FactoredBlock block;
    block.u = factor.data();
    block.stride = stride_;
    return block;
  }

  /// U of a factor as it is stored.
  RowMajor Upper(const RowMajor& stored) const {
    RowMajor u = stored.triangularView<Eigen::Upper>();
    for (int k = 0; k < stride_; k += 4) {
      const Eigen::Matrix4d inverse = stored.block<4, 4>(k, k);
      EXPECT_TRUE(inverse.isUpperTriangular(0.0));
      u.block<4, 4>(k, k) = inverse.inverse();
    }
    return u;
  }

  static constexpr int kRows = 50;  // not a multiple of four
  int size_, stride_;
  Eigen::VectorXd min_pivot_ = Eigen::VectorXd::Constant(PaddedSize(GetParam()), 1e-14);
  RowMajor rows_;
  Eigen::VectorXd weights_;
  Eigen::MatrixXd expected_;
  std::vector<int> columns_;
  std::vector<const kernels::BlockKernels*> kernels_;
};

RowMajor UpperHalf(const RowMajor& m) { return m.triangularView<Eigen::Upper>(); }

TEST_P(Kernels, AddSquares) {
  const RowMajor first = Squares(*kernels_[0]);
  EXPECT_LT(UpperHalf(first - expected_).cwiseAbs().maxCoeff(), 1e-12);
  for (const auto* kernels : kernels_) EXPECT_EQ(UpperHalf(Squares(*kernels)), UpperHalf(first));
}

// Rows that are stored without some of their columns: every subset of up to eight.
TEST_P(Kernels, SquaresOfPackedRowsAreThoseOfWholeOnes) {
  const int vectors = std::min(8, stride_ / 4);
  for (unsigned support = 1; support < 1U << vectors; support += support < 16 ? 1 : 11) {
    std::vector<int> columns;
    for (int v = 0; v < vectors; ++v) {
      if ((support >> v & 1) != 0) columns.push_back(4 * v);
    }
    const auto width = 4 * static_cast<Eigen::Index>(columns.size());
    for (const int count : {1, 2, 6, 50}) {
      RowMajor packed(count, width), whole = RowMajor::Zero(count, stride_);
      for (size_t v = 0; v < columns.size(); ++v) {
        packed.middleCols<4>(4 * static_cast<Eigen::Index>(v)) = rows_.block(0, columns[v], count, 4);
        whole.middleCols<4>(columns[v]) = rows_.block(0, columns[v], count, 4);
      }
      const RowMajor squares = whole.transpose() * weights_.head(count).asDiagonal() * whole;
      RowMajor first;
      for (const auto* kernels : kernels_) {
        RowMajor m = RowMajor::Zero(stride_, stride_);
        double scratch[4 * kRows];
        kernels->add_squares({packed.data(), weights_.data(), count, columns, scratch}, m.data(), stride_);
        ASSERT_LT(UpperHalf(m - squares).cwiseAbs().maxCoeff(), 1e-12) << support << ' ' << count;
        if (kernels == kernels_[0]) first = m;
        ASSERT_EQ(UpperHalf(m), UpperHalf(first)) << support << ' ' << count;
      }
    }
  }
}

TEST_P(Kernels, CombinationAndProductsOfRows) {
  Eigen::RowVectorXd combination = Eigen::RowVectorXd::Ones(stride_);
  kernels::AddCombination(weights_.data(), rows_.data(), stride_, kRows, combination.data(), stride_);
  EXPECT_LT((combination - Eigen::RowVectorXd::Ones(stride_) - weights_.transpose() * rows_).cwiseAbs().maxCoeff(),
            1e-12);
  const Eigen::VectorXd x = Eigen::VectorXd::Random(stride_);
  Eigen::VectorXd products = Eigen::VectorXd::Ones(kRows);
  kernels::AddProducts(rows_.data(), stride_, kRows, x.data(), products.data(), stride_);
  EXPECT_LT((products - Eigen::VectorXd::Ones(kRows) - rows_ * x).cwiseAbs().maxCoeff(), 1e-12);
}

TEST_P(Kernels, FactorAndSolve) {
  const RowMajor squares = Squares(*kernels_[0]);
  RowMajor first = squares;
  ASSERT_TRUE(Factor(*kernels_[0], first));
  const RowMajor u = Upper(first);
  EXPECT_LT((u.transpose() * u - expected_).cwiseAbs().maxCoeff(), 1e-11);
  const Eigen::VectorXd right = Eigen::VectorXd::Random(stride_);
  Eigen::VectorXd x = right;
  kernels::SolveTransposed(first.data(), stride_, x.data());
  EXPECT_LT((u.transpose() * x - right).norm(), 1e-11);
  kernels::SolveBack(Alone(first), x.data());
  EXPECT_LT((expected_ * x - right).norm(), 1e-10);
  for (const auto* kernels : kernels_) {
    RowMajor m = squares;
    ASSERT_TRUE(Factor(*kernels, m));
    EXPECT_EQ(UpperHalf(m), UpperHalf(first));
  }
}

/// A tiled matrix as a whole one.
RowMajor WholeOf(const RowMajor& tiles) {
  RowMajor whole = RowMajor::Zero(tiles.rows(), tiles.rows());
  for (int i = 0; i < tiles.rows(); ++i) whole.block<1, 4>(i, i / 4 * 4) = tiles.row(i);
  return whole;
}

// A lower matrix in the sense of the kernels, with entries in every 4 x 4 block that may have some.
RowMajor Lower(int stride) {
  RowMajor lower = RowMajor::Random(stride, stride);
  for (int i = 0; i < stride; ++i) lower.row(i).tail(stride - i / 4 * 4 - std::min(4, stride - i / 4 * 4)).setZero();
  return lower;
}

// C of each kind, with rows beside a dense one, and what its T takes from the next block.
TEST_P(Kernels, WhatComesOfACoupling) {
  const RowMajor squares = Squares(*kernels_[0]), dense = RowMajor::Random(stride_, stride_);
  const RowMajor tiles = RowMajor::Random(stride_, 4);
  const RowMajor minus_left = RowMajor::Random(3, stride_), right = RowMajor::Random(3, stride_);
  const RowMajor a = RowMajor::Random(5, stride_), b = 0.5 * a;
  for (const bool tiled : {false, true}) {
    const RowMajor coupling = tiled ? WholeOf(tiles) : RowMajor(dense - minus_left.transpose() * right);
    RowMajor first_t, first_reduced;
    for (const auto* kernels : kernels_) {
      RowMajor m = squares, t = RowMajor::Constant(stride_, stride_, 7.0);
      for (int i = 0; tiled && i < stride_; ++i) t.row(i).tail(stride_ - i / 4 * 4 - 4).setZero();
      kernels::Coupling link = {tiles.data(), true, nullptr, nullptr, 0, t.data()};
      if (!tiled) link = {dense.data(), false, minus_left.data(), right.data(), 3, t.data()};
      ASSERT_TRUE(Factor(*kernels, m, link));
      EXPECT_LT((Upper(m).transpose() * t - coupling).cwiseAbs().maxCoeff(), 1e-10);
      for (int i = 0; tiled && i < stride_; ++i) EXPECT_TRUE(t.row(i).tail(stride_ - i / 4 * 4 - 4).isZero(0.0));
      RowMajor reduced = squares + t.transpose() * t + a.transpose() * b;
      const kernels::Reduction reduction = {t.data(), tiled, a.data(), b.data(), 5};
      ASSERT_TRUE(kernels->factor(reduction, reduced.data(), min_pivot_.data(), {}, stride_));
      EXPECT_LT(UpperHalf(Upper(reduced).transpose() * Upper(reduced) - squares).cwiseAbs().maxCoeff(), 1e-9);
      if (kernels == kernels_[0]) {
        first_t = t;
        first_reduced = reduced;
      }
      EXPECT_EQ(t, first_t);
      EXPECT_EQ(UpperHalf(reduced), UpperHalf(first_reduced));
    }
  }
}

TEST_P(Kernels, OfLowerAndTiledMatrices) {
  const RowMajor lower = Lower(stride_);
  const RowMajor tiles = RowMajor::Random(stride_, 4), tiled = WholeOf(tiles);
  const Eigen::VectorXd x = Eigen::VectorXd::Random(stride_);
  const auto error = [&](auto kernel, const RowMajor& m) {
    Eigen::VectorXd y = x;
    kernel(y);
    return (y - x - m * x).norm();
  };
  EXPECT_LT(error([&](auto& y) { kernels::AddCombinationOfLower(x.data(), lower.data(), y.data(), stride_); },
                  lower.transpose()),
            1e-13);
  EXPECT_LT(error([&](auto& y) { kernels::AddProductsOfTiled(tiles.data(), x.data(), y.data(), stride_); }, tiled),
            1e-13);
  EXPECT_LT(error([&](auto& y) { kernels::AddCombinationOfTiled(x.data(), tiles.data(), y.data(), stride_); },
                  tiled.transpose()),
            1e-13);
  RowMajor spread = RowMajor::Constant(stride_, stride_, 7.0);
  kernels::SpreadTilesUpper(tiles.data(), spread.data(), stride_);
  EXPECT_EQ(UpperHalf(spread), UpperHalf(tiled));
  kernels::SpreadTilesLower(tiles.data(), spread.data(), stride_);
  EXPECT_EQ(spread, tiled);
  kernels::CopyUpper(lower.data(), spread.data(), stride_);
  EXPECT_EQ(UpperHalf(spread), UpperHalf(lower));
}

TEST_P(Kernels, NoiseInThePlaceOfAPivotDoesNotGrow) {
  // A singular matrix: the exact pivots after the first are zero, the computed ones rounding errors of either sign.
  const Eigen::RowVectorXd row = rows_.row(0);
  for (const auto* kernels : kernels_) {
    RowMajor singular = 1e12 * row.transpose() * row;
    singular.diagonal().tail(stride_ - size_).setOnes();
    min_pivot_ = (1e-14 * singular.diagonal()).cwiseMax(1e-200);
    ASSERT_TRUE(Factor(*kernels, singular));
    Eigen::VectorXd x = row.transpose();
    kernels::SolveForward(Alone(singular), x.data());
    kernels::SolveBack(Alone(singular), x.data());
    EXPECT_TRUE(x.allFinite());
    EXPECT_LT(x.norm(), 1.0);
  }
}

TEST_P(Kernels, NonFinitePivotIsReported) {
  for (const auto* kernels : kernels_) {
    for (int i = 0; i < size_; ++i) {
      RowMajor m = Squares(*kernels);
      m(i, i) = std::numeric_limits<double>::quiet_NaN();
      EXPECT_FALSE(Factor(*kernels, m)) << i;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Sizes, Kernels, ::testing::Values(1, 3, 4, 7, 8, 35, 36, 61));

}  // namespace
}  // namespace legopt
