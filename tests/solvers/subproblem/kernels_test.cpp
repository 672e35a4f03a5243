// The hand-written kernels compared with Eigen.

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <limits>
#include <vector>

#include "legopt/problem/program.h"
#include "legopt/solvers/subproblem/block_kernels.h"
#include "legopt/solvers/subproblem/dense_kernels.h"

namespace legopt {
namespace {

constexpr kernels::BlockVectors kVectors[] = {kernels::BlockVectors::kFour, kernels::BlockVectors::kTwoFours,
                                              kernels::BlockVectors::kEight};
constexpr int kSizes[] = {1, 3, 4, 7, 8, 35, 36, 61};

template <typename Real>
using RowMajorOf = Eigen::Matrix<Real, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
template <typename Real>
using VectorOf = Eigen::Matrix<Real, Eigen::Dynamic, 1>;

/// Converts an error bound for doubles to one for Reals.
template <typename Real>
Real Rounding(double error) {
  return static_cast<Real>(error / std::numeric_limits<double>::epsilon()) * std::numeric_limits<Real>::epsilon();
}

/// Blocks of one size, and the kernels of every processor, which must have equal bits and be correct.
template <typename Real>
class Blocks {
 public:
  using RowMajor = RowMajorOf<Real>;
  using Vector = VectorOf<Real>;

  explicit Blocks(int size) : size_(size), stride_(PaddedSize(size)) {
    std::srand(7);
    rows_ = RowMajor::Zero(kRows, stride_);
    rows_.leftCols(size_).setRandom();
    weights_ = Vector::Random(kRows).cwiseAbs();
    expected_ = rows_.transpose() * weights_.asDiagonal() * rows_;
    expected_ += RowMajor::Identity(stride_, stride_);
    min_pivot_ = Vector::Constant(stride_, Rounding<Real>(1e-14));
    for (int j = 0; j < stride_; j += 4) columns_.push_back(j);
    for (const auto vectors : kVectors) {
      const kernels::BlockKernels<Real>* const kernels = kernels::KernelsOf<Real>(vectors);
      if (kernels != nullptr) kernels_.push_back(kernels);  // null if this processor lacks such vectors
    }
  }

  RowMajor Squares(const kernels::BlockKernels<Real>& kernels) const {
    RowMajor m = RowMajor::Identity(stride_, stride_);
    AddSquares(kernels, rows_, columns_, m);
    return m;
  }

  /// Adds `kernels`' squares of packed rows with the first weights, as one run and as the maximum number of runs.
  void AddSquares(const kernels::BlockKernels<Real>& kernels, const RowMajor& packed, const std::vector<int>& columns,
                  RowMajor& m) const {
    using Squares = kernels::PackedSquares<Real>;
    const auto count = static_cast<int>(packed.rows());
    Real scratch[Squares::kScratch * kRows];
    const kernels::WeightedRows<Real> all = {packed.data(), weights_.data(), count};
    const RowMajor before = m;
    kernels.add_squares({{&all, 1}, columns, scratch}, m.data(), m.data(), stride_);
    std::vector<kernels::WeightedRows<Real>> runs;
    for (int k = 0; k < Squares::kMaxRuns; ++k) {
      const int begin = count * k / Squares::kMaxRuns, end = count * (k + 1) / Squares::kMaxRuns;
      runs.push_back({packed.data() + begin * packed.cols(), weights_.data() + begin, end - begin});
    }
    RowMajor again = before;
    kernels.add_squares({runs, columns, scratch}, before.data(), again.data(), stride_);
    EXPECT_EQ(UpperHalf(again), UpperHalf(m));
  }

  bool Factor(const kernels::BlockKernels<Real>& kernels, RowMajor& m,
              const kernels::Coupling<Real>& coupling = {}) const {
    return kernels.factor({}, m.data(), min_pivot_.data(), coupling, stride_);
  }

  /// Returns a factor without couplings.
  kernels::FactoredBlock<Real> Alone(const RowMajor& factor) const {
    kernels::FactoredBlock<Real> block;
    block.u = factor.data();
    block.stride = stride_;
    return block;
  }

  /// Returns U of a stored factor.
  RowMajor Upper(const RowMajor& stored) const {
    RowMajor u = stored.template triangularView<Eigen::Upper>();
    for (int k = 0; k < stride_; k += 4) {
      const Eigen::Matrix<Real, 4, 4> inverse = stored.template block<4, 4>(k, k);
      EXPECT_TRUE(inverse.isUpperTriangular(Real{0}));
      u.template block<4, 4>(k, k) = inverse.inverse();
    }
    return u;
  }

  static RowMajor UpperHalf(const RowMajor& m) { return m.template triangularView<Eigen::Upper>(); }

