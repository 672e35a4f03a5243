#pragma once

#include <cstddef>
#include <span>

/// The inner loops of the interior-point solver over square blocks, in vectors as wide as the processor has them.
/// Matrices are row-major, of `stride` rows and columns, which is a multiple of four.
namespace legopt::kernels {

/// Vectors that blocks are computed with. Every entry is the same sum in the same order, so that bits are equal.
enum class BlockVectors {
  kFour,      ///< of four doubles: every processor
  kTwoFours,  ///< of eight, computed as two of four: the code of kEight on every processor, for tests
  kEight      ///< of eight: AVX-512
};

/// Products a_r b_r^T of rows that are zero outside of some columns and are stored without the others.
struct PackedProducts {
  const double* a;               ///< `count` rows of 4 columns.size() entries
  const double* b;               ///< likewise
  int count;                     ///< of rows
  std::span<const int> columns;  ///< first of each four columns that are stored, increasing multiples of four
};

/// T^T T + sum over `count` rows of a_r b_r^T, the latter sum being symmetric.
struct Reduction {
  const double* t = nullptr;  ///< null: nothing
  bool lower = false;         ///< T has zeros right of its diagonal's 4 x 4 tiles
  const double* a = nullptr;  ///< rows of `stride` entries
  const double* b = nullptr;  ///< likewise
  int count = 0;              ///< of rows
};

/// What is done to whole blocks. Pure functions of their arguments, any thread.
struct BlockKernels {
  /// Upper triangle of M += sum_r a_r b_r^T, the sum being symmetric.
  void (*add_squares)(const PackedProducts& products, double* m, int stride);
  /// Cholesky factor M - R = U^T U of an upper triangle, in place, and T <- U^-T T where t is not null. In the
  /// diagonal's 4 x 4 tiles of U stand their inverses. Pad rows and columns must be the identity's. Every pivot is kept
  /// at or above its entry of `min_pivot`, > 0: below the rounding error of what was subtracted it would be noise, and
  /// blow up all that follows. `lower`: T has, and gets, nothing right of its diagonal's tiles. False when a pivot is
  /// not finite.
  bool (*factor)(const Reduction& r, double* m, const double* min_pivot, double* t, bool lower, int stride);
};

/// The kernels of these vectors; null where this processor or build has none.
const BlockKernels* KernelsOf(BlockVectors vectors);

/// What solvers use: the widest that there are, unless others were chosen.
const BlockKernels& ChosenKernels();
/// For tests and benchmarks: others from now on. No other thread may be solving.
void ChooseKernels(const BlockKernels& kernels);

/// b <- U^-T b for a factor of `factor`.
void SolveTransposed(const double* u, int stride, double* b);
/// b <- U^-1 b.
void SolveUpper(const double* u, int stride, double* b);

}  // namespace legopt::kernels
