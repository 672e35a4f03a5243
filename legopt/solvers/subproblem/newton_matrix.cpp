#include "legopt/solvers/subproblem/newton_matrix.h"

#include <algorithm>

#include "legopt/solvers/subproblem/block_kernels.h"
#include "legopt/solvers/subproblem/dense_kernels.h"

namespace legopt {

void CostBlocks::Copy(const ConvexSubproblem& problem, const PackedRows::FreeVariables& freedom, const PackedRows& rows,
                      double scale) {
  num_blocks_ = freedom.end_block - freedom.first_block;
  stride_ = problem.stride();
  scale_ = scale;
  const auto stride = static_cast<size_t>(stride_);
  const size_t begin = static_cast<size_t>(freedom.first_block) * stride;
  gradient_.resize(static_cast<size_t>(num_blocks_) * stride);
  for (size_t i = 0; i < gradient_.size(); ++i) {
    gradient_[i] = problem.gradient()[begin + i] / scale * freedom.free[begin + i];
  }
  hessian_.clear();
  coupling_.clear();
  num_entries_ = 0;
  for (int t = 0; t < num_blocks_; ++t) CopyHessian(problem, freedom, t);
  coupled_ = problem.has_coupling() && num_blocks_ > 1;
  chained_ = coupled_ || rows.any_between();
  for (int t = 0; chained_ && t + 1 < num_blocks_; ++t) {
    // Many rows between blocks make the coupling dense.
    const bool few = rows.num_between(t) <= kernels::kMaxExtraRows;
    CopyCoupling(problem, freedom, few && problem.coupling_is_tiled(t + freedom.first_block), t);
  }
  if (freedom.shifted) ShiftByFixed(problem, freedom);
}

CostBlocks::Square CostBlocks::NewSquare(bool tiled) {
  const auto stride = static_cast<size_t>(stride_);
  const Square square = {tiled, num_entries_};
  num_entries_ += stride * (tiled ? kernels::kLanes : stride);
  if (entries_.size() < num_entries_) entries_.resize(num_entries_);
  return square;
}

/// Copies block t of H. Rows and columns of fixed variables become those of the identity.
void CostBlocks::CopyHessian(const ConvexSubproblem& problem, const PackedRows::FreeVariables& freedom, int t) {
  const int block = t + freedom.first_block;
  hessian_.push_back(NewSquare(problem.hessian_is_tiled(block)));
  double* const to = Entries(hessian_.back());
  const bool tiled = hessian_.back().tiled;
  const double* const from = problem.hessian(block);
  const double* const free = freedom.free.data() + static_cast<std::ptrdiff_t>(block) * stride_;
  const int step = tiled ? kernels::kLanes : stride_;
  const double inverse = 1.0 / scale_;
  for (int i = 0; i < stride_; ++i) {
    const int tile = i / kernels::kLanes * kernels::kLanes, first = tiled ? tile : 0;
    double* const row = to + static_cast<std::ptrdiff_t>(i) * step - first;
    const double* const from_row = from + static_cast<std::ptrdiff_t>(i) * stride_;
    const double factor = inverse * free[i];
    for (int j = i; j < (tiled ? tile + kernels::kLanes : stride_); ++j) row[j] = factor * free[j] * from_row[j];
    if (free[i] == 0.0) row[i] = 1.0;
    for (int j = tile; j < i; ++j) row[j] = to[static_cast<std::ptrdiff_t>(j) * step + i - first];
  }
}

void CostBlocks::CopyCoupling(const ConvexSubproblem& problem, const PackedRows::FreeVariables& freedom, bool tiled,
                              int t) {
  const int block = t + freedom.first_block;
  coupling_.push_back(NewSquare(tiled));
  double* const to = Entries(coupling_.back());
  const double* const from = problem.coupling(block);
  const double* const free = freedom.free.data() + static_cast<std::ptrdiff_t>(block) * stride_;
  const int width = tiled ? kernels::kLanes : stride_;
  const double inverse = 1.0 / scale_;
  for (int i = 0; i < stride_; ++i) {
    const int first = tiled ? i / kernels::kLanes * kernels::kLanes : 0;
    for (int j = 0; j < width; ++j) {
      const double both = free[i] * free[stride_ + first + j] * inverse;
      to[static_cast<std::ptrdiff_t>(i) * width + j] =
          both * from[static_cast<std::ptrdiff_t>(i) * stride_ + first + j];
    }
  }
}

/// Adds H x of the fixed variables to the gradient.
void CostBlocks::ShiftByFixed(const ConvexSubproblem& problem, const PackedRows::FreeVariables& freedom) {
  const int n = problem.block_size();
  const auto place = [&](int k) { return static_cast<size_t>(k / n * stride_ + k % n); };
  const size_t begin = static_cast<size_t>(freedom.first_block) * static_cast<size_t>(stride_);
  const auto add = [&](size_t i, double change) {
    if (i >= begin && i < begin + gradient_.size()) gradient_[i - begin] += change * freedom.free[i] / scale_;
  };
  ForEachHessianEntry(problem, problem.has_coupling(), [&](int i, int j, double value) {
    add(place(i), value * freedom.fixed[place(j)]);
    if (i != j) add(place(j), value * freedom.fixed[place(i)]);
  });
}

void CostBlocks::Slope(const AlignedDoubles& x, AlignedDoubles& slope) const {
  std::copy(gradient_.begin(), gradient_.end(), slope.begin());
  for (int t = 0; t < num_blocks_; ++t) {
    const double* const from = x.data() + static_cast<std::ptrdiff_t>(t) * stride_;
    double* const to = slope.data() + static_cast<std::ptrdiff_t>(t) * stride_;
    const double* const square = Entries(hessian(t));
    if (hessian(t).tiled) {
      kernels::AddCombinationOfTiled(from, square, to, stride_);
    } else {
      kernels::AddProductsOfSymmetric(square, from, to, stride_);
    }
    if (!coupled_ || t + 1 == num_blocks_) continue;
    const double* const beside = Entries(coupling(t));
    if (coupling(t).tiled) {
      kernels::AddProductsOfTiled(beside, from + stride_, to, stride_);
      kernels::AddCombinationOfTiled(from, beside, to + stride_, stride_);
    } else {
      kernels::AddBothProducts(beside, stride_, from + stride_, to, from, to + stride_);
    }
  }
}

template <typename Real>
void NewtonMatrix<Real>::Reset(const CostBlocks& costs, const PackedRows& rows) {
  costs_ = &costs;
  rows_ = &rows;
  squares_.Set(costs.entries());
  coefficients_.Set(rows.coefficients());
  chain_.Reset(costs.num_blocks(), costs.stride(), costs.chained());
  for (int t = 0; costs.chained() && t + 1 < costs.num_blocks(); ++t) {
    chain_.SetCoupling(t, costs.coupling(t).tiled, rows.num_between(t));
  }
  right_.resize(static_cast<size_t>(costs.num_blocks()) * static_cast<size_t>(costs.stride()));
  products_.resize(rows.size());
}

template <typename Real>
bool NewtonMatrix<Real>::Eliminate(int t, const AlignedDoubles& theta, double pivot_floor) {
  FormBlock(t, theta);
  const Real* coupling = nullptr;
  if (costs_->chained() && t + 1 < costs_->num_blocks()) {
    rows_->SetCouplingRows(t, coefficients_.data(), weights_.data(), chain_);
    coupling = squares_.data() + costs_->coupling(t).begin;
  }
  return chain_.Eliminate(t, coupling, static_cast<Real>(pivot_floor));
}

template <typename Real>
void NewtonMatrix<Real>::FormBlock(int t, const AlignedDoubles& theta) {
  const int stride = costs_->stride();
  Real* const block = chain_.block(t);
  const Real* hessian = squares_.data() + costs_->hessian(t).begin;
  if (costs_->hessian(t).tiled) {
    kernels::SpreadTilesUpper(hessian, block, stride);
    hessian = block;
  }
  rows_->AddSquares(t, coefficients_.data(), weights_.data(), hessian, scratch_, chain_);
  const double* const diagonal = theta.data() + static_cast<std::ptrdiff_t>(t) * stride;
  for (std::ptrdiff_t i = 0; i < stride; ++i) block[i * stride + i] += static_cast<Real>(diagonal[i]);
}

template <typename Real>
void NewtonMatrix<Real>::BeginSolve(const AlignedDoubles& b, const AlignedDoubles& c) {
  for (size_t i = 0; i < right_.size(); ++i) right_[i] = static_cast<Real>(b[i]);
  multipliers_.Set(c);
  rows_->AddTransposed(0, coefficients_.data(), multipliers_.data(), right_);
}

template <typename Real>
void NewtonMatrix<Real>::SolveForward(int t) {
  if (t + 1 < costs_->num_blocks()) rows_->AddTransposed(t + 1, coefficients_.data(), multipliers_.data(), right_);
  chain_.SolveForward(t, right_);
}

template <typename Real>
void NewtonMatrix<Real>::SolveBack(AlignedDoubles& dx, AlignedDoubles& row_products) {
  chain_.SolveBack(right_);
  std::fill(products_.begin(), products_.end(), Real{0});
  rows_->AddProducts(coefficients_.data(), right_, products_);
  for (size_t i = 0; i < right_.size(); ++i) dx[i] = static_cast<double>(right_[i]);
  for (size_t i = 0; i < products_.size(); ++i) row_products[i] = static_cast<double>(products_[i]);
}

template class NewtonMatrix<double>;
template class NewtonMatrix<float>;

}  // namespace legopt