  /// Returns a tiled matrix in dense storage.
  static RowMajor WholeOf(const RowMajor& tiles) {
    RowMajor whole = RowMajor::Zero(tiles.rows(), tiles.rows());
    for (int i = 0; i < tiles.rows(); ++i) whole.template block<1, 4>(i, i / 4 * 4) = tiles.row(i);
    return whole;
  }

  /// Returns a lower matrix in the sense of the kernels, with entries in every 4 x 4 block that may have some.
  static RowMajor Lower(int stride) {
    RowMajor lower = RowMajor::Random(stride, stride);
    for (int i = 0; i < stride; ++i) lower.row(i).tail(stride - i / 4 * 4 - std::min(4, stride - i / 4 * 4)).setZero();
    return lower;
  }

  static constexpr int kRows = 50;  // not a multiple of four
  int size_, stride_;
  Vector min_pivot_;
  RowMajor rows_;
  Vector weights_;
  RowMajor expected_;
  std::vector<int> columns_;
  std::vector<const kernels::BlockKernels<Real>*> kernels_;
};

/// Tests of doubles and of floats, in blocks of every size.
template <typename Real>
class Kernels : public ::testing::Test {
 protected:
  /// Returns blocks of each size.
  std::vector<Blocks<Real>>& OfEverySize() { return all_; }

