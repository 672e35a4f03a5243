#pragma once

#include <cstddef>
#include <cstdint>
#include <tuple>
#include <vector>

#include "legopt/solvers/subproblem/aligned_numbers.h"
#include "legopt/solvers/subproblem/block_chain.h"
#include "legopt/solvers/subproblem/convex_subproblem.h"

namespace legopt {

/// The penalised rows of a ConvexSubproblem, in groups of rows with coefficients in nearly the same columns. Columns in
/// which no row of a group has coefficients are left out. For example, a foot's pose depends on its leg and the base,
/// twelve variables of 35 or more; a contact near that foot joins its group.
///
/// Columns are taken four at a time. Fixed variables have no columns: the offsets include their contribution. Rows
/// without any column are left out; their penalty is constant.
///
/// One thread; no allocation once the buffers have grown.
class PackedRows {
 public:
  /// Free variables of a problem's blocks, and values of the fixed ones. Padded vectors over all blocks.
  struct FreeVariables {
    const AlignedDoubles& free;   ///< 1 for free variables, else 0; 0 in the padding
    const AlignedDoubles& fixed;  ///< values of fixed variables; 0 of free ones
    bool shifted = false;         ///< some of these values are not 0
    int first_block = 0;          ///< blocks before it have no free variable
    int end_block = 0;            ///< nor do this block and those after it
  };

  /// Packs the rows; block 0 is `freedom.first_block`.
  void Pack(const ConvexSubproblem& problem, const FreeVariables& freedom);

  size_t size() const { return offset_.size(); }               ///< number of rows that are kept
  double offset(size_t i) const { return offset_[i]; }         ///< b of row i, including fixed variables
  double weight(size_t i) const { return weight_[i]; }         ///< weight in the problem, > 0
  bool absolute(size_t i) const { return absolute_[i] != 0; }  ///< |.| instead of max(0, .)
  /// Returns the number of rows that touch blocks t and t + 1.
  int num_between(int t) const { return between_[static_cast<size_t>(t)]; }
  bool any_between() const { return any_between_; }  ///< num_between(t) > 0 for some t

  // Products, in doubles or floats. `coefficients` is coefficients(), rounded to Real.

  const AlignedDoubles& coefficients() const { return coefficients_; }  ///< coefficients of A, packed
  /// Adds A x to `product`.
  template <typename Real>
  void AddProducts(const Real* coefficients, const AlignedNumbers<Real>& x, AlignedNumbers<Real>& product) const;
  /// Adds A^T c to `rhs`, only in the entries of block t.
  template <typename Real>
  void AddTransposed(int t, const Real* coefficients, const Real* c, AlignedNumbers<Real>& rhs) const;
  /// Sets the upper triangle of diagonal block t of `chain` to that of H + A^T D A, for D = diag(d) and the upper
  /// triangle of H, which may be the block itself. `scratch` is used by this call only.
  template <typename Real>
  void AddSquares(int t, const Real* coefficients, const Real* d, const Real* h, AlignedNumbers<Real>& scratch,
                  BlockChain<Real>& chain) const;
  /// Sets the off-diagonal part of A^T D A after block t: the rows left() and right() of `chain`, whose coupling must
  /// have been set with num_between(t) rows.
  template <typename Real>
  void SetCouplingRows(int t, const Real* coefficients, const Real* d, BlockChain<Real>& chain) const;

 private:
  /// The part of a group's rows within one block.
  struct Part {
    int block = 0;
    std::uint64_t support = 0;  ///< one bit per four columns; 0: none
    size_t first_column = 0;    ///< index in columns_
    int width = 0;              ///< number of entries of a packed row
    size_t begin = 0;           ///< index in coefficients_
  };
  /// Rows of the same blocks, with all columns in which any of them has coefficients.
  struct Group {
    Part parts[2];
    int num_parts = 1;
    size_t begin = 0;  ///< first row
    int count = 0;
  };

  void FindGroups(const ConvexSubproblem& problem, const FreeVariables& freedom);
  size_t GroupOf(int block, const std::uint64_t supports[2], int num_parts);
  static int CostOfJoining(const Group& group, const std::uint64_t supports[2]);
  void PlaceGroups();
  void CopyRows(const ConvexSubproblem& problem, const FreeVariables& freedom);
  std::uint64_t Support(const double* coefficients, const double* free) const;
  const Part& PartIn(const Group& group, int t) const { return group.parts[group.parts[0].block == t ? 0 : 1]; }
  template <typename Real>
  void Expand(const Part& part, const Real* packed, Real weight, Real* row) const;

  int stride_ = 0, num_blocks_ = 0;
  bool any_between_ = false;
  std::vector<Group> groups_;
  std::vector<std::uint32_t> group_of_row_;           ///< one entry per row of the problem
  std::vector<std::vector<std::uint32_t>> by_block_;  ///< groups with a part in each block
  std::vector<int> columns_;
  AlignedDoubles coefficients_, offset_, weight_;
  std::vector<std::uint8_t> absolute_;
  std::vector<int> between_;
  mutable std::tuple<AlignedDoubles, AlignedNumbers<float>> gathered_;
};

}  // namespace legopt
