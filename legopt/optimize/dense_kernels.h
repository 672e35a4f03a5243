#pragma once

/// Small dense kernels for the interior-point solver: matrices of a few dozen rows, row-major, rows padded to whole
/// vectors of four doubles. Eigen's general products cost about twice as much at these sizes. Header-only so that the
/// loops are inlined; pure functions of their arguments.

#include <cmath>
#include <cstddef>

namespace legopt::kernels {

inline constexpr int kLanes = 4;
using Lanes = double __attribute__((vector_size(kLanes * sizeof(double)), aligned(sizeof(double)), may_alias));

inline Lanes Load(const double* p) { return *reinterpret_cast<const Lanes*>(p); }
inline void Store(double* p, Lanes v) { *reinterpret_cast<Lanes*>(p) = v; }

/// sum_i a_i b_i over `padded` entries.
inline double Dot(const double* a, const double* b, int padded) {
  Lanes sum = {0, 0, 0, 0};
  for (int j = 0; j < padded; j += kLanes) sum += Load(a + j) * Load(b + j);
  return (sum[0] + sum[2]) + (sum[1] + sum[3]);
}

/// y += c x over `padded` entries.
inline void Axpy(double c, const double* x, double* y, int padded) {
  for (int j = 0; j < padded; j += kLanes) Store(y + j, Load(y + j) + c * Load(x + j));
}

/// Upper triangle of M (size x size, row stride `stride`) += sum_r w_r a_r a_r^T for four rows a_r. Entries below the
/// diagonal within the diagonal's vector are overwritten with values of no meaning.
inline void RankFourUpper(double* m, int size, int stride, const double* const a[4], const double w[4]) {
  for (int i = 0; i < size; ++i) {
    const Lanes c0 = w[0] * a[0][i] - Lanes{};
    const Lanes c1 = w[1] * a[1][i] - Lanes{};
    const Lanes c2 = w[2] * a[2][i] - Lanes{};
    const Lanes c3 = w[3] * a[3][i] - Lanes{};
    double* row = m + static_cast<std::ptrdiff_t>(i) * stride;
    for (int j = i / kLanes * kLanes; j < stride; j += kLanes) {
      Store(row + j, Load(row + j) + c0 * Load(a[0] + j) + c1 * Load(a[1] + j) + c2 * Load(a[2] + j) +
                         c3 * Load(a[3] + j));
    }
  }
}

/// Full M (rows x stride) += sum_r w_r a_r b_r^T for four pairs of rows.
inline void RankFourFull(double* m, int rows, int stride, const double* const a[4], const double* const b[4],
                         const double w[4]) {
  for (int i = 0; i < rows; ++i) {
    double* row = m + static_cast<std::ptrdiff_t>(i) * stride;
    const double c0 = w[0] * a[0][i], c1 = w[1] * a[1][i], c2 = w[2] * a[2][i], c3 = w[3] * a[3][i];
    for (int j = 0; j < stride; j += kLanes) {
      Store(row + j,
            Load(row + j) + c0 * Load(b[0] + j) + c1 * Load(b[1] + j) + c2 * Load(b[2] + j) + c3 * Load(b[3] + j));
    }
  }
}

/// Upper triangle of M += sum over `count` rows, row r at rows[r], weight w[r].
inline void AccumulateUpper(double* m, int size, int stride, const double* const* rows, const double* w, int count) {
  int r = 0;
  for (; r + kLanes <= count; r += kLanes) RankFourUpper(m, size, stride, rows + r, w + r);
  if (r == count) return;
  const double* a[4] = {rows[r], rows[r], rows[r], rows[r]};
  double rest[4] = {0, 0, 0, 0};
  for (int k = 0; r + k < count; ++k) {
    a[k] = rows[r + k];
    rest[k] = w[r + k];
  }
  RankFourUpper(m, size, stride, a, rest);
}

/// In-place Cholesky factor M = U^T U of the upper triangle. Rows and columns beyond `size` must be the identity's (pad).
/// A pivot that is not above `min_pivot` is replaced by `min_pivot`. Returns false when a pivot is not finite.
inline bool FactorUpper(double* m, int stride, double min_pivot) {
  for (int k = 0; k < stride; k += kLanes) {
    for (int p = k; p < k + kLanes; ++p) {
      double* row = m + static_cast<std::ptrdiff_t>(p) * stride;
      for (int q = k; q < p; ++q) {
        const double* above = m + static_cast<std::ptrdiff_t>(q) * stride;
        Axpy(-above[p], above + k, row + k, stride - k);
      }
      double pivot = row[p];
      if (!std::isfinite(pivot)) return false;
      if (pivot < min_pivot) pivot = min_pivot;
      const double root = std::sqrt(pivot);
      const double inverse = 1.0 / root;
      for (int j = k; j < stride; j += kLanes) Store(row + j, Load(row + j) * inverse);
      row[p] = root;
      for (int j = k; j < p; ++j) row[j] = 0.0;
    }
    if (k + kLanes >= stride) break;
    const double* panel[4];
    for (int p = 0; p < kLanes; ++p) panel[p] = m + static_cast<std::ptrdiff_t>(k + p) * stride + k + kLanes;
    // The trailing block starts on a vector boundary, so that RankFourUpper's rows stay aligned with its columns.
    double* trailing = m + static_cast<std::ptrdiff_t>(k + kLanes) * stride + k + kLanes;
    const int rest = stride - k - kLanes;
    for (int i = 0; i < rest; ++i) {
      double* row = trailing + static_cast<std::ptrdiff_t>(i) * stride;
      const double c0 = panel[0][i], c1 = panel[1][i], c2 = panel[2][i], c3 = panel[3][i];
      for (int j = i / kLanes * kLanes; j < rest; j += kLanes) {
        Store(row + j, Load(row + j) - c0 * Load(panel[0] + j) - c1 * Load(panel[1] + j) - c2 * Load(panel[2] + j) -
                           c3 * Load(panel[3] + j));
      }
    }
  }
  return true;
}

/// b <- U^-T b.
inline void SolveTransposed(const double* u, int stride, double* b) {
  for (int k = 0; k < stride; ++k) {
    const double* row = u + static_cast<std::ptrdiff_t>(k) * stride;
    const double value = b[k] / row[k];
    const int from = k / kLanes * kLanes;
    Axpy(-value, row + from, b + from, stride - from);  // entries before k in this vector are multiplied by zeros
    b[k] = value;
  }
}

/// b <- U^-1 b.
inline void SolveUpper(const double* u, int stride, double* b) {
  for (int k = stride - 1; k >= 0; --k) {
    const double* row = u + static_cast<std::ptrdiff_t>(k) * stride;
    const int from = k / kLanes * kLanes;
    const double own = b[k];
    b[k] = 0.0;
    b[k] = (own - Dot(row + from, b + from, stride - from)) / row[k];
  }
}

/// B <- U^-T B for a square B of `stride` padded rows and columns.
inline void SolveTransposedBlock(const double* u, int stride, double* b) {
  for (int k = 0; k < stride; ++k) {
    const double* row = u + static_cast<std::ptrdiff_t>(k) * stride;
    double* b_k = b + static_cast<std::ptrdiff_t>(k) * stride;
    const double inverse = 1.0 / row[k];
    for (int j = 0; j < stride; j += kLanes) Store(b_k + j, Load(b_k + j) * inverse);
    for (int i = k + 1; i < stride; ++i) Axpy(-row[i], b_k, b + static_cast<std::ptrdiff_t>(i) * stride, stride);
  }
}

}  // namespace legopt::kernels
