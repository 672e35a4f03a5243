#include "legopt/subproblem/block_kernels.h"

#include <algorithm>
#include <cmath>

#include "legopt/subproblem/dense_kernels.h"

#if defined(__x86_64__) && defined(__FMA__)
#define LEGOPT_KERNELS_OF_EIGHT
#endif

namespace legopt::kernels {
namespace {

/// sum over `count` rows of a_r b_r^T, the rows `a_step` and `b_step` apart.
struct Run {
  const double* a;
  std::ptrdiff_t a_step;
  const double* b;
  std::ptrdiff_t b_step;
  int count;
};

/// A 4 x 4 tile of a factor: the inverse of U where U^T U is the symmetric matrix of its upper triangle, zeros below.
/// By way of U = D^1/2 L^T with a unit L, whose pivots need no roots: these are taken side by side in the end.
inline bool FactorTile(double* tile, std::ptrdiff_t stride, const double* min_pivot) {
  double* const r0 = tile;
  double* const r1 = tile + stride;
  double* const r2 = r1 + stride;
  double* const r3 = r2 + stride;
  const double d0 = std::max(min_pivot[0], r0[0]);
  const double i0 = 1.0 / d0;
  const double l01 = r0[1] * i0, l02 = r0[2] * i0, l03 = r0[3] * i0;
  const double d1 = std::max(min_pivot[1], std::fma(-l01, r0[1], r1[1]));
  const double i1 = 1.0 / d1;
  const double e12 = std::fma(-l01, r0[2], r1[2]), e13 = std::fma(-l01, r0[3], r1[3]);
  const double l12 = e12 * i1, l13 = e13 * i1;
  const double d2 = std::max(min_pivot[2], std::fma(-l12, e12, std::fma(-l02, r0[2], r2[2])));
  const double i2 = 1.0 / d2;
  const double e23 = std::fma(-l12, e13, std::fma(-l02, r0[3], r2[3]));
  const double l23 = e23 * i2;
  const double p3 = std::fma(-l23, e23, std::fma(-l13, e13, std::fma(-l03, r0[3], r3[3])));
  const double d3 = std::max(min_pivot[3], p3);
  // A NaN on the way is lost in a maximum, but for the sums that it was made of.
  if (!std::isfinite(r0[0] + r1[1] + r2[2] + r3[3] + l01 + l02 + l03 + e12 + e13 + e23 + p3)) return false;
  const Lanes one = Broadcast(1.0);
  const Lanes root = one / Root(Lanes{d0, d1, d2, d3});
  const double w02 = std::fma(l01, l12, -l02), w13 = std::fma(l12, l23, -l13);
  const double w03 = -std::fma(l01, w13, std::fma(-l02, l23, l03));
  Store(r0, Lanes{1.0, -l01, w02, w03} * root);
  Store(r1, Lanes{0.0, 1.0, -l12, w13} * root);
  Store(r2, Lanes{0.0, 0.0, 1.0, -l23} * root);
  Store(r3, Lanes{0.0, 0.0, 0.0, 1.0} * root);
  return true;
}

#define LEGOPT_KERNEL

namespace four {
using Vector = Lanes;
constexpr int kWidth = kLanes;
inline Vector Get(const double* p) { return Load(p); }
inline void Put(double* p, Vector v) { Store(p, v); }
inline Vector Spread(double c) { return Broadcast(c); }
[[maybe_unused]] inline Lanes Low(Vector v) { return v; }  // asked of wider ones only
inline Vector Product(Vector a, Vector b) { return a * b; }
inline Vector Sum3(Vector a, Vector b, Vector c) { return MulAdd(a, b, c); }
inline Vector Less3(Vector a, Vector b, Vector c) { return NegativeMulAdd(a, b, c); }
namespace narrow = four;
#include "legopt/subproblem/block_kernels.inc"
}  // namespace four

namespace two_fours {
struct Vector {
  Lanes low, high;
};
constexpr int kWidth = 2 * kLanes;
inline Vector Get(const double* p) { return {Load(p), Load(p + kLanes)}; }
inline void Put(double* p, const Vector& v) {
  Store(p, v.low);
  Store(p + kLanes, v.high);
}
inline Vector Spread(double c) { return {Broadcast(c), Broadcast(c)}; }
inline Lanes Low(const Vector& v) { return v.low; }
inline Vector Product(const Vector& a, const Vector& b) { return {a.low * b.low, a.high * b.high}; }
inline Vector Sum3(const Vector& a, const Vector& b, const Vector& c) {
  return {MulAdd(a.low, b.low, c.low), MulAdd(a.high, b.high, c.high)};
}
inline Vector Less3(const Vector& a, const Vector& b, const Vector& c) {
  return {NegativeMulAdd(a.low, b.low, c.low), NegativeMulAdd(a.high, b.high, c.high)};
}
namespace narrow = four;
#include "legopt/subproblem/block_kernels.inc"
}  // namespace two_fours

#undef LEGOPT_KERNEL

#ifdef LEGOPT_KERNELS_OF_EIGHT
// Compiled for AVX-512 whatever the rest is compiled for; called only where the processor has it.
#define LEGOPT_KERNEL __attribute__((target("avx512f,avx512vl")))

namespace eight {
using Vector = __m512d;
constexpr int kWidth = 2 * kLanes;
LEGOPT_KERNEL inline Vector Get(const double* p) { return _mm512_loadu_pd(p); }
LEGOPT_KERNEL inline void Put(double* p, Vector v) { _mm512_storeu_pd(p, v); }
LEGOPT_KERNEL inline Vector Spread(double c) { return _mm512_set1_pd(c); }
LEGOPT_KERNEL inline Lanes Low(Vector v) { return _mm512_castpd512_pd256(v); }
LEGOPT_KERNEL inline Vector Product(Vector a, Vector b) { return _mm512_mul_pd(a, b); }
LEGOPT_KERNEL inline Vector Sum3(Vector a, Vector b, Vector c) { return _mm512_fmadd_pd(a, b, c); }
LEGOPT_KERNEL inline Vector Less3(Vector a, Vector b, Vector c) { return _mm512_fnmadd_pd(a, b, c); }
namespace narrow = four;
#include "legopt/subproblem/block_kernels.inc"
}  // namespace eight

#undef LEGOPT_KERNEL
#endif

const BlockKernels* Widest() {
  const BlockKernels* const eight = KernelsOf(BlockVectors::kEight);
  return eight != nullptr ? eight : KernelsOf(BlockVectors::kFour);
}

const BlockKernels* chosen_kernels = Widest();

}  // namespace

const BlockKernels* KernelsOf(BlockVectors vectors) {
  switch (vectors) {
    case BlockVectors::kFour:
      return &four::kKernels;
    case BlockVectors::kTwoFours:
      return &two_fours::kKernels;
    case BlockVectors::kEight:
      break;
  }
#ifdef LEGOPT_KERNELS_OF_EIGHT
  if (__builtin_cpu_supports("avx512f") != 0 && __builtin_cpu_supports("avx512vl") != 0) return &eight::kKernels;
#endif
  return nullptr;
}

const BlockKernels& ChosenKernels() { return *chosen_kernels; }
void ChooseKernels(const BlockKernels& kernels) { chosen_kernels = &kernels; }

namespace {

/// Rows k to k + 3 of U^-T b, and what of b is below them less what these take from it.
inline Lanes SolveTile(const double* u, int stride, int k, double* b) {
  const double* const rows = u + static_cast<std::ptrdiff_t>(k) * stride + k;
  const Lanes right = Load(b + k);
  Lanes x = Broadcast(right[0]) * Load(rows);
  x = MulAdd(Broadcast(right[1]), Load(rows + stride), x);
  x = MulAdd(Broadcast(right[2]), Load(rows + 2 * std::ptrdiff_t{stride}), x);
  x = MulAdd(Broadcast(right[3]), Load(rows + 3 * std::ptrdiff_t{stride}), x);
  Store(b + k, x);
  SubtractCombination(x, rows + kLanes, stride, b + k + kLanes, stride - k - kLanes);
  return x;
}

}  // namespace

void SolveTransposed(const double* u, int stride, double* b) {
  for (int k = 0; k < stride; k += kLanes) SolveTile(u, stride, k, b);
}

// Tiles wait for each other; what they take from the next block does not wait.
void SolveForward(const FactoredBlock& block, double* b) {
  const int stride = block.stride;
  double* const next = b + stride;
  for (int k = 0; k < stride; k += kLanes) {
    const Lanes x = SolveTile(block.u, stride, k, b);
    if (block.t == nullptr) continue;
    SubtractCombination(x, block.t + static_cast<std::ptrdiff_t>(k) * stride, stride, next,
                        block.lower ? k + kLanes : stride);
  }
  for (std::ptrdiff_t r = 0; r < block.count; ++r) {
    Axpy(-Dot(b, block.left + r * stride, stride), block.right + r * stride, next, stride);
  }
}

void SolveBack(const FactoredBlock& block, double* b) {
  const int stride = block.stride;
  const double* const next = b + stride;
  double from_rows[FactoredBlock::kMostRows];
  for (std::ptrdiff_t r = 0; r < block.count; ++r) from_rows[r] = Dot(next, block.right + r * stride, stride);
  for (int k = stride - kLanes; k >= 0; k -= kLanes) {
    const std::ptrdiff_t row = static_cast<std::ptrdiff_t>(k) * stride;
    const double* const rows = block.u + row + k;
    Lanes right = Load(b + k);
    if (block.t != nullptr) {
      right -= ProductsOfFour(block.t + row, stride, next, block.lower ? k + kLanes : stride);
    }
    for (std::ptrdiff_t r = 0; r < block.count; ++r) {
      right = NegativeMulAdd(Broadcast(from_rows[r]), Load(block.left + r * stride + k), right);
    }
    right -= ProductsOfFour(rows + kLanes, stride, b + k + kLanes, stride - k - kLanes);
    // V s for the tile V by its columns, which are those of V^T's rows.
    const Lanes r0 = Load(rows), r1 = Load(rows + stride), r2 = Load(rows + 2 * std::ptrdiff_t{stride}),
                r3 = Load(rows + 3 * std::ptrdiff_t{stride});
    const Lanes low01 = __builtin_shufflevector(r0, r1, 0, 4, 1, 5),
                low23 = __builtin_shufflevector(r2, r3, 0, 4, 1, 5),
                high01 = __builtin_shufflevector(r0, r1, 2, 6, 3, 7),
                high23 = __builtin_shufflevector(r2, r3, 2, 6, 3, 7);
    Lanes x = Broadcast(right[0]) * __builtin_shufflevector(low01, low23, 0, 1, 4, 5);
    x = MulAdd(Broadcast(right[1]), __builtin_shufflevector(low01, low23, 2, 3, 6, 7), x);
    x = MulAdd(Broadcast(right[2]), __builtin_shufflevector(high01, high23, 0, 1, 4, 5), x);
    x = MulAdd(Broadcast(right[3]), __builtin_shufflevector(high01, high23, 2, 3, 6, 7), x);
    Store(b + k, x);
  }
}

}  // namespace legopt::kernels
