// The hand-written kernels against Eigen.

#include <gtest/gtest.h>

#include <Eigen/Dense>

#include "legopt/program/program.h"
#include "legopt/subproblem/dense_kernels.h"

namespace legopt {
namespace {

using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

class Kernels : public ::testing::TestWithParam<int> {
 protected:
  Kernels() : size_(GetParam()), stride_(PaddedSize(size_)) {
    std::srand(7);
    rows_ = RowMajor::Zero(kRows, stride_);
    rows_.leftCols(size_).setRandom();
    weights_ = Eigen::VectorXd::Random(kRows).cwiseAbs();
    scaled_ = weights_.asDiagonal() * rows_;
    expected_ = rows_.transpose() * weights_.asDiagonal() * rows_;
    matrix_ = RowMajor::Identity(stride_, stride_);
    kernels::AddProductsUpper(1.0, scaled_.data(), stride_, rows_.data(), stride_, kRows, matrix_.data(), stride_);
    expected_ += Eigen::MatrixXd::Identity(stride_, stride_);
  }

  static constexpr int kRows = 50;  // not a multiple of four
  int size_, stride_;
  Eigen::VectorXd min_pivot_ = Eigen::VectorXd::Constant(PaddedSize(GetParam()), 1e-14);
  RowMajor rows_, scaled_, matrix_;
  Eigen::VectorXd weights_;
  Eigen::MatrixXd expected_;
};

TEST_P(Kernels, AddProductsUpper) {
  const RowMajor difference = (matrix_ - expected_).triangularView<Eigen::Upper>();
  EXPECT_LT(difference.cwiseAbs().maxCoeff(), 1e-12);
}

TEST_P(Kernels, AddProductsFull) {
  const RowMajor right = RowMajor::Random(kRows, stride_);
  RowMajor m = RowMajor::Ones(stride_, stride_);
  kernels::AddProductsFull(-1.0, rows_.data(), stride_, right.data(), stride_, kRows, m.data(), stride_);
  const RowMajor expected = RowMajor::Ones(stride_, stride_) - rows_.transpose() * right;
  EXPECT_LT((m - expected).cwiseAbs().maxCoeff(), 1e-12);
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

// The factor with the diagonal itself in place of its inverse.
RowMajor Factor(const RowMajor& stored) {
  RowMajor u = stored.triangularView<Eigen::Upper>();
  u.diagonal() = u.diagonal().cwiseInverse();
  return u;
}

TEST_P(Kernels, FactorAndSolve) {
  ASSERT_TRUE(kernels::FactorUpper(matrix_.data(), stride_, min_pivot_.data()));
  const RowMajor u = Factor(matrix_);
  EXPECT_LT((u.transpose() * u - expected_).cwiseAbs().maxCoeff(), 1e-11);
  const Eigen::VectorXd right = Eigen::VectorXd::Random(stride_);
  Eigen::VectorXd x = right;
  kernels::SolveTransposed(matrix_.data(), stride_, x.data());
  EXPECT_LT((u.transpose() * x - right).norm(), 1e-11);
  kernels::SolveUpper(matrix_.data(), stride_, x.data());
  EXPECT_LT((expected_ * x - right).norm(), 1e-10);
}

TEST_P(Kernels, BlockSolve) {
  ASSERT_TRUE(kernels::FactorUpper(matrix_.data(), stride_, min_pivot_.data()));
  const RowMajor u = Factor(matrix_);
  const RowMajor right = RowMajor::Random(stride_, stride_);
  RowMajor x = right;
  kernels::SolveTransposedBlock(matrix_.data(), stride_, x.data());
  EXPECT_LT((u.transpose() * x - right).cwiseAbs().maxCoeff(), 1e-10);
}

// A lower matrix in the sense of the kernels, with entries in every 4 x 4 block that may have some.
RowMajor Lower(int stride) {
  RowMajor lower = RowMajor::Random(stride, stride);
  for (int i = 0; i < stride; ++i) lower.row(i).tail(stride - i / 4 * 4 - std::min(4, stride - i / 4 * 4)).setZero();
  return lower;
}

TEST_P(Kernels, OfLowerMatricesGiveTheBitsOfDenseOnes) {
  ASSERT_TRUE(kernels::FactorUpper(matrix_.data(), stride_, min_pivot_.data()));
  const RowMajor lower = Lower(stride_);
  ASSERT_TRUE(kernels::IsLower(lower.data(), stride_));
  RowMajor dense = lower, solved = lower;
  kernels::SolveTransposedBlock(matrix_.data(), stride_, dense.data());
  kernels::SolveTransposedLower(matrix_.data(), stride_, solved.data());
  EXPECT_EQ(dense, solved);
  EXPECT_TRUE(kernels::IsLower(solved.data(), stride_));
  RowMajor all = expected_, some = expected_;
  kernels::AddProductsUpper(-1.0, solved.data(), stride_, solved.data(), stride_, stride_, all.data(), stride_);
  kernels::SubtractProductsOfLower(solved.data(), some.data(), stride_);
  EXPECT_EQ(RowMajor(all.triangularView<Eigen::Upper>()), RowMajor(some.triangularView<Eigen::Upper>()));
  const Eigen::VectorXd x = Eigen::VectorXd::Random(stride_);
  Eigen::VectorXd a = x, b = x;
  kernels::AddCombination(x.data(), lower.data(), stride_, stride_, a.data(), stride_);
  kernels::AddCombinationOfLower(x.data(), lower.data(), b.data(), stride_);
  EXPECT_EQ(a, b);
  a = b = x;
  kernels::AddProducts(lower.data(), stride_, stride_, x.data(), a.data(), stride_);
  kernels::AddProductsOfLower(lower.data(), x.data(), b.data(), stride_);
  EXPECT_LT((a - b).norm(), 1e-13) << "four partial sums, of other lengths";
}

TEST(LowerMatrices, AreNotTakenForWhatTheyAreNot) {
  RowMajor m = RowMajor::Zero(12, 12);
  m(3, 3) = m(5, 7) = m(11, 0) = 1.0;
  EXPECT_TRUE(kernels::IsLower(m.data(), 12));
  m(3, 4) = 1e-300;
  EXPECT_FALSE(kernels::IsLower(m.data(), 12));
}

TEST(Panels, OfEveryWidthHaveTheSameBits) {
  const auto four = kernels::PanelOf(kernels::PanelVectors::kFour),
             eight = kernels::PanelOf(kernels::PanelVectors::kEight);
  ASSERT_NE(four, nullptr);
  if (eight == nullptr) GTEST_SKIP() << "this processor has no AVX-512";
  for (int columns = 0; columns <= 80; columns += 4) {
    for (const int count : {0, 1, 5, 40}) {
      // Never empty: a panel without rows may be asked for, but not of nothing.
      const RowMajor some = RowMajor::Random(41, 4), more = RowMajor::Random(41, 80), m = RowMajor::Random(4, 80);
      const RowMajor a = some.topRows(count), b = more.topRows(count);
      for (const double sign : {1.0, -1.0}) {
        RowMajor narrow = m, wide = m;
        four(sign, some.data(), 4, more.data(), 80, count, narrow.data(), 80, columns);
        eight(sign, some.data(), 4, more.data(), 80, count, wide.data(), 80, columns);
        ASSERT_EQ(narrow, wide) << columns << " columns, " << count << " rows";
        EXPECT_LT((narrow.leftCols(columns) - m.leftCols(columns) - sign * a.transpose() * b.leftCols(columns))
                      .cwiseAbs()
                      .sum(),
                  1e-10);
        EXPECT_EQ(narrow.rightCols(80 - columns), m.rightCols(80 - columns)) << "columns beyond are not touched";
      }
    }
  }
}

TEST_P(Kernels, NoiseInThePlaceOfAPivotDoesNotGrow) {
  // A singular matrix: the exact pivots after the first are zero, the computed ones rounding errors of either sign.
  const Eigen::RowVectorXd row = rows_.row(0);
  RowMajor singular = 1e12 * row.transpose() * row;
  singular.diagonal().tail(stride_ - size_).setOnes();
  const Eigen::VectorXd least = (1e-14 * singular.diagonal()).cwiseMax(1e-200);
  ASSERT_TRUE(kernels::FactorUpper(singular.data(), stride_, least.data()));
  Eigen::VectorXd x = row.transpose();
  kernels::SolveTransposed(singular.data(), stride_, x.data());
  kernels::SolveUpper(singular.data(), stride_, x.data());
  EXPECT_TRUE(x.allFinite());
  EXPECT_LT(x.norm(), 1.0);
}

TEST_P(Kernels, NonFinitePivotIsReported) {
  matrix_(0, 0) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(kernels::FactorUpper(matrix_.data(), stride_, min_pivot_.data()));
}

INSTANTIATE_TEST_SUITE_P(Sizes, Kernels, ::testing::Values(1, 3, 4, 7, 8, 35, 36));

}  // namespace
}  // namespace legopt
