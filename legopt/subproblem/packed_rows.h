#pragma once

#include <cstddef>
#include <cstdint>
#include <tuple>
#include <vector>

#include "legopt/subproblem/aligned_numbers.h"
#include "legopt/subproblem/block_chain.h"
#include "legopt/subproblem/convex_subproblem.h"

namespace legopt {

/// The penalised rows of a ConvexSubproblem as its solver goes through them: in groups of rows with coefficients in
/// nearly the same columns, without the columns in which none of them has any. A foot's pose depends on its leg and the
/// base, twelve variables of 35 and more; a contact near that foot joins its group.
///
/// Columns are taken four at a time. Fixed variables have no columns: what they contribute is in the offsets. Rows that
/// have no columns then are left out; their penalty is a constant.
///
/// One thread; no allocation once the buffers have grown.
class PackedRows {
 public:
  /// Which variables of a problem's blocks are free, and where the others are. Padded vectors over all of its blocks.
  struct Freedom {
    const AlignedDoubles& free;   ///< 1 or 0; 0 in the pad
    const AlignedDoubles& fixed;  ///< values of fixed variables; 0 of free ones
    bool shifted = false;         ///< some of these values is not 0
    int first_block = 0;          ///< blocks before it have no free variable
    int end_block = 0;            ///< nor have this one and those behind it
  };

  /// Blocks are counted from `freedom.first_block` on.
  void Pack(const ConvexSubproblem& problem, const Freedom& freedom);

  size_t size() const { return offset_.size(); }               ///< rows, of those that are kept
  double offset(size_t i) const { return offset_[i]; }         ///< b of row i, fixed variables included
  double weight(size_t i) const { return weight_[i]; }         ///< as the problem has it, > 0
  bool absolute(size_t i) const { return absolute_[i] != 0; }  ///< |.| rather than max(0, .)
  /// Rows that touch blocks t and t + 1.
  int num_between(int t) const { return between_[static_cast<size_t>(t)]; }
  bool any_between() const { return any_between_; }  ///< of any t

  // Products, in doubles or floats: `coefficients` are those of coefficients(), rounded.

  const AlignedDoubles& coefficients() const { return coefficients_; }  ///< of A, packed
  /// product += A x.
  template <typename Real>
  void AddProducts(const Real* coefficients, const AlignedNumbers<Real>& x, AlignedNumbers<Real>& product) const;
  /// rhs += A^T c, of all of rhs those of block t alone.
  template <typename Real>
  void AddTransposed(int t, const Real* coefficients, const Real* c, AlignedNumbers<Real>& rhs) const;
  /// Upper triangle of diagonal block t of `chain` = that of H + A^T D A for D = diag(d) and the upper triangle of H,
  /// which may be the block itself. `scratch`: of this call alone.
  template <typename Real>
  void AddSquares(int t, const Real* coefficients, const Real* d, const Real* h, AlignedNumbers<Real>& scratch,
                  BlockChain<Real>& chain) const;
  /// What A^T D A has beside that block: the rows left() and right() of `chain`, which was told of num_between(t).
  template <typename Real>
  void SetCouplingRows(int t, const Real* coefficients, const Real* d, BlockChain<Real>& chain) const;

 private:
  /// The part of a group's rows within one block.
  struct Part {
    int block = 0;
    std::uint64_t support = 0;  ///< a bit for each four columns; 0: there is none
    size_t first_column = 0;    ///< in columns_
    int width = 0;              ///< entries of a packed row
    size_t begin = 0;           ///< in coefficients_
  };
  /// Rows of the same blocks, with the columns in which any of them has coefficients.
  struct Group {
    Part parts[2];
    int num_parts = 1;
    size_t begin = 0;  ///< first row
    int count = 0;
  };

  void FindGroups(const ConvexSubproblem& problem, const Freedom& freedom);
  size_t GroupOf(int block, const std::uint64_t supports[2], int num_parts);
  static int CostOfJoining(const Group& group, const std::uint64_t supports[2]);
  void PlaceGroups();
  void CopyRows(const ConvexSubproblem& problem, const Freedom& freedom);
  std::uint64_t Support(const double* coefficients, const double* free) const;
  const Part& PartIn(const Group& group, int t) const { return group.parts[group.parts[0].block == t ? 0 : 1]; }
  template <typename Real>
  void Expand(const Part& part, const Real* packed, Real weight, Real* row) const;

  int stride_ = 0, num_blocks_ = 0;
  bool any_between_ = false;
  std::vector<Group> groups_;
  std::vector<std::uint32_t> group_of_row_;           ///< by row of the problem
  std::vector<std::vector<std::uint32_t>> by_block_;  ///< groups with a part in a block
  std::vector<int> columns_;
  AlignedDoubles coefficients_, offset_, weight_;
  std::vector<std::uint8_t> absolute_;
  std::vector<int> between_;
  mutable std::tuple<AlignedDoubles, AlignedNumbers<float>> gathered_;
};

}  // namespace legopt
