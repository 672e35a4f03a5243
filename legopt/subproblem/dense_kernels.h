#pragma once

/// @file
/// Small dense kernels for the interior-point solver: matrices of a few dozen rows, row-major, rows padded with zeros
/// to whole vectors of four doubles ("stride"). Eigen's general products cost about twice as much at these sizes.
/// Inline, but for the panels (panels.h), in which most of the time goes; pure functions of their arguments.

#ifdef __FMA__
#include <immintrin.h>
#endif

#include <cmath>
#include <cstddef>
#include <cstring>

#include "legopt/subproblem/panels.h"

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

/// Upper triangle of M (stride x stride) += sign * sum over `count` rows of a_r b_r^T, where the sum is symmetric (a_r
/// a multiple of b_r). Entries below the diagonal within the diagonal's 4 x 4 blocks change too.
inline void AddProductsUpper(double sign, const double* a, std::ptrdiff_t a_step, const double* b,
                             std::ptrdiff_t b_step, int count, double* m, int stride) {
  Panel* const add_panel = ChosenPanel();
  for (int i = 0; i < stride; i += kLanes) {
    add_panel(sign, a + i, a_step, b + i, b_step, count, m + static_cast<std::ptrdiff_t>(i) * stride + i, stride,
              stride - i);
  }
}

/// M (stride x stride) += sign * sum over `count` rows of a_r b_r^T.
inline void AddProductsFull(double sign, const double* a, std::ptrdiff_t a_step, const double* b, std::ptrdiff_t b_step,
                            int count, double* m, int stride) {
  Panel* const add_panel = ChosenPanel();
  for (int i = 0; i < stride; i += kLanes) {
    add_panel(sign, a + i, a_step, b, b_step, count, m + static_cast<std::ptrdiff_t>(i) * stride, stride, stride);
  }
}

/// Four rows, `columns` wide: rows <- T^-T rows, T the upper triangle of a factor's diagonal 4 x 4 block, with the
/// inverses of its diagonal in place of the diagonal.
inline void SolveRows(const double* t, double* rows, std::ptrdiff_t stride, int columns) {
  const double* t1 = t + stride;
  const double* t2 = t1 + stride;
  const double* t3 = t2 + stride;
  const Lanes i0 = Broadcast(t[0]), i1 = Broadcast(t1[1]), i2 = Broadcast(t2[2]), i3 = Broadcast(t3[3]);
  const Lanes c01 = Broadcast(-t[1]), c02 = Broadcast(-t[2]), c03 = Broadcast(-t[3]);
  const Lanes c12 = Broadcast(-t1[2]), c13 = Broadcast(-t1[3]), c23 = Broadcast(-t2[3]);
  for (double* row = rows; row < rows + columns; row += kLanes) {
    const Lanes r0 = Load(row) * i0;
    const Lanes r1 = MulAdd(c01, r0, Load(row + stride)) * i1;
    const Lanes r2 = MulAdd(c12, r1, MulAdd(c02, r0, Load(row + 2 * stride))) * i2;
    const Lanes r3 = MulAdd(c23, r2, MulAdd(c13, r1, MulAdd(c03, r0, Load(row + 3 * stride)))) * i3;
    Store(row, r0);
    Store(row + stride, r1);
    Store(row + 2 * stride, r2);
    Store(row + 3 * stride, r3);
  }
}

/// The factor of one 4 x 4 block, as FactorUpper has it.
inline bool FactorTile(double* tile, std::ptrdiff_t stride, const double* min_pivot) {
  for (int p = 0; p < kLanes; ++p) {
    double* row = tile + p * stride;
    for (int q = 0; q < p; ++q) {
      const double* above = tile + q * stride;
      Axpy(-above[p], above, row, kLanes);
    }
    double pivot = row[p];
    if (!std::isfinite(pivot)) return false;
    if (pivot < min_pivot[p]) pivot = min_pivot[p];
    const double inverse = 1.0 / std::sqrt(pivot);
    Store(row, Load(row) * inverse);
    row[p] = inverse;
    for (int j = 0; j < p; ++j) row[j] = 0.0;
  }
  return true;
}

