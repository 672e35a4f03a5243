#pragma once

#include <immintrin.h>

#include <chrono>
#include <limits>

#include "legopt/subproblem/block_kernels.h"

namespace legopt {

/// @file
/// What one core of this machine can do at most: chains of fused multiply-adds that wait for nothing, in the vectors
/// that the kernels of the interior-point solver use.

inline constexpr int kChains = 12;     ///< enough for two units of four cycles, few enough for sixteen registers
inline constexpr int kLinks = 200000;  ///< of each chain: some 0.1 ms

/// Chains in vectors of four doubles; the sum is there so that nobody leaves them out.
__attribute__((target("avx2,fma"))) inline double RunChainsOfFour() {
  __m256d sums[kChains];
  const __m256d factor = _mm256_set1_pd(0.999), addend = _mm256_set1_pd(1e-3);
  for (auto& sum : sums) sum = addend;
  for (int i = 0; i < kLinks; ++i) {
    for (auto& sum : sums) sum = _mm256_fmadd_pd(sum, factor, addend);
  }
  for (int k = 1; k < kChains; ++k) sums[0] = _mm256_add_pd(sums[0], sums[k]);
  return _mm256_cvtsd_f64(sums[0]);
}

/// Likewise of eight.
__attribute__((target("avx512f"))) inline double RunChainsOfEight() {
  __m512d sums[kChains];
  const __m512d factor = _mm512_set1_pd(0.999), addend = _mm512_set1_pd(1e-3);
  for (auto& sum : sums) sum = addend;
  for (int i = 0; i < kLinks; ++i) {
    for (auto& sum : sums) sum = _mm512_fmadd_pd(sum, factor, addend);
  }
  for (int k = 1; k < kChains; ++k) sums[0] = _mm512_add_pd(sums[0], sums[k]);
  return _mm512_cvtsd_f64(sums[0]);
}

/// Largest of several measurements, flop/s: double precision, a fused multiply-add being two.
inline double MeasurePeak() {
  constexpr int kTrials = 40;
  const bool wide = kernels::KernelsOf<double>(kernels::BlockVectors::kEight) != nullptr;
  const double flops = 2.0 * (wide ? 8 : 4) * kChains * static_cast<double>(kLinks);
  double fastest_s = std::numeric_limits<double>::infinity();
  volatile double kept = 0.0;
  for (int k = 0; k < kTrials; ++k) {
    const auto began = std::chrono::steady_clock::now();
    kept = wide ? RunChainsOfEight() : RunChainsOfFour();
    const std::chrono::duration<double> took = std::chrono::steady_clock::now() - began;
    fastest_s = took.count() < fastest_s ? took.count() : fastest_s;
  }
  static_cast<void>(kept);
  return flops / fastest_s;
}

}  // namespace legopt
