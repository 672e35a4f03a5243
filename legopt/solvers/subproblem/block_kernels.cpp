#include "legopt/solvers/subproblem/block_kernels.h"

#include <algorithm>
#include <cmath>

#include "legopt/solvers/subproblem/dense_kernels.h"

#if defined(__x86_64__) && defined(__FMA__)
#define LEGOPT_KERNELS_OF_EIGHT
#endif

namespace legopt::kernels {
namespace {

/// The sum over `count` rows of a_r b_r^T, with rows `a_step` and `b_step` apart.
template <typename Real>
struct Run {
  const Real* a;
  std::ptrdiff_t a_step;
  const Real* b;
  std::ptrdiff_t b_step;
  int count;
};

/// Replaces a 4 x 4 tile by the inverse of U, where U^T U is the symmetric matrix of its upper triangle; zeros below.
/// Computes U = D^1/2 L^T with a unit L, whose pivots need no roots; all roots are taken at once at the end. Returns
/// false if a pivot is not finite.
template <typename Real>
inline bool FactorTile(Real* tile, std::ptrdiff_t stride, const Real* min_pivot) {
  Real* const r0 = tile;
  Real* const r1 = tile + stride;
  Real* const r2 = r1 + stride;
  Real* const r3 = r2 + stride;
  const Real d0 = std::max(min_pivot[0], r0[0]);
  const Real i0 = Real{1} / d0;
  const Real l01 = r0[1] * i0, l02 = r0[2] * i0, l03 = r0[3] * i0;
  const Real d1 = std::max(min_pivot[1], std::fma(-l01, r0[1], r1[1]));
  const Real i1 = Real{1} / d1;
  const Real e12 = std::fma(-l01, r0[2], r1[2]), e13 = std::fma(-l01, r0[3], r1[3]);
  const Real l12 = e12 * i1, l13 = e13 * i1;
  const Real d2 = std::max(min_pivot[2], std::fma(-l12, e12, std::fma(-l02, r0[2], r2[2])));
  const Real i2 = Real{1} / d2;
  const Real e23 = std::fma(-l12, e13, std::fma(-l02, r0[3], r2[3]));
  const Real l23 = e23 * i2;
  const Real p3 = std::fma(-l23, e23, std::fma(-l13, e13, std::fma(-l03, r0[3], r3[3])));
  const Real d3 = std::max(min_pivot[3], p3);
  // A maximum drops NaN, so check the sums from which the pivots are computed.
  if (!std::isfinite(r0[0] + r1[1] + r2[2] + r3[3] + l01 + l02 + l03 + e12 + e13 + e23 + p3)) return false;
  using Four = LanesOf<Real>;
  const Four one = Broadcast(Real{1});
  const Four root = one / Root(Four{d0, d1, d2, d3});
  const Real w02 = std::fma(l01, l12, -l02), w13 = std::fma(l12, l23, -l13);
  const Real w03 = -std::fma(l01, w13, std::fma(-l02, l23, l03));
  Store(r0, Four{1, -l01, w02, w03} * root);
  Store(r1, Four{0, 1, -l12, w13} * root);
  Store(r2, Four{0, 0, 1, -l23} * root);
  Store(r3, Four{0, 0, 0, 1} * root);
  return true;
}

inline void Put(double* p, Lanes v) { Store(p, v); }
inline void Put(float* p, FloatLanes v) { Store(p, v); }
template <typename Four>
inline Four Low(Four v) {
  return v;
}
template <typename Four>
inline Four Product(Four a, Four b) {
  return a * b;
}
template <typename Four>
inline Four Sum3(Four a, Four b, Four c) {
  return MulAdd(a, b, c);
}
template <typename Four>
inline Four Less3(Four a, Four b, Four c) {
  return NegativeMulAdd(a, b, c);
}

/// Vector of eight numbers.
template <typename Real>
struct TwoFours {
  LanesOf<Real> low, high;
};
template <typename Real>
inline void Put(Real* p, const TwoFours<Real>& v) {
  Store(p, v.low);
  Store(p + kLanes, v.high);
}
template <typename Real>
inline LanesOf<Real> Low(const TwoFours<Real>& v) {
  return v.low;
}
template <typename Real>
inline TwoFours<Real> Product(const TwoFours<Real>& a, const TwoFours<Real>& b) {
  return {a.low * b.low, a.high * b.high};
}
template <typename Real>
inline TwoFours<Real> Sum3(const TwoFours<Real>& a, const TwoFours<Real>& b, const TwoFours<Real>& c) {
  return {MulAdd(a.low, b.low, c.low), MulAdd(a.high, b.high, c.high)};
}
template <typename Real>
inline TwoFours<Real> Less3(const TwoFours<Real>& a, const TwoFours<Real>& b, const TwoFours<Real>& c) {
  return {NegativeMulAdd(a.low, b.low, c.low), NegativeMulAdd(a.high, b.high, c.high)};
}

#define LEGOPT_KERNEL

namespace four_doubles {
using Real = double;
using Vector = Lanes;
constexpr int kWidth = kLanes;
inline Vector Get(const Real* p) { return Load(p); }
inline Vector Spread(Real c) { return Broadcast(c); }
namespace narrow = four_doubles;
#include "legopt/solvers/subproblem/block_kernels.inc"
}  // namespace four_doubles

namespace two_fours_of_doubles {
using Real = double;
using Vector = TwoFours<Real>;
constexpr int kWidth = 2 * kLanes;
inline Vector Get(const Real* p) { return {Load(p), Load(p + kLanes)}; }
inline Vector Spread(Real c) { return {Broadcast(c), Broadcast(c)}; }
namespace narrow = four_doubles;
#include "legopt/solvers/subproblem/block_kernels.inc"
}  // namespace two_fours_of_doubles

namespace four_floats {
using Real = float;
using Vector = FloatLanes;
constexpr int kWidth = kLanes;
inline Vector Get(const Real* p) { return Load(p); }
inline Vector Spread(Real c) { return Broadcast(c); }
namespace narrow = four_floats;
#include "legopt/solvers/subproblem/block_kernels.inc"
}  // namespace four_floats

namespace two_fours_of_floats {
using Real = float;
using Vector = TwoFours<Real>;
constexpr int kWidth = 2 * kLanes;
inline Vector Get(const Real* p) { return {Load(p), Load(p + kLanes)}; }
inline Vector Spread(Real c) { return {Broadcast(c), Broadcast(c)}; }
namespace narrow = four_floats;
#include "legopt/solvers/subproblem/block_kernels.inc"
}  // namespace two_fours_of_floats

#ifdef LEGOPT_KERNELS_OF_EIGHT
namespace eight_floats {
using Real = float;
using Vector = __m256;
constexpr int kWidth = 2 * kLanes;
inline Vector Get(const Real* p) { return _mm256_loadu_ps(p); }
inline void Put(Real* p, Vector v) { _mm256_storeu_ps(p, v); }
inline Vector Spread(Real c) { return _mm256_set1_ps(c); }
inline FloatLanes Low(Vector v) { return _mm256_castps256_ps128(v); }
inline Vector Product(Vector a, Vector b) { return _mm256_mul_ps(a, b); }
inline Vector Sum3(Vector a, Vector b, Vector c) { return _mm256_fmadd_ps(a, b, c); }
inline Vector Less3(Vector a, Vector b, Vector c) { return _mm256_fnmadd_ps(a, b, c); }
namespace narrow = four_floats;
#include "legopt/solvers/subproblem/block_kernels.inc"
}  // namespace eight_floats
#endif

#undef LEGOPT_KERNEL

#ifdef LEGOPT_KERNELS_OF_EIGHT
// Compiled for AVX-512 whatever the target of the other code; called only if the processor supports it.
#define LEGOPT_KERNEL __attribute__((target("avx512f,avx512vl")))

namespace eight_doubles {
using Real = double;
using Vector = __m512d;
constexpr int kWidth = 2 * kLanes;
LEGOPT_KERNEL inline Vector Get(const Real* p) { return _mm512_loadu_pd(p); }
LEGOPT_KERNEL inline void Put(Real* p, Vector v) { _mm512_storeu_pd(p, v); }
LEGOPT_KERNEL inline Vector Spread(Real c) { return _mm512_set1_pd(c); }
LEGOPT_KERNEL inline Lanes Low(Vector v) { return _mm512_castpd512_pd256(v); }
LEGOPT_KERNEL inline Vector Product(Vector a, Vector b) { return _mm512_mul_pd(a, b); }
LEGOPT_KERNEL inline Vector Sum3(Vector a, Vector b, Vector c) { return _mm512_fmadd_pd(a, b, c); }
LEGOPT_KERNEL inline Vector Less3(Vector a, Vector b, Vector c) { return _mm512_fnmadd_pd(a, b, c); }
namespace narrow = four_doubles;
#include "legopt/solvers/subproblem/block_kernels.inc"
}  // namespace eight_doubles

#undef LEGOPT_KERNEL
#endif

/// Returns null if this processor or build does not support them.
const BlockKernels<double>* EightDoubles() {
#ifdef LEGOPT_KERNELS_OF_EIGHT
  if (__builtin_cpu_supports("avx512f") != 0 && __builtin_cpu_supports("avx512vl") != 0)
    return &eight_doubles::kKernels;
#endif
  return nullptr;
}
const BlockKernels<float>* EightFloats() {
#ifdef LEGOPT_KERNELS_OF_EIGHT
  return &eight_floats::kKernels;  // such builds require AVX2
#else
  return nullptr;
#endif
}

template <typename Real>
const BlockKernels<Real>* Widest() {
  const BlockKernels<Real>* const eight = KernelsOf<Real>(BlockVectors::kEight);
  return eight != nullptr ? eight : KernelsOf<Real>(BlockVectors::kFour);
}

const BlockKernels<double>* chosen_of_doubles = Widest<double>();
const BlockKernels<float>* chosen_of_floats = Widest<float>();

}  // namespace

template <>
const BlockKernels<double>* KernelsOf(BlockVectors vectors) {
  if (vectors == BlockVectors::kEight) return EightDoubles();
  return vectors == BlockVectors::kFour ? &four_doubles::kKernels : &two_fours_of_doubles::kKernels;
}
template <>
const BlockKernels<float>* KernelsOf(BlockVectors vectors) {
  if (vectors == BlockVectors::kEight) return EightFloats();
  return vectors == BlockVectors::kFour ? &four_floats::kKernels : &two_fours_of_floats::kKernels;
}

template <>
const BlockKernels<double>& ChosenKernels() {
  return *chosen_of_doubles;
}
template <>
const BlockKernels<float>& ChosenKernels() {
  return *chosen_of_floats;
}
void ChooseKernels(const BlockKernels<double>& kernels) { chosen_of_doubles = &kernels; }
void ChooseKernels(const BlockKernels<float>& kernels) { chosen_of_floats = &kernels; }

namespace {

/// Computes rows k to k + 3 of U^-T b and subtracts their contribution from the rows of b below.
template <typename Real>
inline LanesOf<Real> SolveTile(const Real* u, int stride, int k, Real* b) {
  const Real* const rows = u + static_cast<std::ptrdiff_t>(k) * stride + k;
  const LanesOf<Real> right = Load(b + k);
  LanesOf<Real> x = Broadcast(right[0]) * Load(rows);
  x = MulAdd(Broadcast(right[1]), Load(rows + stride), x);
  x = MulAdd(Broadcast(right[2]), Load(rows + 2 * std::ptrdiff_t{stride}), x);
  x = MulAdd(Broadcast(right[3]), Load(rows + 3 * std::ptrdiff_t{stride}), x);
  Store(b + k, x);
  SubtractCombination<Real>(x, rows + kLanes, stride, b + k + kLanes, stride - k - kLanes);
  return x;
}

}  // namespace

template <typename Real>
void SolveTransposed(const Real* u, int stride, Real* b) {
  for (int k = 0; k < stride; k += kLanes) SolveTile(u, stride, k, b);
}

// The tiles depend on each other; their contributions to the next block do not.
template <typename Real>
void SolveForward(const FactoredBlock<Real>& block, Real* b) {
  const int stride = block.stride;
  Real* const next = b + stride;
  for (int k = 0; k < stride; k += kLanes) {
    const LanesOf<Real> x = SolveTile(block.u, stride, k, b);
    if (block.t == nullptr) continue;
    SubtractCombination<Real>(x, block.t + static_cast<std::ptrdiff_t>(k) * stride, stride, next,
                              block.lower ? k + kLanes : stride);
  }
  for (std::ptrdiff_t r = 0; r < block.count; ++r) {
    Axpy(-Dot(b, block.left + r * stride, stride), block.right + r * stride, next, stride);
  }
}

template <typename Real>
void SolveBack(const FactoredBlock<Real>& block, Real* b) {
  const int stride = block.stride;
  const Real* const next = b + stride;
  Real from_rows[kMaxExtraRows];
  for (std::ptrdiff_t r = 0; r < block.count; ++r) from_rows[r] = Dot(next, block.right + r * stride, stride);
  for (int k = stride - kLanes; k >= 0; k -= kLanes) {
    const std::ptrdiff_t row = static_cast<std::ptrdiff_t>(k) * stride;
    const Real* const rows = block.u + row + k;
    LanesOf<Real> right = Load(b + k);
    if (block.t != nullptr) {
      right -= ProductsOfFour(block.t + row, stride, next, block.lower ? k + kLanes : stride);
    }
    for (std::ptrdiff_t r = 0; r < block.count; ++r) {
      right = NegativeMulAdd(Broadcast(from_rows[r]), Load(block.left + r * stride + k), right);
    }
    right -= ProductsOfFour(rows + kLanes, stride, b + k + kLanes, stride - k - kLanes);
    // V s for the tile V from its columns, which are the rows of V^T.
    using Four = LanesOf<Real>;
    const Four r0 = Load(rows), r1 = Load(rows + stride), r2 = Load(rows + 2 * std::ptrdiff_t{stride}),
               r3 = Load(rows + 3 * std::ptrdiff_t{stride});
    const Four low01 = __builtin_shufflevector(r0, r1, 0, 4, 1, 5), low23 = __builtin_shufflevector(r2, r3, 0, 4, 1, 5),
               high01 = __builtin_shufflevector(r0, r1, 2, 6, 3, 7),
               high23 = __builtin_shufflevector(r2, r3, 2, 6, 3, 7);
    LanesOf<Real> x = Broadcast(right[0]) * __builtin_shufflevector(low01, low23, 0, 1, 4, 5);
    x = MulAdd(Broadcast(right[1]), __builtin_shufflevector(low01, low23, 2, 3, 6, 7), x);
    x = MulAdd(Broadcast(right[2]), __builtin_shufflevector(high01, high23, 0, 1, 4, 5), x);
    x = MulAdd(Broadcast(right[3]), __builtin_shufflevector(high01, high23, 2, 3, 6, 7), x);
    Store(b + k, x);
  }
}

template void SolveTransposed(const double* u, int stride, double* b);
template void SolveTransposed(const float* u, int stride, float* b);
template void SolveForward(const FactoredBlock<double>& block, double* b);
template void SolveForward(const FactoredBlock<float>& block, float* b);
template void SolveBack(const FactoredBlock<double>& block, double* b);
template void SolveBack(const FactoredBlock<float>& block, float* b);

}  // namespace legopt::kernels
