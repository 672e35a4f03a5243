#include "legopt/solvers/subproblem/newton_matrix.h"

#include <algorithm>

#include "legopt/solvers/subproblem/dense_kernels.h"

namespace legopt {

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
