#pragma once

#include <immintrin.h>

#include <chrono>
#include <limits>

#include "legopt/solvers/subproblem/block_kernels.h"

namespace legopt {

/// @file
/// Measures the peak floating-point rate of one core: independent chains of fused multiply-adds in the vectors that
/// the kernels of the interior-point solver use.

inline constexpr int kChains = 12;     ///< enough for two units with a latency of four cycles, few enough for sixteen
                                       ///< registers
inline constexpr int kLinks = 200000;  ///< length of each chain, about 0.1 ms

/// Runs the chains in vectors of four doubles. Returns a sum so that the compiler cannot remove them.
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

/// Runs the chains in vectors of eight doubles.
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

/// Returns the highest of several measurements in flop/s. A fused multiply-add in double precision counts as two.
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
