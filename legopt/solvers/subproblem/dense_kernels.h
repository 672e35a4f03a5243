#pragma once

/// @file
/// Small dense kernels of the interior-point solver: rows of a few dozen numbers, doubles or floats, padded with zeros
/// to whole vectors of four ("stride"). Eigen's general products take about twice as long at these sizes. Inline, pure
/// functions of their arguments. Operations on whole blocks, which take most of the time, are in block_kernels.h.

#ifdef __FMA__
#include <immintrin.h>
#endif

#include <cmath>
#include <cstddef>
#include <cstring>
#include <type_traits>

/// Kernels of the interior-point solver.
namespace legopt::kernels {

inline constexpr int kLanes = 4;  ///< numbers per vector, to which rows are padded
/// Four doubles.
using Lanes = double __attribute__((vector_size(kLanes * sizeof(double))));
/// Four floats.
using FloatLanes = float __attribute__((vector_size(kLanes * sizeof(float))));

/// Vector type of four numbers of type Real.
template <typename Real>
struct FourOf;
/// Specialisation for doubles.
template <>
struct FourOf<double> {
  using Type = Lanes;  ///< the vector
};
/// Specialisation for floats.
template <>
struct FourOf<float> {
  using Type = FloatLanes;  ///< the vector
};
/// Lanes or FloatLanes.
template <typename Real>
using LanesOf = typename FourOf<Real>::Type;

/// Loads four numbers from p on, of any alignment.
inline Lanes Load(const double* p) {
#ifdef __FMA__
  return _mm256_loadu_pd(p);  // GCC 12 would keep a byte-wise copy on the stack
#else
  Lanes v;
  std::memcpy(&v, p, sizeof(v));
  return v;
#endif
}
/// Overload for floats.
inline FloatLanes Load(const float* p) {
#ifdef __FMA__
  return _mm_loadu_ps(p);
#else
  FloatLanes v;
  std::memcpy(&v, p, sizeof(v));
  return v;
#endif
}
/// Stores four numbers from p on.
inline void Store(double* p, Lanes v) {
#ifdef __FMA__
  _mm256_storeu_pd(p, v);
#else
  std::memcpy(p, &v, sizeof(v));
#endif
}
/// Overload for floats.
inline void Store(float* p, FloatLanes v) {
#ifdef __FMA__
  _mm_storeu_ps(p, v);
#else
  std::memcpy(p, &v, sizeof(v));
#endif
}
/// Returns c in every lane.
inline Lanes Broadcast(double c) { return Lanes{c, c, c, c}; }
/// Overload for floats.
inline FloatLanes Broadcast(float c) { return FloatLanes{c, c, c, c}; }
/// Returns a b + c, rounded once in each lane. Compilers may not contract products and sums on their own
/// (-ffp-contract=off), so that results do not depend on the compiler. The explicit call is one instruction in place of
/// two and gives identical bits everywhere.
inline Lanes MulAdd(Lanes a, Lanes b, Lanes c) {
#ifdef __FMA__
  return _mm256_fmadd_pd(a, b, c);
#else
  for (int i = 0; i < kLanes; ++i) c[i] = std::fma(a[i], b[i], c[i]);
  return c;
#endif
}
/// Overload for floats.
inline FloatLanes MulAdd(FloatLanes a, FloatLanes b, FloatLanes c) {
#ifdef __FMA__
  return _mm_fmadd_ps(a, b, c);
#else
  for (int i = 0; i < kLanes; ++i) c[i] = std::fma(a[i], b[i], c[i]);
  return c;
#endif
}
/// Returns c - a b, rounded once in each lane.
inline Lanes NegativeMulAdd(Lanes a, Lanes b, Lanes c) {
#ifdef __FMA__
  return _mm256_fnmadd_pd(a, b, c);
#else
  return MulAdd(-a, b, c);
#endif
}
/// Overload for floats.
inline FloatLanes NegativeMulAdd(FloatLanes a, FloatLanes b, FloatLanes c) {
#ifdef __FMA__
  return _mm_fnmadd_ps(a, b, c);
#else
  return MulAdd(-a, b, c);
#endif
}
/// Returns the square roots.
inline Lanes Root(Lanes v) {
#ifdef __FMA__
  return _mm256_sqrt_pd(v);
#else
  for (int i = 0; i < kLanes; ++i) v[i] = std::sqrt(v[i]);
  return v;
#endif
}
/// Overload for floats.
inline FloatLanes Root(FloatLanes v) {
#ifdef __FMA__
  return _mm_sqrt_ps(v);
#else
  for (int i = 0; i < kLanes; ++i) v[i] = std::sqrt(v[i]);
  return v;
#endif
}
/// Returns a bit for each lane that is not zero, the first lane in the lowest bit.
inline unsigned NonZeros(Lanes v) {
#ifdef __FMA__
  return static_cast<unsigned>(_mm256_movemask_pd(_mm256_cmp_pd(v, _mm256_setzero_pd(), _CMP_NEQ_UQ)));
#else
  unsigned bits = 0;
  for (int i = 0; i < kLanes; ++i) bits |= (v[i] != 0.0 ? 1U : 0U) << i;
  return bits;
#endif
}
/// Returns (v0 + v2) + (v1 + v3), always in this order, so that results are identical bit by bit.
template <typename Four>
inline auto Sum(Four v) {
  return (v[0] + v[2]) + (v[1] + v[3]);
}

/// Returns whether all of `padded` entries are finite.
inline bool AllFinite(const double* a, int padded) {
  Lanes zero = {0, 0, 0, 0};  // becomes NaN otherwise
  for (int j = 0; j < padded; j += kLanes) zero += Load(a + j) * 0.0;
  return Sum(zero) == 0.0;
}

/// Returns sum_i a_i b_i over `padded` entries.
template <typename Real>
inline Real Dot(const Real* a, const Real* b, int padded) {
  LanesOf<Real> sum = {0, 0, 0, 0};
  for (int j = 0; j < padded; j += kLanes) sum = MulAdd(Load(a + j), Load(b + j), sum);
  return Sum(sum);
}

/// Adds c x to y, over `padded` entries.
template <typename Real>
inline void Axpy(Real c, const Real* x, Real* y, int padded) {
  const LanesOf<Real> factor = Broadcast(c);
  for (int j = 0; j < padded; j += kLanes) Store(y + j, MulAdd(factor, Load(x + j), Load(y + j)));
}

/// Adds to `out`, or subtracts, sum_r c_r row_r for four rows that lie `step` apart.
template <bool kMinus, typename Real>
inline void AddFour(LanesOf<Real> c, const Real* rows, std::ptrdiff_t step, Real* out, int padded) {
  const Real *const r1 = rows + step, *const r2 = r1 + step, *const r3 = r2 + step;
  int j = 0;
#ifdef __FMA__
  if constexpr (std::is_same_v<Real, float>) {  // columns are independent: the same bits as with four at a time
    const auto add = [](__m256 a, __m256 b, __m256 sum) {
      return kMinus ? _mm256_fnmadd_ps(a, b, sum) : _mm256_fmadd_ps(a, b, sum);
    };
    const __m256 c0 = _mm256_set1_ps(c[0]), c1 = _mm256_set1_ps(c[1]), c2 = _mm256_set1_ps(c[2]),
                 c3 = _mm256_set1_ps(c[3]);
    for (; j + 2 * kLanes <= padded; j += 2 * kLanes) {
      __m256 sum = add(c0, _mm256_loadu_ps(rows + j), _mm256_loadu_ps(out + j));
      sum = add(c1, _mm256_loadu_ps(r1 + j), sum);
      sum = add(c2, _mm256_loadu_ps(r2 + j), sum);
      _mm256_storeu_ps(out + j, add(c3, _mm256_loadu_ps(r3 + j), sum));
    }
  }
#endif
  const auto add = [](LanesOf<Real> a, LanesOf<Real> b, LanesOf<Real> sum) {
    return kMinus ? NegativeMulAdd(a, b, sum) : MulAdd(a, b, sum);
  };
  const auto c0 = Broadcast(c[0]), c1 = Broadcast(c[1]), c2 = Broadcast(c[2]), c3 = Broadcast(c[3]);
  for (; j < padded; j += kLanes) {
    LanesOf<Real> sum = add(c0, Load(rows + j), Load(out + j));
    sum = add(c1, Load(r1 + j), sum);
    sum = add(c2, Load(r2 + j), sum);
    Store(out + j, add(c3, Load(r3 + j), sum));
  }
}

/// Adds sum_r c_r row_r to `out`, for `count` rows that lie `step` apart.
template <typename Real>
inline void AddCombination(const Real* c, const Real* rows, std::ptrdiff_t step, int count, Real* out, int padded) {
  int r = 0;
  for (; r + kLanes <= count; r += kLanes, rows += kLanes * step) AddFour<false>(Load(c + r), rows, step, out, padded);
  for (; r < count; ++r, rows += step) Axpy(c[r], rows, out, padded);
}

/// Subtracts sum_r c_r row_r from `out`, for four rows that lie `step` apart.
template <typename Real>
inline void SubtractCombination(LanesOf<Real> c, const Real* rows, std::ptrdiff_t step, Real* out, int padded) {
  AddFour<true>(c, rows, step, out, padded);
}

/// Returns Sum() of each vector, with the same order of additions.
template <typename Four>
inline Four SumsOfFour(Four s0, Four s1, Four s2, Four s3) {
  const auto pair = [](Four a, Four b) {  // a0 + a2, b0 + b2, a1 + a3, b1 + b3
    return __builtin_shufflevector(a, b, 0, 4, 1, 5) + __builtin_shufflevector(a, b, 2, 6, 3, 7);
  };
  const Four p01 = pair(s0, s1), p23 = pair(s2, s3);
  return __builtin_shufflevector(p01, p23, 0, 1, 4, 5) + __builtin_shufflevector(p01, p23, 2, 3, 6, 7);
}

/// Returns the products with x of four rows, which lie `step` apart.
inline Lanes ProductsOfFour(const double* rows, std::ptrdiff_t step, const double* x, int padded) {
  Lanes s0 = {}, s1 = {}, s2 = {}, s3 = {};
  for (int j = 0; j < padded; j += kLanes) {
    const Lanes v = Load(x + j);
    s0 = MulAdd(v, Load(rows + j), s0);
    s1 = MulAdd(v, Load(rows + step + j), s1);
    s2 = MulAdd(v, Load(rows + 2 * step + j), s2);
    s3 = MulAdd(v, Load(rows + 3 * step + j), s3);
  }
  return SumsOfFour(s0, s1, s2, s3);
}

/// Overload for floats: adds up even and odd groups of four separately, then both sums.
inline FloatLanes ProductsOfFour(const float* rows, std::ptrdiff_t step, const float* x, int padded) {
  const float* const rows2 = rows + 2 * step;
  int j = 0;
#ifdef __FMA__
  __m256 b0 = _mm256_setzero_ps(), b1 = b0, b2 = b0, b3 = b0;
  for (; j + 2 * kLanes <= padded; j += 2 * kLanes) {
    const __m256 v = _mm256_loadu_ps(x + j);
    b0 = _mm256_fmadd_ps(v, _mm256_loadu_ps(rows + j), b0);
    b1 = _mm256_fmadd_ps(v, _mm256_loadu_ps(rows + step + j), b1);
    b2 = _mm256_fmadd_ps(v, _mm256_loadu_ps(rows2 + j), b2);
    b3 = _mm256_fmadd_ps(v, _mm256_loadu_ps(rows2 + step + j), b3);
  }
  FloatLanes even[4] = {_mm256_castps256_ps128(b0), _mm256_castps256_ps128(b1), _mm256_castps256_ps128(b2),
                        _mm256_castps256_ps128(b3)};
  const FloatLanes odd[4] = {_mm256_extractf128_ps(b0, 1), _mm256_extractf128_ps(b1, 1), _mm256_extractf128_ps(b2, 1),
                             _mm256_extractf128_ps(b3, 1)};
#else
  FloatLanes even[4] = {}, odd[4] = {};
  for (; j + 2 * kLanes <= padded; j += 2 * kLanes) {
    for (int r = 0; r < 4; ++r) {
      even[r] = MulAdd(Load(x + j), Load(rows + r * step + j), even[r]);
      odd[r] = MulAdd(Load(x + j + kLanes), Load(rows + r * step + j + kLanes), odd[r]);
    }
  }
#endif
  if (j < padded) {
    const FloatLanes v = Load(x + j);
    even[0] = MulAdd(v, Load(rows + j), even[0]);
    even[1] = MulAdd(v, Load(rows + step + j), even[1]);
    even[2] = MulAdd(v, Load(rows2 + j), even[2]);
    even[3] = MulAdd(v, Load(rows2 + step + j), even[3]);
  }
  return SumsOfFour(even[0] + odd[0], even[1] + odd[1], even[2] + odd[2], even[3] + odd[3]);
}

/// Adds row_r . x to out_r, for `count` rows that lie `step` apart.
template <typename Real>
inline void AddProducts(const Real* rows, std::ptrdiff_t step, int count, const Real* x, Real* out, int padded) {
  int r = 0;
  for (; r + kLanes <= count; r += kLanes, rows += kLanes * step) {
    Store(out + r, Load(out + r) + ProductsOfFour(rows, step, x, padded));
  }
  for (; r < count; ++r, rows += step) out[r] += Dot(rows, x, padded);
}

/// Adds S x to `out` for a symmetric S, of which only the upper triangle with whole diagonal tiles is read.
inline void AddProductsOfSymmetric(const double* s, const double* x, double* out, int stride) {
  for (int k = 0; k < stride; k += kLanes, s += std::ptrdiff_t{kLanes} * stride + kLanes) {
    Store(out + k, Load(out + k) + ProductsOfFour(s, stride, x + k, stride - k));
    AddFour<false>(Load(x + k), s + kLanes, stride, out + k + kLanes, stride - k - kLanes);
  }
}

/// Adds B x to `out` and B^T c to `transposed_out` for a square B, which is read once. The sums are those of
/// AddProducts and AddCombination.
inline void AddBothProducts(const double* b, int stride, const double* x, double* out, const double* c,
                            double* transposed_out) {
  for (int k = 0; k < stride; k += kLanes, b += std::ptrdiff_t{kLanes} * stride) {
    Store(out + k, Load(out + k) + ProductsOfFour(b, stride, x, stride));
    AddCombination(c + k, b, stride, kLanes, transposed_out, stride);
  }
}

// "Lower" matrices, whose 4 x 4 blocks right of the diagonal are zero: the same sums as above without these zeros.

/// Adds B^T c to `out` for a lower B.
template <typename Real>
inline void AddCombinationOfLower(const Real* c, const Real* b, Real* out, int stride) {
  for (int k = 0; k < stride; k += kLanes) {
    AddCombination(c + k, b + static_cast<std::ptrdiff_t>(k) * stride, stride, kLanes, out, k + kLanes);
  }
}

// Tiled matrices, which are zero outside the 4 x 4 tiles along their diagonal, stored as `stride` rows of four.

/// Adds B x to `out` for a tiled B.
inline void AddProductsOfTiled(const double* tiles, const double* x, double* out, int stride) {
  for (std::ptrdiff_t k = 0; k < stride; k += kLanes)
    AddProducts(tiles + k * kLanes, kLanes, kLanes, x + k, out + k, kLanes);
}

/// Adds B^T c to `out` for a tiled B.
inline void AddCombinationOfTiled(const double* c, const double* tiles, double* out, int stride) {
  for (std::ptrdiff_t k = 0; k < stride; k += kLanes)
    AddCombination(c + k, tiles + k * kLanes, kLanes, kLanes, out + k, kLanes);
}

/// Copies the tiles of a tiled matrix to a whole one, with zeros right of them.
template <typename Real>
inline void SpreadTilesUpper(const Real* tiles, Real* m, int stride) {
  for (std::ptrdiff_t i = 0; i < stride; ++i) {
    Real* const row = m + i * stride;
    const std::ptrdiff_t diagonal = i / kLanes * kLanes;
    Store(row + diagonal, Load(tiles + i * kLanes));
    std::memset(row + diagonal + kLanes, 0, sizeof(Real) * static_cast<size_t>(stride - diagonal - kLanes));
  }
}

/// Copies the tiles of a tiled matrix to a whole one, with zeros left of them.
template <typename Real>
inline void SpreadTilesLower(const Real* tiles, Real* m, int stride) {
  for (std::ptrdiff_t i = 0; i < stride; ++i) {
    Real* const row = m + i * stride;
    const std::ptrdiff_t diagonal = i / kLanes * kLanes;
    std::memset(row, 0, sizeof(Real) * static_cast<size_t>(diagonal));
    Store(row + diagonal, Load(tiles + i * kLanes));
  }
}

/// Copies the upper triangle of a matrix, with whole diagonal tiles.
template <typename Real>
inline void CopyUpper(const Real* from, Real* m, int stride) {
  for (std::ptrdiff_t i = 0; i < stride; ++i) {
    const std::ptrdiff_t diagonal = i / kLanes * kLanes, row = i * stride;
    for (std::ptrdiff_t j = diagonal; j < stride; j += kLanes) Store(m + row + j, Load(from + row + j));
  }
}

}  // namespace legopt::kernels
