// Packed rows compared with the rows of the problem.

#include "legopt/solvers/subproblem/packed_rows.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <limits>
#include <numeric>
#include <vector>

#include "legopt/solvers/subproblem/aligned_numbers.h"

namespace legopt {
namespace {

constexpr int kVariables = 17, kAllBlocks = 4;

using Columns = std::vector<int>;

class RandomRows {
 public:
  RandomRows() : problem_(kAllBlocks, kVariables) { std::srand(3); }

  /// Adds rows with coefficients in these columns of each block from `block` on.
  void Add(int block, const std::vector<Columns>& columns, int rows, TermKind kind, double weight) {
    const auto blocks = static_cast<int>(columns.size());
    LinearModel model;
    model.Reset(rows, kVariables, blocks);
    for (int i = 0; i < rows; ++i) {
      model.value(i) = Eigen::VectorXd::Random(1)[0];
      for (int k = 0; k < blocks; ++k) {
        for (const int j : columns[static_cast<size_t>(k)]) model.row(k, i)[j] = Eigen::VectorXd::Random(1)[0];
      }
    }
    problem_.AddPenalties(block, model, kind, weight);
  }
  const ConvexSubproblem& problem() const { return problem_; }

 private:
  ConvexSubproblem problem_;
};

Columns AllColumns() {
  Columns all(kVariables);
  std::iota(all.begin(), all.end(), 0);
  return all;
}

/// Returns rows of all kinds: some dense, some with few columns, some between blocks, one that depends only on fixed
/// variables.
ConvexSubproblem RowsOfAllKinds() {
  RandomRows rows;
  for (int t = 0; t < kAllBlocks; ++t) {
    rows.Add(t, {{1, 2, 13, 14}}, 6, TermKind::kEquality, 100.0);
    rows.Add(t, {AllColumns()}, 3, TermKind::kInequality, 100.0);
    rows.Add(t, {{16}}, 1, TermKind::kInequality, 50.0);
    rows.Add(t, {{3, 12, 15}}, 2, TermKind::kEquality, 100.0);  // the columns of the first, four at a time
    if (t + 1 < kAllBlocks) rows.Add(t, {{5, 9}, {5, 9}}, 2, TermKind::kInequality, 10.0);
  }
  return rows.problem();
}

/// Returns rows with all columns of their first block, in more adjacent groups than kernels process at once.
ConvexSubproblem WholeRows() {
  RandomRows rows;
  for (int t = 0; t < kAllBlocks; ++t) {
    rows.Add(t, {AllColumns()}, 5, TermKind::kInequality, 100.0);
    if (t + 1 == kAllBlocks) continue;
    for (const int j : {0, 4, 8, 12}) rows.Add(t, {AllColumns(), {j}}, 1, TermKind::kEquality, 10.0);
    rows.Add(t, {AllColumns(), AllColumns()}, 3, TermKind::kEquality, 10.0);
  }
  return rows.problem();
}

/// All variables of the first block and one of the third are fixed, the latter at 0.25.
class Packed : public ::testing::TestWithParam<ConvexSubproblem (*)()> {
 protected:
  Packed() : problem_(GetParam()()), stride_(problem_.stride()) {
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

  /// Returns A, column by column.
  Eigen::MatrixXd Matrix() const {
    const Eigen::Index columns = (kAllBlocks - 1) * stride_;
    Eigen::MatrixXd a(static_cast<Eigen::Index>(rows_.size()), columns);
    for (Eigen::Index j = 0; j < columns; ++j) {
      AlignedDoubles x(static_cast<size_t>(columns), 0.0), product(rows_.size(), 0.0);
      x[static_cast<size_t>(j)] = 1.0;
      rows_.AddProducts(rows_.coefficients().data(), x, product);
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

// Each row of the problem with free variables occurs once, with the fixed variables included in its offset.
TEST_P(Packed, HaveEveryRowOnce) {
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

/// Expects that products in Reals equal those of `matrix`, A, up to rounding.
template <typename Real>
void ExpectProducts(const PackedRows& rows, const Eigen::VectorXd& weights, const Eigen::MatrixXd& matrix) {
  RoundedNumbers<Real> coefficients;
  coefficients.Set(rows.coefficients());
  const AlignedNumbers<Real> d(weights.begin(), weights.end());
  AlignedNumbers<Real> sum(static_cast<size_t>(matrix.cols()), Real{1}), products(rows.size(), Real{1});
  for (int t = 0; t + 1 < kAllBlocks; ++t) rows.AddTransposed(t, coefficients.data(), d.data(), sum);
  const auto in_doubles = [](const AlignedNumbers<Real>& v) {
    return Eigen::VectorXd(
        Eigen::VectorX<Real>::Map(v.data(), static_cast<Eigen::Index>(v.size())).template cast<double>());
  };
  const double accuracy = 5e3 * static_cast<double>(std::numeric_limits<Real>::epsilon());
  EXPECT_LT((in_doubles(sum) - Eigen::VectorXd::Ones(matrix.cols()) - matrix.transpose() * weights).norm(), accuracy);
  const AlignedNumbers<Real> x = sum;
  rows.AddProducts(coefficients.data(), x, products);
  EXPECT_LT((in_doubles(products) - Eigen::VectorXd::Ones(matrix.rows()) - matrix * in_doubles(x)).norm(), accuracy);
}

TEST_P(Packed, ProductsAreThoseOfTheMatrix) {
  ExpectProducts<double>(rows_, d_, matrix_);
  ExpectProducts<float>(rows_, d_, matrix_);
}

/// Compares H + A^T D A for a random H, given separately or already in the block.
template <typename Real>
void ExpectSquares(const PackedRows& rows, const Eigen::VectorXd& weights, const Eigen::MatrixXd& squares, int stride,
                   bool in_place) {
  RoundedNumbers<Real> coefficients;
  coefficients.Set(rows.coefficients());
  const AlignedNumbers<Real> d(weights.begin(), weights.end());
  const Eigen::MatrixX<Real> h = Eigen::MatrixX<Real>::Random(stride, stride);
  const Eigen::Matrix<Real, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> h_by_row = h;
  const double accuracy = 5e3 * static_cast<double>(std::numeric_limits<Real>::epsilon());
  AlignedNumbers<Real> scratch;
  BlockChain<Real> chain;
  chain.Reset(kAllBlocks - 1, stride, true);
  for (int t = 0; t + 1 < kAllBlocks; ++t) {
    Real* const block = chain.block(t);
    if (in_place) std::copy_n(h_by_row.data(), stride * stride, block);
    rows.AddSquares(t, coefficients.data(), d.data(), in_place ? block : h_by_row.data(), scratch, chain);
    for (int i = 0; i < stride; ++i) {
      for (int j = i; j < stride; ++j) {
        const double expected = static_cast<double>(h(i, j)) + squares(t * stride + i, t * stride + j);
        EXPECT_NEAR(static_cast<double>(block[i * stride + j]), expected, accuracy);
      }
    }
    if (t + 2 == kAllBlocks) continue;
    chain.SetCoupling(t, rows.num_between(t) <= kernels::kMaxExtraRows, rows.num_between(t));
    rows.SetCouplingRows(t, coefficients.data(), d.data(), chain);
    for (int i = 0; i < stride; ++i) {
      for (int j = 0; j < stride; ++j) {
        double entry = 0.0;
        for (int r = 0; r < rows.num_between(t); ++r)
          entry += static_cast<double>(chain.left(t, r)[i] * chain.right(t, r)[j]);
        EXPECT_NEAR(entry, squares(t * stride + i, (t + 1) * stride + j), accuracy);
      }
    }
  }
}

TEST_P(Packed, SquaresAndCouplingsAreThoseOfTheMatrix) {
  const Eigen::MatrixXd squares = matrix_.transpose() * d_.asDiagonal() * matrix_;
  for (const bool in_place : {false, true}) {
    ExpectSquares<double>(rows_, d_, squares, stride_, in_place);
    ExpectSquares<float>(rows_, d_, squares, stride_, in_place);
  }
}

TEST(PackedRows, CountRowsBetweenBlocks) {
  const ConvexSubproblem problem = WholeRows();
  const AlignedDoubles free(static_cast<size_t>(kAllBlocks * problem.stride()), 1.0), fixed(free.size(), 0.0);
  PackedRows rows;
  rows.Pack(problem, {free, fixed, false, 0, kAllBlocks});
  EXPECT_TRUE(rows.any_between());
  for (int t = 0; t + 1 < kAllBlocks; ++t) EXPECT_EQ(rows.num_between(t), 7);
}

INSTANTIATE_TEST_SUITE_P(Rows, Packed, ::testing::Values(RowsOfAllKinds, WholeRows));

}  // namespace
}  // namespace legopt
