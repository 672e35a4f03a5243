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

/// Rows a_r with weights d_r, which are zero outside of some columns and are stored without the others.
struct WeightedRows {
  const double* rows;            ///< `count` rows of 4 columns.size() entries
  const double* weights;         ///< `count` of them
  int count;                     ///< of rows
  std::span<const int> columns;  ///< first of each four columns that are stored, increasing multiples of four
  double* scratch;               ///< 4 `count` entries, of this call alone
};

/// T^T T + sum over `count` rows of a_r b_r^T, the latter sum being symmetric.
struct Reduction {
  const double* t = nullptr;  ///< null: nothing
  bool lower = false;         ///< T has zeros right of its diagonal's 4 x 4 tiles
  const double* a = nullptr;  ///< rows of `stride` entries
  const double* b = nullptr;  ///< likewise
  int count = 0;              ///< of rows
};

/// What couples a block with the next one, C + sum over `count` rows of l_r r_r^T, and where T = U^-T of it goes.
struct Coupling {
  const double* c = nullptr;           ///< C: `stride` rows, of a tiled one of four entries (dense_kernels.h)
  bool tiled = false;                  ///< so is C; T must have, and gets, only zeros right of its diagonal's tiles
  const double* minus_left = nullptr;  ///< rows -l of `stride` entries; of a dense C only
  const double* right = nullptr;       ///< likewise, r
  int count = 0;                       ///< of these rows
  double* t = nullptr;                 ///< to be written; null: there is no next block
};

/// What is done to whole blocks. Pure functions of their arguments, any thread.
struct BlockKernels {
  /// Upper triangle of M += sum_r d_r a_r a_r^T.
  void (*add_squares)(const WeightedRows& rows, double* m, int stride);
  /// Cholesky factor M - R = U^T U of an upper triangle, in place, and the T of what couples it with the next block. In
  /// the diagonal's 4 x 4 tiles of U stand their inverses. Pad rows and columns must be the identity's. Every pivot is
  /// kept at or above its entry of `min_pivot`, > 0: below the rounding error of what was subtracted it would be noise,
  /// and blow up all that follows. False when a pivot is not finite.
  bool (*factor)(const Reduction& r, double* m, const double* min_pivot, const Coupling& link, int stride);
};

/// The kernels of these vectors; null where this processor or build has none.
const BlockKernels* KernelsOf(BlockVectors vectors);

/// What solvers use: the widest that there are, unless others were chosen.
const BlockKernels& ChosenKernels();
/// For tests and benchmarks: others from now on. No other thread may be solving.
void ChooseKernels(const BlockKernels& kernels);

/// b <- U^-T b for a factor of `factor`.
void SolveTransposed(const double* u, int stride, double* b);

/// A block that has been factored, and beside it T + sum over `count` rows of z_r r_r^T: with z = U^-T l, what was C +
/// sum of l_r r_r^T before. Beside a dense T there are no rows; it holds them.
struct FactoredBlock {
  static constexpr int kMostRows = 6;  ///< beside a T
  const double* u = nullptr;           ///< U, as `factor` leaves it
  const double* t = nullptr;           ///< null: there is no next block
  bool lower = false;                  ///< T has nothing right of its diagonal's tiles
  const double* left = nullptr;        ///< rows z of `stride` entries
  const double* right = nullptr;       ///< likewise, r
  int count = 0;                       ///< of these rows, at most kMostRows
  int stride = 0;                      ///< of all matrices and rows
};

/// b <- U^-T b, and of the `stride` entries behind it what b takes from the next block, if there is one:
/// n -= (T + sum z_r r_r^T)^T b.
void SolveForward(const FactoredBlock& block, double* b);
/// b <- U^-1 (b - (T + sum z_r r_r^T) n) for the next block's n, which is behind b.
void SolveBack(const FactoredBlock& block, double* b);

}  // namespace legopt::kernels