 private:
  void SetUp() override {
    for (const int size : kSizes) all_.emplace_back(size);
  }
  std::vector<Blocks<Real>> all_;
};
using Reals = ::testing::Types<double, float>;
TYPED_TEST_SUITE(Kernels, Reals, );

TYPED_TEST(Kernels, AddSquares) {
  using Real = TypeParam;
  for (const Blocks<Real>& b : this->OfEverySize()) {
    const RowMajorOf<Real> first = b.Squares(*b.kernels_[0]);
    EXPECT_LT(b.UpperHalf(first - b.expected_).cwiseAbs().maxCoeff(), Rounding<Real>(1e-12)) << b.size_;
    for (const auto* kernels : b.kernels_) EXPECT_EQ(b.UpperHalf(b.Squares(*kernels)), b.UpperHalf(first)) << b.size_;
  }
}

// Rows that are stored without some of their columns: every subset of up to eight.
TYPED_TEST(Kernels, SquaresOfPackedRowsAreThoseOfWholeOnes) {
  using Real = TypeParam;
  using RowMajor = RowMajorOf<Real>;
  for (const Blocks<Real>& b : this->OfEverySize()) {
    const int vectors = std::min(8, b.stride_ / 4);
    for (unsigned support = 1; support < 1U << vectors; support += support < 16 ? 1 : 11) {
      std::vector<int> columns;
      for (int v = 0; v < vectors; ++v) {
        if ((support >> v & 1) != 0) columns.push_back(4 * v);
      }
      const auto width = 4 * static_cast<Eigen::Index>(columns.size());
      for (const int count : {1, 2, 6, 50}) {
        RowMajor packed(count, width), whole = RowMajor::Zero(count, b.stride_);
        for (size_t v = 0; v < columns.size(); ++v) {
          packed.middleCols(4 * static_cast<Eigen::Index>(v), 4) = b.rows_.block(0, columns[v], count, 4);
          whole.middleCols(columns[v], 4) = b.rows_.block(0, columns[v], count, 4);
        }
        const RowMajor squares = whole.transpose() * b.weights_.head(count).asDiagonal() * whole;
        RowMajor first;
        for (const auto* kernels : b.kernels_) {
          RowMajor m = RowMajor::Zero(b.stride_, b.stride_);
          b.AddSquares(*kernels, packed, columns, m);
          ASSERT_LT(b.UpperHalf(m - squares).cwiseAbs().maxCoeff(), Rounding<Real>(1e-12)) << support << ' ' << count;
          if (kernels == b.kernels_[0]) first = m;
          ASSERT_EQ(b.UpperHalf(m), b.UpperHalf(first)) << support << ' ' << count;
        }
      }
    }
  }
}

TYPED_TEST(Kernels, CombinationAndProductsOfRows) {
  using Real = TypeParam;
  using Vector = VectorOf<Real>;
  for (const Blocks<Real>& b : this->OfEverySize()) {
    const Vector ones = Vector::Ones(b.stride_);
    Vector combination = ones;
    kernels::AddCombination(b.weights_.data(), b.rows_.data(), b.stride_, b.kRows, combination.data(), b.stride_);
    EXPECT_LT((combination - ones - b.rows_.transpose() * b.weights_).cwiseAbs().maxCoeff(), Rounding<Real>(1e-12));
    kernels::SubtractCombination<Real>(kernels::Load(b.weights_.data()), b.rows_.data(), b.stride_, combination.data(),
                                       b.stride_);
    const Eigen::Index rest = b.kRows - 4;
    EXPECT_LT((combination - ones - b.rows_.bottomRows(rest).transpose() * b.weights_.tail(rest)).cwiseAbs().maxCoeff(),
              Rounding<Real>(1e-12));
    const Vector x = Vector::Random(b.stride_);
    Vector products = Vector::Ones(b.kRows);
    kernels::AddProducts(b.rows_.data(), b.stride_, b.kRows, x.data(), products.data(), b.stride_);
    EXPECT_LT((products - Vector::Ones(b.kRows) - b.rows_ * x).cwiseAbs().maxCoeff(), Rounding<Real>(1e-12));
  }
}

TYPED_TEST(Kernels, FactorAndSolve) {
  using Real = TypeParam;
  using RowMajor = RowMajorOf<Real>;
  using Vector = VectorOf<Real>;
  for (const Blocks<Real>& b : this->OfEverySize()) {
    SCOPED_TRACE(b.size_);
    const RowMajor squares = b.Squares(*b.kernels_[0]);
    RowMajor first = squares;
    ASSERT_TRUE(b.Factor(*b.kernels_[0], first));
    const RowMajor u = b.Upper(first);
    EXPECT_LT((u.transpose() * u - b.expected_).cwiseAbs().maxCoeff(), Rounding<Real>(1e-11));
    const Vector right = Vector::Random(b.stride_);
    Vector x = right;
    kernels::SolveTransposed(first.data(), b.stride_, x.data());
    EXPECT_LT((u.transpose() * x - right).norm(), Rounding<Real>(1e-11));
    kernels::SolveBack(b.Alone(first), x.data());
    EXPECT_LT((b.expected_ * x - right).norm(), Rounding<Real>(1e-10));
    for (const auto* kernels : b.kernels_) {
      RowMajor m = squares;
      ASSERT_TRUE(b.Factor(*kernels, m));
      EXPECT_EQ(b.UpperHalf(m), b.UpperHalf(first));
    }
  }
}

// C of each kind, with rows in addition to a dense one, and the amount that its T subtracts from the next block.
TYPED_TEST(Kernels, WhatComesOfACoupling) {
  using Real = TypeParam;
  using RowMajor = RowMajorOf<Real>;
  for (const Blocks<Real>& b : this->OfEverySize()) {
    SCOPED_TRACE(b.size_);
    const int stride = b.stride_;
    const RowMajor squares = b.Squares(*b.kernels_[0]), dense = RowMajor::Random(stride, stride);
    const RowMajor tiles = RowMajor::Random(stride, 4);
    const RowMajor minus_left = RowMajor::Random(3, stride), right = RowMajor::Random(3, stride);
    const RowMajor rows = RowMajor::Random(5, stride), halves = Real{0.5} * rows;
    for (const bool tiled : {false, true}) {
      const RowMajor coupling = tiled ? b.WholeOf(tiles) : RowMajor(dense - minus_left.transpose() * right);
      RowMajor first_t, first_reduced;
      for (const auto* kernels : b.kernels_) {
        RowMajor m = squares, t = RowMajor::Constant(stride, stride, Real{7});
        for (int i = 0; tiled && i < stride; ++i) t.row(i).tail(stride - i / 4 * 4 - 4).setZero();
        kernels::Coupling<Real> link = {tiles.data(), true, nullptr, nullptr, 0, t.data()};
        if (!tiled) link = {dense.data(), false, minus_left.data(), right.data(), 3, t.data()};
        ASSERT_TRUE(b.Factor(*kernels, m, link));
        EXPECT_LT((b.Upper(m).transpose() * t - coupling).cwiseAbs().maxCoeff(), Rounding<Real>(1e-10));
        for (int i = 0; tiled && i < stride; ++i) EXPECT_TRUE(t.row(i).tail(stride - i / 4 * 4 - 4).isZero(Real{0}));
        RowMajor reduced = squares + t.transpose() * t + rows.transpose() * halves;
        const kernels::Reduction<Real> reduction = {t.data(), tiled, rows.data(), halves.data(), 5};
        ASSERT_TRUE(kernels->factor(reduction, reduced.data(), b.min_pivot_.data(), {}, stride));
        EXPECT_LT(b.UpperHalf(b.Upper(reduced).transpose() * b.Upper(reduced) - squares).cwiseAbs().maxCoeff(),
                  Rounding<Real>(1e-9));
        if (kernels == b.kernels_[0]) {
          first_t = t;
          first_reduced = reduced;
        }
        EXPECT_EQ(t, first_t);
        EXPECT_EQ(b.UpperHalf(reduced), b.UpperHalf(first_reduced));
      }
    }
  }
}

TYPED_TEST(Kernels, OfLowerAndTiledMatrices) {
  using Real = TypeParam;
  using RowMajor = RowMajorOf<Real>;
  for (const Blocks<Real>& b : this->OfEverySize()) {
    SCOPED_TRACE(b.size_);
    const int stride = b.stride_;
    const RowMajor lower = b.Lower(stride);
    const RowMajor tiles = RowMajor::Random(stride, 4), tiled = b.WholeOf(tiles);
    const VectorOf<Real> x = VectorOf<Real>::Random(stride);
    VectorOf<Real> y = x;
    kernels::AddCombinationOfLower(x.data(), lower.data(), y.data(), stride);
    EXPECT_LT((y - x - lower.transpose() * x).norm(), Rounding<Real>(1e-13));
    RowMajor spread = RowMajor::Constant(stride, stride, Real{7});
    kernels::SpreadTilesUpper(tiles.data(), spread.data(), stride);
    EXPECT_EQ(b.UpperHalf(spread), b.UpperHalf(tiled));
    kernels::SpreadTilesLower(tiles.data(), spread.data(), stride);
    EXPECT_EQ(spread, tiled);
    kernels::CopyUpper(lower.data(), spread.data(), stride);
    EXPECT_EQ(b.UpperHalf(spread), b.UpperHalf(lower));
  }
}

// Products with costs, which are always doubles.
TEST(CostKernels, ProductsAreThoseOfTheMatrix) {
  for (const int size : kSizes) {
    SCOPED_TRACE(size);
    using RowMajor = RowMajorOf<double>;
    const int stride = PaddedSize(size);
    const RowMajor dense = RowMajor::Random(stride, stride), tiles = RowMajor::Random(stride, 4);
    const RowMajor tiled = Blocks<double>::WholeOf(tiles);
    const RowMajor symmetric = dense + dense.transpose();
    RowMajor upper = symmetric;  // nothing is read left of the diagonal's tiles
    for (int i = 0; i < stride; ++i) upper.row(i).head(i / 4 * 4).setConstant(1e3);
    const Eigen::VectorXd x = Eigen::VectorXd::Random(stride), c = Eigen::VectorXd::Random(stride);
    Eigen::VectorXd y = x;
    kernels::AddProductsOfTiled(tiles.data(), x.data(), y.data(), stride);
    EXPECT_LT((y - x - tiled * x).norm(), 1e-13);
    y = x;
    kernels::AddCombinationOfTiled(x.data(), tiles.data(), y.data(), stride);
    EXPECT_LT((y - x - tiled.transpose() * x).norm(), 1e-13);
    y = x;
    kernels::AddProductsOfSymmetric(upper.data(), x.data(), y.data(), stride);
    EXPECT_LT((y - x - symmetric * x).norm(), 1e-12);
    y = x;
    Eigen::VectorXd transposed = c;
    kernels::AddBothProducts(dense.data(), stride, x.data(), y.data(), c.data(), transposed.data());
    EXPECT_LT((y - x - dense * x).norm(), 1e-12);
    EXPECT_LT((transposed - c - dense.transpose() * c).norm(), 1e-12);
  }
}

TYPED_TEST(Kernels, NoiseInThePlaceOfAPivotDoesNotGrow) {
  // A singular matrix: the exact pivots after the first are zero, the computed ones are rounding errors of either
  // sign.
  using Real = TypeParam;
  for (Blocks<Real>& b : this->OfEverySize()) {
    const VectorOf<Real> row = b.rows_.row(0);
    for (const auto* kernels : b.kernels_) {
      RowMajorOf<Real> singular = Real{1e12F} * row * row.transpose();
      singular.diagonal().tail(b.stride_ - b.size_).setOnes();
      b.min_pivot_ = (Rounding<Real>(1e-14) * singular.diagonal()).cwiseMax(std::numeric_limits<Real>::min());
      ASSERT_TRUE(b.Factor(*kernels, singular));
      VectorOf<Real> x = row;
      kernels::SolveForward(b.Alone(singular), x.data());
      kernels::SolveBack(b.Alone(singular), x.data());
      EXPECT_TRUE(x.allFinite());
      EXPECT_LT(x.norm(), Real{1});
    }
  }
}

TYPED_TEST(Kernels, NonFinitePivotIsReported) {
  using Real = TypeParam;
  for (const Blocks<Real>& b : this->OfEverySize()) {
    for (const auto* kernels : b.kernels_) {
      for (int i = 0; i < b.size_; ++i) {
        RowMajorOf<Real> m = b.Squares(*kernels);
        m(i, i) = std::numeric_limits<Real>::quiet_NaN();
        EXPECT_FALSE(b.Factor(*kernels, m)) << i;
      }
    }
  }
}

}  // namespace
}  // namespace legopt
