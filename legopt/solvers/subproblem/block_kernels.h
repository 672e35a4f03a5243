#pragma once

#include <cstddef>
#include <span>

/// Inner loops of the interior-point solver over square blocks, in the widest vectors that the processor supports.
/// `Real` is double or float. Matrices are row-major, of `stride` rows and columns, which is a multiple of four.
namespace legopt::kernels {

/// Vectors in which blocks are computed. Every entry is the same sum in the same order, so results are identical bit by
/// bit.
enum class BlockVectors {
  kFour,      ///< four numbers: every processor
  kTwoFours,  ///< eight numbers, computed as two of four: the code of kEight on every processor, for tests
  kEight      ///< eight numbers: AVX-512 for doubles, AVX2 for floats
};

/// Consecutive rows a_r with weights d_r.
template <typename Real>
struct WeightedRows {
  const Real* rows;     ///< `count` rows
  const Real* weights;  ///< `count` weights
  int count;
};

/// Rows that are zero outside some columns and stored without the zero columns.
template <typename Real>
struct PackedSquares {
  static constexpr int kMaxRuns = 4;         ///< maximum number of runs
  static constexpr int kScratch = 8;         ///< scratch entries per row
  std::span<const WeightedRows<Real>> runs;  ///< up to kMaxRuns; rows have 4 columns.size() entries
  std::span<const int> columns;  ///< first column of each stored group of four; increasing multiples of four
  Real* scratch;                 ///< kScratch entries per row, used by this call only
};

/// T^T T + sum over `count` rows of a_r b_r^T, where the latter sum is symmetric.
template <typename Real>
struct Reduction {
  const Real* t = nullptr;  ///< null: no T^T T
  bool lower = false;       ///< T is zero right of its diagonal's 4 x 4 tiles
  const Real* a = nullptr;  ///< rows of `stride` entries
  const Real* b = nullptr;  ///< rows of `stride` entries
  int count = 0;
};

/// Coupling of a block with the next one, C + sum over `count` rows of l_r r_r^T, and the output T, which is U^-T times
/// the coupling.
template <typename Real>
struct Coupling {
  const Real* c = nullptr;           ///< C: `stride` rows, of four entries each if tiled (dense_kernels.h)
  bool tiled = false;                ///< C is tiled; T must be zero right of its diagonal's tiles, and remains so
  const Real* minus_left = nullptr;  ///< rows -l of `stride` entries; dense C only
  const Real* right = nullptr;       ///< rows r of `stride` entries
  int count = 0;                     ///< number of rows l and r
  Real* t = nullptr;                 ///< output T; null: there is no next block
};

/// Operations on whole blocks. Pure functions of their arguments, any thread.
template <typename Real>
struct BlockKernels {
  /// Sets the upper triangle of M <- F + sum_r d_r a_r a_r^T in the stored rows and columns. F may be M.
  void (*add_squares)(const PackedSquares<Real>& squares, const Real* f, Real* m, int stride);
  /// Computes the Cholesky factor M - R = U^T U of an upper triangle in place, and T of the coupling with the next
  /// block. The 4 x 4 diagonal tiles of U are stored as their inverses. Pad rows and columns must be the identity's.
  /// Every pivot is raised to its entry of `min_pivot`, > 0, if it is smaller. A pivot below the rounding error of the
  /// subtraction would be noise and spoil all later entries. Returns false if a pivot is not finite.
  bool (*factor)(const Reduction<Real>& r, Real* m, const Real* min_pivot, const Coupling<Real>& link, int stride);
};

/// Returns the kernels for these vectors, of doubles or floats; null if this processor or build does not support them.
template <typename Real>
const BlockKernels<Real>* KernelsOf(BlockVectors vectors);
/// Specialisation for doubles.
template <>
const BlockKernels<double>* KernelsOf(BlockVectors vectors);
/// Specialisation for floats.
template <>
const BlockKernels<float>* KernelsOf(BlockVectors vectors);

/// Returns the kernels that solvers use: the widest available ones, unless others were chosen.
template <typename Real>
const BlockKernels<Real>& ChosenKernels();
/// Specialisation for doubles.
template <>
const BlockKernels<double>& ChosenKernels();
/// Specialisation for floats.
template <>
const BlockKernels<float>& ChosenKernels();

/// Selects the kernels for doubles, in tests and benchmarks. No other thread may be solving.
void ChooseKernels(const BlockKernels<double>& kernels);
/// Selects the kernels for floats, under the same condition.
void ChooseKernels(const BlockKernels<float>& kernels);

/// Sets b <- U^-T b for a factor U from `factor`.
template <typename Real>
void SolveTransposed(const Real* u, int stride, Real* b);

/// Maximum number of rows beside a lower T; the products of more rows cost as much as a dense block.
inline constexpr int kMaxExtraRows = 6;

/// A factored block and its coupling T + sum over `count` rows of z_r r_r^T, where z = U^-T l (before the elimination:
/// C + sum of l_r r_r^T). A dense T contains the rows, so that there are none beside it.
template <typename Real>
struct FactoredBlock {
  const Real* u = nullptr;      ///< U from `factor`
  const Real* t = nullptr;      ///< null: there is no next block
  bool lower = false;           ///< T is zero right of its diagonal's tiles
  const Real* left = nullptr;   ///< rows z of `stride` entries
  const Real* right = nullptr;  ///< rows r of `stride` entries
  int count = 0;                ///< number of rows z and r, at most kMaxExtraRows
  int stride = 0;               ///< stride of all matrices and rows
};

/// Sets b <- U^-T b and, if there is a next block, subtracts the contribution of b from its `stride` entries n, which
/// follow b: n -= (T + sum z_r r_r^T)^T b.
template <typename Real>
void SolveForward(const FactoredBlock<Real>& block, Real* b);
/// Sets b <- U^-1 (b - (T + sum z_r r_r^T) n), where n are the entries of the next block, which follow b.
template <typename Real>
void SolveBack(const FactoredBlock<Real>& block, Real* b);

}  // namespace legopt::kernels
