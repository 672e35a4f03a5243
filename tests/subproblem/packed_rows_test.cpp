// Packed rows against the rows as the problem has them.

#include "legopt/subproblem/packed_rows.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <numeric>
#include <vector>

namespace legopt {
namespace {

constexpr int kVariables = 17, kAllBlocks = 4;

/// Rows of all kinds: some dense, some with few columns, some between blocks, one that touches fixed variables only.
ConvexSubproblem Problem() {
  std::srand(3);
  ConvexSubproblem problem(kAllBlocks, kVariables);
  const auto add = [&](int block, int blocks, const std::vector<int>& columns, int rows, TermKind kind, double weight) {
    LinearModel model;
    model.Reset(rows, kVariables, blocks);
    for (int i = 0; i < rows; ++i) {
      model.value(i) = Eigen::VectorXd::Random(1)[0];
      for (int k = 0; k < blocks; ++k) {
        for (const int j : columns) model.row(k, i)[j] = Eigen::VectorXd::Random(1)[0];
      }
    }
    problem.AddPenalties(block, model, kind, weight);
  };
  std::vector<int> all(kVariables);
  std::iota(all.begin(), all.end(), 0);
  for (int t = 0; t < kAllBlocks; ++t) {
    add(t, 1, {1, 2, 13, 14}, 6, TermKind::kEquality, 100.0);
    add(t, 1, all, 3, TermKind::kInequality, 100.0);
    add(t, 1, {16}, 1, TermKind::kInequality, 50.0);
    add(t, 1, {3, 12, 15}, 2, TermKind::kEquality, 100.0);  // the columns of the first, four at a time
    if (t + 1 < kAllBlocks) add(t, 2, {5, 9}, 2, TermKind::kInequality, 10.0);
  }
  return problem;
}

/// All variables of the first block and one of the third are fixed, the latter at 0.25.
class Packed : public ::testing::Test {
 protected:
  Packed() : problem_(Problem()), stride_(problem_.stride()) {
    const auto all = static_cast<size_t>(kAllBlocks * stride_);
    free_.assign(all, 0.0);
    fixed_.assign(all, 0.0);
    for (int t = 1; t < kAllBlocks; ++t) std::fill_n(free_.begin() + t * stride_, kVariables, 1.0);
    free_[static_cast<size_t>(2 * stride_ + 13)] = 0.0;
    fixed_[static_cast<size_t>(2 * stride_ + 13)] = 0.25;
    rows_.Pack(problem_, {free_, fixed_, true, 1, kAllBlocks});
    d_ = Eigen::VectorXd::Random(static_cast<Eigen::Index>(rows_.size())).cwiseAbs();
    matrix_ = Matrix();
  }

  /// A, column by column.
  Eigen::MatrixXd Matrix() const {
    const Eigen::Index columns = (kAllBlocks - 1) * stride_;
    Eigen::MatrixXd a(static_cast<Eigen::Index>(rows_.size()), columns);
    for (Eigen::Index j = 0; j < columns; ++j) {
      AlignedDoubles x(static_cast<size_t>(columns), 0.0), product(rows_.size(), 0.0);
      x[static_cast<size_t>(j)] = 1.0;
      rows_.AddProducts(x, product);
      a.col(j) = Eigen::VectorXd::Map(product.data(), a.rows());
    }
    return a;
  }

  ConvexSubproblem problem_;
  int stride_;
  AlignedDoubles free_, fixed_;
  PackedRows rows_;
  Eigen::VectorXd d_;
  Eigen::MatrixXd matrix_;
};

// Each row of the problem that depends on anything is there once, with its offset where the fixed variables are.
TEST_F(Packed, HaveEveryRowOnce) {
  Eigen::VectorXd x = Eigen::VectorXd::Random((kAllBlocks - 1) * stride_);
  double packed = 0.0, whole = 0.0, constant = 0.0;
  const Eigen::VectorXd a = matrix_ * x;
  for (size_t i = 0; i < rows_.size(); ++i) {
    const double value = rows_.offset(i) + a[static_cast<Eigen::Index>(i)];
    packed += rows_.weight(i) * (rows_.absolute(i) ? std::abs(value) : std::max(0.0, value));
  }
  Eigen::VectorXd dx = Eigen::VectorXd::Zero(kAllBlocks * kVariables);
  for (int t = 1; t < kAllBlocks; ++t)
    dx.segment(t * kVariables, kVariables) = x.segment((t - 1) * stride_, kVariables);
  dx[2 * kVariables + 13] = 0.25;
  whole = problem_.Value(dx);
  size_t left_out = 0;
  for (const ConvexSubproblem::Row& row : problem_.rows()) {
    if (row.block > 0 || row.num_blocks > 1) continue;
    constant += row.weight * (row.absolute ? std::abs(row.offset) : std::max(0.0, row.offset));
    ++left_out;
  }
  EXPECT_EQ(rows_.size() + left_out, problem_.rows().size());
  EXPECT_NEAR(packed + constant, whole, 1e-10);
}

TEST_F(Packed, TransposedProductsAreThoseOfTheMatrix) {
  AlignedDoubles sum(static_cast<size_t>(matrix_.cols()), 1.0);
  rows_.AddTransposed({d_.begin(), d_.end()}, sum);
  const Eigen::VectorXd expected = Eigen::VectorXd::Ones(matrix_.cols()) + matrix_.transpose() * d_;
  EXPECT_LT((Eigen::VectorXd::Map(sum.data(), matrix_.cols()) - expected).norm(), 1e-12);
}

TEST_F(Packed, SquaresAndCouplingsAreThoseOfTheMatrix) {
  const Eigen::MatrixXd squares = matrix_.transpose() * d_.asDiagonal() * matrix_;
  const AlignedDoubles d(d_.begin(), d_.end());
  BlockChain chain;
  chain.Reset(kAllBlocks - 1, stride_, true);
  for (int t = 0; t + 1 < kAllBlocks; ++t) {
    std::fill_n(chain.block(t), stride_ * stride_, 0.0);
    rows_.AddSquares(t, d, chain);
    const auto part = squares.block(t * stride_, t * stride_, stride_, stride_);
    for (int i = 0; i < stride_; ++i) {
      for (int j = i; j < stride_; ++j) EXPECT_NEAR(chain.block(t)[i * stride_ + j], part(i, j), 1e-12);
    }
    if (t + 2 == kAllBlocks) continue;
    EXPECT_EQ(rows_.num_between(t), 2);
    chain.SetCoupling(t, true, 2);
    rows_.SetCouplingRows(t, d, chain);
    for (int i = 0; i < stride_; ++i) {
      for (int j = 0; j < stride_; ++j) {
        double entry = 0.0;
        for (int r = 0; r < 2; ++r) entry += chain.left(t, r)[i] * chain.right(t, r)[j];
        EXPECT_NEAR(entry, squares(t * stride_ + i, (t + 1) * stride_ + j), 1e-12);
      }
    }
  }
}

}  // namespace
}  // namespace legopt
