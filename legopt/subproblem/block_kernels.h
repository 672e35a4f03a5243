#pragma once

#include <cstddef>
#include <span>

/// The inner loops of the interior-point solver over square blocks, in vectors as wide as the processor has them.
/// `Real` is double or float. Matrices are row-major, of `stride` rows and columns, which is a multiple of four.
namespace legopt::kernels {

/// Vectors that blocks are computed with. Every entry is the same sum in the same order, so that bits are equal.
enum class BlockVectors {
  kFour,      ///< of four numbers: every processor
  kTwoFours,  ///< of eight, computed as two of four: the code of kEight on every processor, for tests
  kEight      ///< of eight: AVX-512 for doubles, AVX2 for floats
};

/// Rows a_r with weights d_r, one behind the other.
template <typename Real>
struct WeightedRows {
  const Real* rows;     ///< `count` of them
  const Real* weights;  ///< likewise
  int count;            ///< of rows
};

/// Rows that are zero outside of some columns, and stored without the others.
template <typename Real>
struct PackedSquares {
  static constexpr int kMostRuns = 4;        ///< of rows
  static constexpr int kScratch = 8;         ///< entries for each row
  std::span<const WeightedRows<Real>> runs;  ///< at most kMostRuns; rows of 4 columns.size() entries
  std::span<const int> columns;  ///< first of each four columns that are stored, increasing multiples of four
  Real* scratch;                 ///< kScratch entries for each row, of this call alone
};

/// T^T T + sum over `count` rows of a_r b_r^T, the latter sum being symmetric.
template <typename Real>
struct Reduction {
  const Real* t = nullptr;  ///< null: nothing
  bool lower = false;       ///< T has zeros right of its diagonal's 4 x 4 tiles
  const Real* a = nullptr;  ///< rows of `stride` entries
  const Real* b = nullptr;  ///< likewise
  int count = 0;            ///< of rows
};

/// What couples a block with the next one, C + sum over `count` rows of l_r r_r^T, and where T = U^-T of it goes.
template <typename Real>
struct Coupling {
  const Real* c = nullptr;           ///< C: `stride` rows, of a tiled one of four entries (dense_kernels.h)
  bool tiled = false;                ///< so is C; T must have, and gets, only zeros right of its diagonal's tiles
  const Real* minus_left = nullptr;  ///< rows -l of `stride` entries; of a dense C only
  const Real* right = nullptr;       ///< likewise, r
  int count = 0;                     ///< of these rows
  Real* t = nullptr;                 ///< to be written; null: there is no next block
};

/// What is done to whole blocks. Pure functions of their arguments, any thread.
template <typename Real>
struct BlockKernels {
  /// Upper triangle of M <- F + sum_r d_r a_r a_r^T in the rows and columns that are stored. F may be M.
  void (*add_squares)(const PackedSquares<Real>& squares, const Real* f, Real* m, int stride);
  /// Cholesky factor M - R = U^T U of an upper triangle, in place, and the T of what couples it with the next block. In
  /// the diagonal's 4 x 4 tiles of U stand their inverses. Pad rows and columns must be the identity's. Every pivot is
  /// kept at or above its entry of `min_pivot`, > 0: below the rounding error of what was subtracted it would be noise,
  /// and blow up all that follows. False when a pivot is not finite.
  bool (*factor)(const Reduction<Real>& r, Real* m, const Real* min_pivot, const Coupling<Real>& link, int stride);
};

/// The kernels of these vectors, of doubles or floats; null where this processor or build has none.
template <typename Real>
const BlockKernels<Real>* KernelsOf(BlockVectors vectors);
/// Of doubles.
template <>
const BlockKernels<double>* KernelsOf(BlockVectors vectors);
/// Of floats.
template <>
const BlockKernels<float>* KernelsOf(BlockVectors vectors);

/// What solvers use: the widest that there are, unless others were chosen.
template <typename Real>
const BlockKernels<Real>& ChosenKernels();
/// Of doubles.
template <>
const BlockKernels<double>& ChosenKernels();
/// Of floats.
template <>
const BlockKernels<float>& ChosenKernels();

/// For tests and benchmarks: others from now on. No other thread may be solving.
void ChooseKernels(const BlockKernels<double>& kernels);
/// Likewise, those of floats.
void ChooseKernels(const BlockKernels<float>& kernels);

/// b <- U^-T b for a factor of `factor`.
template <typename Real>
void SolveTransposed(const Real* u, int stride, Real* b);

/// Of a FactoredBlock, beside a lower T; products of more cost as much as a dense block.
inline constexpr int kMostRowsBeside = 6;

/// A block that has been factored, and beside it T + sum over `count` rows of z_r r_r^T: with z = U^-T l, what was C +
/// sum of l_r r_r^T before. Beside a dense T there are no rows; it holds them.
template <typename Real>
struct FactoredBlock {
  const Real* u = nullptr;      ///< U, as `factor` leaves it
  const Real* t = nullptr;      ///< null: there is no next block
  bool lower = false;           ///< T has nothing right of its diagonal's tiles
  const Real* left = nullptr;   ///< rows z of `stride` entries
  const Real* right = nullptr;  ///< likewise, r
  int count = 0;                ///< of these rows, at most kMostRowsBeside
  int stride = 0;               ///< of all matrices and rows
};

/// b <- U^-T b, and of the `stride` entries behind it what b takes from the next block, if there is one:
/// n -= (T + sum z_r r_r^T)^T b.
template <typename Real>
void SolveForward(const FactoredBlock<Real>& block, Real* b);
/// b <- U^-1 (b - (T + sum z_r r_r^T) n) for the next block's n, which is behind b.
template <typename Real>
void SolveBack(const FactoredBlock<Real>& block, Real* b);

}  // namespace legopt::kernels