/// In-place Cholesky factor M = U^T U of the upper triangle, with 1 / U_ii in place of U_ii and zeros below it within
/// the diagonal's 4 x 4 blocks. Pad rows and columns must be the identity's. Every pivot is kept at or above the entry
/// of `min_pivot` (stride positive numbers): below the rounding error of what was subtracted it would be noise, and
/// blow up all that follows. Returns false when a pivot is not finite.
inline bool FactorUpper(double* m, int stride, const double* min_pivot) {
  Panel* const add_panel = ChosenPanel();
  for (int k = 0; k < stride; k += kLanes) {
    double* panel = m + static_cast<std::ptrdiff_t>(k) * stride + k;
    add_panel(-1.0, m + k, stride, m + k, stride, k, panel, stride, stride - k);
    if (!FactorTile(panel, stride, min_pivot + k)) return false;
    SolveRows(panel, panel + kLanes, stride, stride - k - kLanes);
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
  Panel* const add_panel = ChosenPanel();
  for (int k = 0; k < stride; k += kLanes) {
    double* panel = b + static_cast<std::ptrdiff_t>(k) * stride;
    add_panel(-1.0, u + k, stride, b, stride, k, panel, stride, stride);
    SolveRows(u + static_cast<std::ptrdiff_t>(k) * stride + k, panel, stride, stride);
  }
}

// Matrices whose 4 x 4 blocks right of the diagonal are zero, "lower" ones: the same sums as above without what they
// know to be zero, with equal bits. Columns are taken kChunk at a time: more have more zeros among them, fewer load
// more.

inline constexpr int kChunk = 16;  ///< columns of a lower matrix at a time

/// SolveTransposedBlock for a lower B, which stays one.
inline void SolveTransposedLower(const double* u, int stride, double* b) {
  Panel* const add_panel = ChosenPanel();
  for (int k = 0; k < stride; k += kLanes) {
    double* panel = b + static_cast<std::ptrdiff_t>(k) * stride;
    for (int j = 0; j < k; j += kChunk) {
      const std::ptrdiff_t first = static_cast<std::ptrdiff_t>(j) * stride;
      add_panel(-1.0, u + first + k, stride, b + first + j, stride, k - j, panel + j, stride,
                k - j < kChunk ? k - j : kChunk);
    }
    SolveRows(u + static_cast<std::ptrdiff_t>(k) * stride + k, panel, stride, k + kLanes);
  }
}

/// AddProductsUpper(-1, B, B) of the rows of a lower B.
inline void SubtractProductsOfLower(const double* b, double* m, int stride) {
  Panel* const add_panel = ChosenPanel();
  for (int i = 0; i < stride; i += kLanes) {
    for (int j = i; j < stride; j += kChunk) {
      const std::ptrdiff_t first = static_cast<std::ptrdiff_t>(j) * stride;
      add_panel(-1.0, b + first + i, stride, b + first + j, stride, stride - j,
                m + static_cast<std::ptrdiff_t>(i) * stride + j, stride, stride - j < kChunk ? stride - j : kChunk);
    }
  }
}

/// out += B^T c for a lower B.
inline void AddCombinationOfLower(const double* c, const double* b, double* out, int stride) {
  for (int k = 0; k < stride; k += kLanes) {
    AddCombination(c + k, b + static_cast<std::ptrdiff_t>(k) * stride, stride, kLanes, out, k + kLanes);
  }
}

/// out += B x for a lower B.
inline void AddProductsOfLower(const double* b, const double* x, double* out, int stride) {
  for (int k = 0; k < stride; k += kLanes) {
    AddProducts(b + static_cast<std::ptrdiff_t>(k) * stride, stride, kLanes, x, out + k, k + kLanes);
  }
}

/// Whether a matrix is lower in this sense.
inline bool IsLower(const double* b, int stride) {
  for (int i = 0; i < stride; ++i) {
    const double* row = b + static_cast<std::ptrdiff_t>(i) * stride;
    for (int j = i / kLanes * kLanes + kLanes; j < stride; ++j) {
      if (row[j] != 0.0) return false;
    }
  }
  return true;
}

}  // namespace legopt::kernels
