#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "legopt/subproblem/aligned_doubles.h"
#include "legopt/subproblem/block_chain.h"
#include "legopt/subproblem/convex_subproblem.h"

namespace legopt {

/// The penalised rows of a ConvexSubproblem as its solver goes through them: rows with coefficients in the same columns
/// side by side, without the columns in which they have none. A foot's pose depends on its leg and the base, twelve
/// variables of 35 and more.
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

  /// product += A x.
  void AddProducts(const AlignedDoubles& x, AlignedDoubles& product) const;
  /// rhs += A^T c.
  void AddTransposed(const AlignedDoubles& c, AlignedDoubles& rhs) const;
  /// The same, of all of rhs those of block t alone.
  void AddTransposed(int t, const AlignedDoubles& c, AlignedDoubles& rhs) const;
  /// Upper triangle of diagonal block t of `chain` += that of A^T D A, D = diag(d).
  void AddSquares(int t, const AlignedDoubles& d, BlockChain& chain);
  /// What A^T D A has beside that block: the rows left() and right() of `chain`, which was told of num_between(t).
  void SetCouplingRows(int t, const AlignedDoubles& d, BlockChain& chain) const;

 private:
  /// The part of a group's rows within one block.
  struct Part {
    int block = 0;
    std::uint64_t support = 0;  ///< a bit for each four columns; 0: there is none
    size_t first_column = 0;    ///< in columns_
    int width = 0;              ///< doubles of a packed row
    size_t begin = 0;           ///< in coefficients_
  };
  /// Rows with the same blocks and columns.
  struct Group {
    Part parts[2];
    int num_parts = 1;
    size_t begin = 0;  ///< first row
    int count = 0;
  };

  void FindGroups(const ConvexSubproblem& problem, const Freedom& freedom);
  size_t GroupOf(int block, const std::uint64_t supports[2], int num_parts);
  void PlaceGroups();
  void CopyRows(const ConvexSubproblem& problem, const Freedom& freedom);
  std::uint64_t Support(const double* coefficients, const double* free) const;
  const Part& PartIn(const Group& group, int t) const { return group.parts[group.parts[0].block == t ? 0 : 1]; }
  void Expand(const Part& part, const double* packed, double weight, double* row) const;

  int stride_ = 0, num_blocks_ = 0;
  bool any_between_ = false;
  std::vector<Group> groups_;
  std::vector<std::uint32_t> group_of_row_;           ///< by row of the problem
  std::vector<std::vector<std::uint32_t>> by_block_;  ///< groups with a part in a block
  std::vector<int> columns_;
  AlignedDoubles coefficients_, offset_, weight_;
  std::vector<std::uint8_t> absolute_;
  std::vector<int> between_;
  AlignedDoubles scratch_;  ///< of the kernels
  mutable AlignedDoubles gathered_;
};

}  // namespace legopt
