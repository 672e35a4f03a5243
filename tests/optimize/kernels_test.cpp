// The hand-written kernels against Eigen.

#include "legopt/optimize/dense_kernels.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>

#include "legopt/problem/program.h"

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
    for (int i = 0; i < kRows; ++i) pointers_.push_back(rows_.row(i).data());
    expected_ = rows_.transpose() * weights_.asDiagonal() * rows_;
    matrix_ = RowMajor::Identity(stride_, stride_);
    kernels::AccumulateUpper(matrix_.data(), size_, stride_, pointers_.data(), weights_.data(), kRows);
    expected_ += Eigen::MatrixXd::Identity(stride_, stride_);
  }

  static constexpr int kRows = 50;  // not a multiple of four
  int size_, stride_;
  RowMajor rows_, matrix_;
  Eigen::VectorXd weights_;
  std::vector<const double*> pointers_;
  Eigen::MatrixXd expected_;
};

TEST_P(Kernels, AccumulateUpper) {
  const RowMajor difference = (matrix_ - expected_).triangularView<Eigen::Upper>();
  EXPECT_LT(difference.cwiseAbs().maxCoeff(), 1e-12);
}

TEST_P(Kernels, FactorAndSolve) {
  ASSERT_TRUE(kernels::FactorUpper(matrix_.data(), stride_, 1e-14));
  const RowMajor u = matrix_.triangularView<Eigen::Upper>();
  EXPECT_LT((u.transpose() * u - expected_).cwiseAbs().maxCoeff(), 1e-11);
  const Eigen::VectorXd right = Eigen::VectorXd::Random(stride_);
  Eigen::VectorXd x = right;
  kernels::SolveTransposed(matrix_.data(), stride_, x.data());
  EXPECT_LT((u.transpose() * x - right).norm(), 1e-11);
  kernels::SolveUpper(matrix_.data(), stride_, x.data());
  EXPECT_LT((expected_ * x - right).norm(), 1e-10);
}

TEST_P(Kernels, BlockSolve) {
  ASSERT_TRUE(kernels::FactorUpper(matrix_.data(), stride_, 1e-14));
  const RowMajor u = matrix_.triangularView<Eigen::Upper>();
  const RowMajor right = RowMajor::Random(stride_, stride_);
  RowMajor x = right;
  kernels::SolveTransposedBlock(matrix_.data(), stride_, x.data());
  EXPECT_LT((u.transpose() * x - right).cwiseAbs().maxCoeff(), 1e-10);
}

TEST_P(Kernels, NonFinitePivotIsReported) {
  matrix_(0, 0) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(kernels::FactorUpper(matrix_.data(), stride_, 1e-14));
}

INSTANTIATE_TEST_SUITE_P(Sizes, Kernels, ::testing::Values(1, 3, 4, 7, 8, 35, 36));

}  // namespace
}  // namespace legopt
