#pragma once

/// @file
/// Small dense kernels for the interior-point solver: rows of a few dozen doubles, padded with zeros to whole vectors
/// of four ("stride"). Eigen's general products cost about twice as much at these sizes. Inline, pure functions of
/// their arguments; what is done to whole blocks, in which most of the time goes, is in block_kernels.h.

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

/// Four doubles from p on, of any alignment.
inline Lanes Load(const double* p) {
#ifdef __FMA__
  return _mm256_loadu_pd(p);  // of what is copied in as bytes, GCC 12 keeps copies on the stack
#else
  Lanes v;
  std::memcpy(&v, p, sizeof(v));
  return v;
#endif
}
/// Four doubles to p on.
inline void Store(double* p, Lanes v) {
#ifdef __FMA__
  _mm256_storeu_pd(p, v);
#else
  std::memcpy(p, &v, sizeof(v));
#endif
}
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
/// c - a b, likewise.
inline Lanes NegativeMulAdd(Lanes a, Lanes b, Lanes c) {
#ifdef __FMA__
  return _mm256_fnmadd_pd(a, b, c);
#else
  return MulAdd(-a, b, c);
#endif
}
/// Square roots.
inline Lanes Root(Lanes v) {
#ifdef __FMA__
  return _mm256_sqrt_pd(v);
#else
  for (int i = 0; i < kLanes; ++i) v[i] = std::sqrt(v[i]);
  return v;
#endif
}
/// A bit for each lane that is not zero, the first one lowest.
inline unsigned NonZeros(Lanes v) {
#ifdef __FMA__
  return static_cast<unsigned>(_mm256_movemask_pd(_mm256_cmp_pd(v, _mm256_setzero_pd(), _CMP_NEQ_UQ)));
#else
  unsigned bits = 0;
  for (int i = 0; i < kLanes; ++i) bits |= (v[i] != 0.0 ? 1U : 0U) << i;
  return bits;
#endif
}
/// (v0 + v2) + (v1 + v3): always in this order, so that results keep their bits.
inline double Sum(Lanes v) { return (v[0] + v[2]) + (v[1] + v[3]); }

/// Whether all of `padded` entries are finite.
inline bool AllFinite(const double* a, int padded) {
  Lanes zero = {0, 0, 0, 0};  // or not a number
  for (int j = 0; j < padded; j += kLanes) zero += Load(a + j) * 0.0;
  return Sum(zero) == 0.0;
}

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

/// out -= sum_r c_r row_r for four rows that lie `step` apart.
inline void SubtractCombination(Lanes c, const double* rows, std::ptrdiff_t step, double* out, int padded) {
  const Lanes c0 = Broadcast(c[0]), c1 = Broadcast(c[1]), c2 = Broadcast(c[2]), c3 = Broadcast(c[3]);
  for (int j = 0; j < padded; j += kLanes) {
    Lanes sum = NegativeMulAdd(c0, Load(rows + j), Load(out + j));
    sum = NegativeMulAdd(c1, Load(rows + step + j), sum);
    sum = NegativeMulAdd(c2, Load(rows + 2 * step + j), sum);
    Store(out + j, NegativeMulAdd(c3, Load(rows + 3 * step + j), sum));
  }
}

/// The products of four rows, which lie `step` apart, with x.
inline Lanes ProductsOfFour(const double* rows, std::ptrdiff_t step, const double* x, int padded) {
  Lanes s0 = {}, s1 = {}, s2 = {}, s3 = {};
  for (int j = 0; j < padded; j += kLanes) {
    const Lanes v = Load(x + j);
    s0 = MulAdd(v, Load(rows + j), s0);
    s1 = MulAdd(v, Load(rows + step + j), s1);
    s2 = MulAdd(v, Load(rows + 2 * step + j), s2);
    s3 = MulAdd(v, Load(rows + 3 * step + j), s3);
  }
  // Sum() of each: halves first, then the two that are left.
  const auto pair = [](Lanes a, Lanes b) {  // a0 + a2, b0 + b2, a1 + a3, b1 + b3
    return __builtin_shufflevector(a, b, 0, 4, 1, 5) + __builtin_shufflevector(a, b, 2, 6, 3, 7);
  };
  const Lanes p01 = pair(s0, s1), p23 = pair(s2, s3);
  return __builtin_shufflevector(p01, p23, 0, 1, 4, 5) + __builtin_shufflevector(p01, p23, 2, 3, 6, 7);
}

/// out_r += row_r . x for `count` rows that lie `step` apart.
inline void AddProducts(const double* rows, std::ptrdiff_t step, int count, const double* x, double* out, int padded) {
  int r = 0;
  for (; r + kLanes <= count; r += kLanes, rows += kLanes * step) {
    Store(out + r, Load(out + r) + ProductsOfFour(rows, step, x, padded));
  }
  for (; r < count; ++r, rows += step) out[r] += Dot(rows, x, padded);
}

// Matrices whose 4 x 4 blocks right of the diagonal are zero, "lower" ones: the same sums as above without what they
// know to be zero.

/// out += B^T c for a lower B.
inline void AddCombinationOfLower(const double* c, const double* b, double* out, int stride) {
  for (int k = 0; k < stride; k += kLanes) {
    AddCombination(c + k, b + static_cast<std::ptrdiff_t>(k) * stride, stride, kLanes, out, k + kLanes);
  }
}

// Tiled matrices: those with nothing outside of the 4 x 4 tiles along their diagonal, kept as `stride` rows of four.

/// out += B x for a tiled B.
inline void AddProductsOfTiled(const double* tiles, const double* x, double* out, int stride) {
  for (std::ptrdiff_t k = 0; k < stride; k += kLanes)
    AddProducts(tiles + k * kLanes, kLanes, kLanes, x + k, out + k, kLanes);
}

/// out += B^T c for a tiled B.
inline void AddCombinationOfTiled(const double* c, const double* tiles, double* out, int stride) {
  for (std::ptrdiff_t k = 0; k < stride; k += kLanes)
    AddCombination(c + k, tiles + k * kLanes, kLanes, kLanes, out + k, kLanes);
}

/// The tiles of a tiled matrix in a whole one, and zeros right of them.
inline void SpreadTilesUpper(const double* tiles, double* m, int stride) {
  for (std::ptrdiff_t i = 0; i < stride; ++i) {
    double* const row = m + i * stride;
    const std::ptrdiff_t diagonal = i / kLanes * kLanes;
    Store(row + diagonal, Load(tiles + i * kLanes));
    std::memset(row + diagonal + kLanes, 0, sizeof(double) * static_cast<size_t>(stride - diagonal - kLanes));
  }
}

/// The tiles of a tiled matrix in a whole one, and zeros left of them.
inline void SpreadTilesLower(const double* tiles, double* m, int stride) {
  for (std::ptrdiff_t i = 0; i < stride; ++i) {
    double* const row = m + i * stride;
    const std::ptrdiff_t diagonal = i / kLanes * kLanes;
    std::memset(row, 0, sizeof(double) * static_cast<size_t>(diagonal));
    Store(row + diagonal, Load(tiles + i * kLanes));
  }
}

/// The upper triangle of a matrix, with whole diagonal tiles.
inline void CopyUpper(const double* from, double* m, int stride) {
  for (std::ptrdiff_t i = 0; i < stride; ++i) {
    const std::ptrdiff_t diagonal = i / kLanes * kLanes, row = i * stride;
    for (std::ptrdiff_t j = diagonal; j < stride; j += kLanes) Store(m + row + j, Load(from + row + j));
  }
}

}  // namespace legopt::kernels
