#pragma once

/// @file
/// Small dense kernels for the interior-point solver: matrices of a few dozen rows, row-major, rows padded with zeros
/// to whole vectors of four doubles ("stride"). Eigen's general products cost about twice as much at these sizes.
/// Header-only so that the loops are inlined; pure functions of their arguments.

#ifdef __FMA__
#include <immintrin.h>
#endif

#include <cmath>
#include <cstddef>
#include <cstring>

/// Kernels of the interior-point solver.
namespace legopt::kernels {

inline constexpr int kLanes = 4;  ///< doubles of a vector: what rows are padded to
/// Four doubles.
using Lanes = double __attribute__((vector_size(kLanes * sizeof(double))));

/// Four doubles from p on, of any alignment: one instruction, as the compilers read it.
inline Lanes Load(const double* p) {
  Lanes v;
  std::memcpy(&v, p, sizeof(v));
  return v;
}
/// Four doubles to p on.
inline void Store(double* p, Lanes v) { std::memcpy(p, &v, sizeof(v)); }
/// c in every lane.
inline Lanes Broadcast(double c) { return Lanes{c, c, c, c}; }
/// a b + c, rounded once in each lane. Compilers may not contract products and sums on their own (-ffp-contract=off),
/// so that bits do not depend on them; asked for by name it is one instruction in place of two, with the same bits
/// anywhere.
inline Lanes MulAdd(Lanes a, Lanes b, Lanes c) {
#ifdef __FMA__
  return _mm256_fmadd_pd(a, b, c);
#else
  for (int i = 0; i < kLanes; ++i) c[i] = std::fma(a[i], b[i], c[i]);
  return c;
#endif
}
/// (v0 + v2) + (v1 + v3): always in this order, so that results keep their bits.
inline double Sum(Lanes v) { return (v[0] + v[2]) + (v[1] + v[3]); }

/// sum_i a_i b_i over `padded` entries.
inline double Dot(const double* a, const double* b, int padded) {
  Lanes sum = {0, 0, 0, 0};
  for (int j = 0; j < padded; j += kLanes) sum = MulAdd(Load(a + j), Load(b + j), sum);
  return Sum(sum);
}

/// y += c x over `padded` entries.
inline void Axpy(double c, const double* x, double* y, int padded) {
  const Lanes factor = Broadcast(c);
  for (int j = 0; j < padded; j += kLanes) Store(y + j, MulAdd(factor, Load(x + j), Load(y + j)));
}

/// out += sum_r c_r row_r for `count` rows that lie `step` apart.
inline void AddCombination(const double* c, const double* rows, std::ptrdiff_t step, int count, double* out,
                           int padded) {
  int r = 0;
  for (; r + kLanes <= count; r += kLanes, rows += kLanes * step) {
    const Lanes c0 = Broadcast(c[r]), c1 = Broadcast(c[r + 1]), c2 = Broadcast(c[r + 2]), c3 = Broadcast(c[r + 3]);
    for (int j = 0; j < padded; j += kLanes) {
      Lanes sum = MulAdd(c0, Load(rows + j), Load(out + j));
      sum = MulAdd(c1, Load(rows + step + j), sum);
      sum = MulAdd(c2, Load(rows + 2 * step + j), sum);
      Store(out + j, MulAdd(c3, Load(rows + 3 * step + j), sum));
    }
  }
  for (; r < count; ++r, rows += step) Axpy(c[r], rows, out, padded);
}

/// out_r += row_r . x for `count` rows that lie `step` apart.
inline void AddProducts(const double* rows, std::ptrdiff_t step, int count, const double* x, double* out, int padded) {
  int r = 0;
  for (; r + kLanes <= count; r += kLanes, rows += kLanes * step) {
    Lanes s0 = {}, s1 = {}, s2 = {}, s3 = {};
    for (int j = 0; j < padded; j += kLanes) {
      const Lanes v = Load(x + j);
      s0 = MulAdd(v, Load(rows + j), s0);
      s1 = MulAdd(v, Load(rows + step + j), s1);
      s2 = MulAdd(v, Load(rows + 2 * step + j), s2);
      s3 = MulAdd(v, Load(rows + 3 * step + j), s3);
    }
    out[r] += Sum(s0);
    out[r + 1] += Sum(s1);
    out[r + 2] += Sum(s2);
    out[r + 3] += Sum(s3);
  }
  for (; r < count; ++r, rows += step) out[r] += Dot(rows, x, padded);
}

/// A tile of four rows and kWidth vectors: M += sign * sum_r a_r b_r^T, a_r four entries, kept in registers throughout.
template <int kWidth>
inline void AddTile(double sign, const double* a, std::ptrdiff_t a_step, const double* b, std::ptrdiff_t b_step,
                    int count, double* m, std::ptrdiff_t stride) {
  Lanes s[kLanes][kWidth] = {};
  for (int r = 0; r < count; ++r, a += a_step, b += b_step) {
    Lanes v[kWidth];
    for (std::ptrdiff_t q = 0; q < kWidth; ++q) v[q] = Load(b + q * kLanes);
    for (int p = 0; p < kLanes; ++p) {
      const Lanes c = Broadcast(a[p]);
      for (int q = 0; q < kWidth; ++q) s[p][q] = MulAdd(c, v[q], s[p][q]);
    }
  }
  for (int p = 0; p < kLanes; ++p) {
    for (std::ptrdiff_t q = 0; q < kWidth; ++q) {
      double* entry = m + p * stride + q * kLanes;
      Store(entry, MulAdd(Broadcast(sign), s[p][q], Load(entry)));
    }
  }
}

/// Four rows of M, `columns` wide, += sign * sum_r a_r b_r^T.
inline void AddPanel(double sign, const double* a, std::ptrdiff_t a_step, const double* b, std::ptrdiff_t b_step,
                     int count, double* m, std::ptrdiff_t stride, int columns) {
  constexpr int kTile = 3;  // with it accumulators, factors and one broadcast fill the sixteen vector registers
  int j = 0;
  for (; j + kTile * kLanes <= columns; j += kTile * kLanes) {
    AddTile<kTile>(sign, a, a_step, b + j, b_step, count, m + j, stride);
  }
  if (columns - j == 2 * kLanes) AddTile<2>(sign, a, a_step, b + j, b_step, count, m + j, stride);
  if (columns - j == kLanes) AddTile<1>(sign, a, a_step, b + j, b_step, count, m + j, stride);
}

/// Upper triangle of M (stride x stride) += sign * sum over `count` rows of a_r b_r^T, where the sum is symmetric (a_r
/// a multiple of b_r). Entries below the diagonal within the diagonal's 4 x 4 blocks change too.
inline void AddProductsUpper(double sign, const double* a, std::ptrdiff_t a_step, const double* b,
                             std::ptrdiff_t b_step, int count, double* m, int stride) {
  for (int i = 0; i < stride; i += kLanes) {
    AddPanel(sign, a + i, a_step, b + i, b_step, count, m + static_cast<std::ptrdiff_t>(i) * stride + i, stride,
             stride - i);
  }
}

/// M (stride x stride) += sign * sum over `count` rows of a_r b_r^T.
inline void AddProductsFull(double sign, const double* a, std::ptrdiff_t a_step, const double* b, std::ptrdiff_t b_step,
                            int count, double* m, int stride) {
  for (int i = 0; i < stride; i += kLanes) {
    AddPanel(sign, a + i, a_step, b, b_step, count, m + static_cast<std::ptrdiff_t>(i) * stride, stride, stride);
  }
}

/// In-place Cholesky factor M = U^T U of the upper triangle, with 1 / U_ii in place of U_ii and zeros below it within
/// the diagonal's 4 x 4 blocks. Pad rows and columns must be the identity's. Every pivot is kept at or above the entry
/// of `min_pivot` (stride positive numbers): below the rounding error of what was subtracted it would be noise, and
/// blow up all that follows. Returns false when a pivot is not finite.
inline bool FactorUpper(double* m, int stride, const double* min_pivot) {
  for (int k = 0; k < stride; k += kLanes) {
    double* panel = m + static_cast<std::ptrdiff_t>(k) * stride + k;
    AddPanel(-1.0, m + k, stride, m + k, stride, k, panel, stride, stride - k);
    for (int p = 0; p < kLanes; ++p) {
      double* row = panel + static_cast<std::ptrdiff_t>(p) * stride;
      for (int q = 0; q < p; ++q) {
        const double* above = panel + static_cast<std::ptrdiff_t>(q) * stride;
        Axpy(-above[p], above, row, stride - k);
      }
      double pivot = row[p];
      if (!std::isfinite(pivot)) return false;
      if (pivot < min_pivot[k + p]) pivot = min_pivot[k + p];
      const double inverse = 1.0 / std::sqrt(pivot);
      for (int j = 0; j < stride - k; j += kLanes) Store(row + j, Load(row + j) * inverse);
      row[p] = inverse;
      for (int j = 0; j < p; ++j) row[j] = 0.0;
    }
  }
  return true;
}

/// b <- U^-T b for a factor of FactorUpper.
inline void SolveTransposed(const double* u, int stride, double* b) {
  for (int k = 0; k < stride; k += kLanes) {
    const double* r0 = u + static_cast<std::ptrdiff_t>(k) * stride + k;
    const double* r1 = r0 + stride;
    const double* r2 = r1 + stride;
    const double* r3 = r2 + stride;
    const double b0 = b[k] * r0[0];
    const double b1 = (b[k + 1] - r0[1] * b0) * r1[1];
    const double b2 = (b[k + 2] - r0[2] * b0 - r1[2] * b1) * r2[2];
    const double b3 = (b[k + 3] - r0[3] * b0 - r1[3] * b1 - r2[3] * b2) * r3[3];
    const double solved[kLanes] = {-b0, -b1, -b2, -b3};
    AddCombination(solved, r0 + kLanes, stride, kLanes, b + k + kLanes, stride - k - kLanes);
    Store(b + k, Lanes{b0, b1, b2, b3});
  }
}

/// b <- U^-1 b for a factor of FactorUpper.
inline void SolveUpper(const double* u, int stride, double* b) {
  for (int k = stride - kLanes; k >= 0; k -= kLanes) {
    const double* r0 = u + static_cast<std::ptrdiff_t>(k) * stride + k;
    const double* r1 = r0 + stride;
    const double* r2 = r1 + stride;
    const double* r3 = r2 + stride;
    double s[kLanes] = {};
    AddProducts(r0 + kLanes, stride, kLanes, b + k + kLanes, s, stride - k - kLanes);
    const double b3 = (b[k + 3] - s[3]) * r3[3];
    const double b2 = (b[k + 2] - s[2] - r2[3] * b3) * r2[2];
    const double b1 = (b[k + 1] - s[1] - r1[3] * b3 - r1[2] * b2) * r1[1];
    const double b0 = (b[k] - s[0] - r0[3] * b3 - r0[2] * b2 - r0[1] * b1) * r0[0];
    Store(b + k, Lanes{b0, b1, b2, b3});
  }
}

/// B <- U^-T B for a factor of FactorUpper and a square B of `stride` padded rows and columns.
inline void SolveTransposedBlock(const double* u, int stride, double* b) {
  for (int k = 0; k < stride; k += kLanes) {
    double* panel = b + static_cast<std::ptrdiff_t>(k) * stride;
    AddPanel(-1.0, u + k, stride, b, stride, k, panel, stride, stride);
    const double* diagonal = u + static_cast<std::ptrdiff_t>(k) * stride + k;
    for (int p = 0; p < kLanes; ++p) {
      double* row = panel + static_cast<std::ptrdiff_t>(p) * stride;
      for (int q = 0; q < p; ++q) {
        Axpy(-diagonal[q * stride + p], panel + static_cast<std::ptrdiff_t>(q) * stride, row, stride);
      }
      const double inverse = diagonal[p * stride + p];
      for (int j = 0; j < stride; j += kLanes) Store(row + j, Load(row + j) * inverse);
    }
  }
}

}  // namespace legopt::kernels
