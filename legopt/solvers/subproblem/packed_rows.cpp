#include "legopt/solvers/subproblem/packed_rows.h"

#include <algorithm>
#include <bit>
#include <span>
#include <tuple>

#include "legopt/solvers/subproblem/block_kernels.h"
#include "legopt/solvers/subproblem/dense_kernels.h"

namespace legopt {
namespace {

constexpr int kFour = kernels::kLanes;

constexpr std::uint32_t kLeftOut = UINT32_MAX;
constexpr int kMaxBits = 64;  // longer rows are stored whole
/// Above this share of all columns, packing saves less than one long row gains.
constexpr double kWholeShare = 0.7;

/// Returns the cycles for a row's squares: two vectors of four are multiplied and added per cycle, at least four
/// cycles.
int CostOfRow(std::uint64_t support) {
  const int vectors = std::popcount(support);
  return vectors < 2 ? 4 * vectors : vectors * (vectors + 1) + 2;
}
constexpr int kGroupCost = 200;  // cycles for the squares of a group, in addition to those of its rows

}  // namespace

void PackedRows::Pack(const ConvexSubproblem& problem, const FreeVariables& freedom) {
  stride_ = problem.stride();
  num_blocks_ = freedom.end_block - freedom.first_block;
  FindGroups(problem, freedom);
  PlaceGroups();
  CopyRows(problem, freedom);
}

std::uint64_t PackedRows::Support(const double* coefficients, const double* free) const {
  const int vectors = stride_ / kFour;
  const std::uint64_t whole = vectors >= kMaxBits ? ~std::uint64_t{0} : (std::uint64_t{1} << vectors) - 1;
  std::uint64_t support = 0;
  for (int v = 0; v < std::min(vectors, kMaxBits); ++v) {
    const std::ptrdiff_t column = std::ptrdiff_t{v} * kFour;
    const unsigned here = kernels::NonZeros(kernels::Load(coefficients + column));
    const bool any = here != 0 && (here & kernels::NonZeros(kernels::Load(free + column))) != 0;
    support |= std::uint64_t{any} << v;
  }
  if (vectors > kMaxBits) return whole;
  return std::popcount(support) > kWholeShare * vectors ? whole : support;
}

void PackedRows::FindGroups(const ConvexSubproblem& problem, const FreeVariables& freedom) {
  groups_.clear();
  by_block_.resize(std::max(by_block_.size(), static_cast<size_t>(num_blocks_)));
  for (auto& groups : by_block_) groups.clear();
  group_of_row_.clear();
  for (const ConvexSubproblem::Row& row : problem.rows()) {
    std::uint64_t supports[2] = {};
    int block = 0, num_parts = 0;
    for (int k = 0; k < row.num_blocks; ++k) {
      const int t = row.block + k;
      if (t < freedom.first_block || t >= freedom.end_block) continue;
      const double* free = freedom.free.data() + static_cast<std::ptrdiff_t>(t) * stride_;
      const std::uint64_t support = Support(problem.coefficients(row, k), free);
      if (support == 0) continue;
      if (num_parts == 0) block = t - freedom.first_block;
      supports[num_parts++] = support;
    }
    group_of_row_.push_back(num_parts == 0 ? kLeftOut
                                           : static_cast<std::uint32_t>(GroupOf(block, supports, num_parts)));
  }
}

/// Returns the group that a row joins: one with the same columns, or one to which its columns are added if that is
/// cheaper than another group. Creates a group if there is none.
size_t PackedRows::GroupOf(int block, const std::uint64_t supports[2], int num_parts) {
  size_t cheapest = groups_.size();
  int least = kGroupCost;
  for (const std::uint32_t g : by_block_[static_cast<size_t>(block)]) {
    const Group& group = groups_[g];
    if (group.parts[0].block != block || group.num_parts != num_parts) continue;
    const int more = CostOfJoining(group, supports);
    if (more >= least) continue;
    least = more;
    cheapest = g;
  }
  if (cheapest == groups_.size()) {
    Group group;
    group.num_parts = num_parts;
    for (int k = 0; k < num_parts; ++k) {
      group.parts[k].block = block + k;
      by_block_[static_cast<size_t>(block + k)].push_back(static_cast<std::uint32_t>(cheapest));
    }
    groups_.push_back(group);
  }
  Group& group = groups_[cheapest];
  for (int k = 0; k < num_parts; ++k) group.parts[k].support |= supports[k];
  ++group.count;
  return cheapest;
}

int PackedRows::CostOfJoining(const Group& group, const std::uint64_t supports[2]) {
  int more = 0;
  for (int k = 0; k < group.num_parts; ++k) {
    const std::uint64_t before = group.parts[k].support, after = before | supports[k];
    more += (group.count + 1) * CostOfRow(after) - group.count * CostOfRow(before) - CostOfRow(supports[k]);
  }
  return more;
}

void PackedRows::PlaceGroups() {
  columns_.clear();
  between_.assign(static_cast<size_t>(num_blocks_), 0);
  any_between_ = false;
  size_t rows = 0, coefficients = 0;
  for (Group& group : groups_) {
    group.begin = rows;
    rows += static_cast<size_t>(group.count);
    if (group.num_parts > 1) {
      between_[static_cast<size_t>(group.parts[0].block)] += group.count;
      any_between_ = true;
    }
    for (int k = 0; k < group.num_parts; ++k) {
      Part& part = group.parts[k];
      part.first_column = columns_.size();
      for (int column = 0; column < stride_; column += kFour) {
        const bool whole = stride_ / kFour > kMaxBits;
        if (whole || (part.support >> (column / kFour) & 1) != 0) columns_.push_back(column);
      }
      part.width = static_cast<int>(columns_.size() - part.first_column) * kFour;
      part.begin = coefficients;
      coefficients += static_cast<size_t>(part.width) * static_cast<size_t>(group.count);
    }
    group.count = 0;  // counts the copied rows from here on
  }
  offset_.resize(rows);
  weight_.resize(rows);
  absolute_.resize(rows);
  coefficients_.resize(coefficients);
}

void PackedRows::CopyRows(const ConvexSubproblem& problem, const FreeVariables& freedom) {
  for (size_t i = 0; i < group_of_row_.size(); ++i) {
    if (group_of_row_[i] == kLeftOut) continue;
    const ConvexSubproblem::Row& row = problem.rows()[i];
    Group& group = groups_[group_of_row_[i]];
    const size_t place = group.begin + static_cast<size_t>(group.count);
    double offset = row.offset;
    for (int k = 0; k < row.num_blocks; ++k) {
      const std::ptrdiff_t begin = static_cast<std::ptrdiff_t>(row.block + k) * stride_;
      const double* const from = problem.coefficients(row, k);
      if (freedom.shifted) offset += kernels::Dot(from, freedom.fixed.data() + begin, stride_);
      const int block = row.block + k - freedom.first_block;
      const Part* part = nullptr;
      for (int p = 0; p < group.num_parts; ++p) {
        if (group.parts[p].block == block) part = &group.parts[p];
      }
      if (part == nullptr) continue;
      const double* const free = freedom.free.data() + begin;
      double* to = coefficients_.data() + part->begin + static_cast<std::ptrdiff_t>(group.count) * part->width;
      for (int v = 0; v < part->width / kFour; ++v, to += kFour) {
        const int column = columns_[part->first_column + static_cast<size_t>(v)];
        kernels::Store(to, kernels::Load(from + column) * kernels::Load(free + column));
      }
    }
    ++group.count;
    offset_[place] = offset;
    weight_[place] = row.weight;
    absolute_[place] = row.absolute ? 1 : 0;
  }
}

template <typename Real>
void PackedRows::AddProducts(const Real* coefficients, const AlignedNumbers<Real>& x,
                             AlignedNumbers<Real>& product) const {
  auto& gathered = std::get<AlignedNumbers<Real>>(gathered_);
  gathered.resize(static_cast<size_t>(stride_));
  for (const Group& group : groups_) {
    for (const Part& part : std::span(group.parts, static_cast<size_t>(group.num_parts))) {
      const Real* const block = x.data() + static_cast<std::ptrdiff_t>(part.block) * stride_;
      const Real* packed = block;
      if (part.width < stride_) {
        for (int v = 0; v < part.width / kFour; ++v) {
          kernels::Store(gathered.data() + static_cast<std::ptrdiff_t>(v) * kFour,
                         kernels::Load(block + columns_[part.first_column + static_cast<size_t>(v)]));
        }
        packed = gathered.data();
      }
      kernels::AddProducts(coefficients + part.begin, part.width, group.count, packed, product.data() + group.begin,
                           part.width);
    }
  }
}

template <typename Real>
void PackedRows::AddTransposed(int t, const Real* coefficients, const Real* c, AlignedNumbers<Real>& rhs) const {
  Real* const block = rhs.data() + static_cast<std::ptrdiff_t>(t) * stride_;
  for (const std::uint32_t g : by_block_[static_cast<size_t>(t)]) {
    const Group& group = groups_[g];
    const Part& part = PartIn(group, t);
    const Real* const rows = coefficients + part.begin;
    if (part.width == stride_) {
      kernels::AddCombination(c + group.begin, rows, part.width, group.count, block, part.width);
      continue;
    }
    for (int v = 0; v < part.width / kFour; ++v) {
      Real* const to = block + columns_[part.first_column + static_cast<size_t>(v)];
      const Real* row = rows + static_cast<std::ptrdiff_t>(v) * kFour;
      auto sum = kernels::Load(to);
      for (size_t i = group.begin; i < group.begin + static_cast<size_t>(group.count); ++i, row += part.width) {
        sum = kernels::MulAdd(kernels::Broadcast(c[i]), kernels::Load(row), sum);
      }
      kernels::Store(to, sum);
    }
  }
}

template <typename Real>
void PackedRows::AddSquares(int t, const Real* coefficients, const Real* d, const Real* h,
                            AlignedNumbers<Real>& scratch, BlockChain<Real>& chain) const {
  using Squares = kernels::PackedSquares<Real>;
  kernels::WeightedRows<Real> runs[Squares::kMaxRuns];
  const std::vector<std::uint32_t>& groups = by_block_[static_cast<size_t>(t)];
  Real* const block = chain.block(t);
  if (h != block && (groups.empty() || PartIn(groups_[groups[0]], t).width < stride_)) {
    kernels::CopyUpper(h, block, stride_);
    h = block;
  }
  for (size_t g = 0; g < groups.size();) {
    const Part& part = PartIn(groups_[groups[g]], t);
    size_t num_runs = 0, num_rows = 0;
    for (; g < groups.size() && num_runs < Squares::kMaxRuns; ++g) {  // neighbours with the same columns at once
      const Group& group = groups_[groups[g]];
      const Part& next = PartIn(group, t);
      if (next.support != part.support) break;
      runs[num_runs++] = {coefficients + next.begin, d + group.begin, group.count};
      num_rows += static_cast<size_t>(group.count);
    }
    if (scratch.size() < Squares::kScratch * num_rows) scratch.resize(Squares::kScratch * num_rows);
    const std::span<const int> columns(columns_.data() + part.first_column, static_cast<size_t>(part.width / kFour));
    kernels::ChosenKernels<Real>().add_squares({{runs, num_runs}, columns, scratch.data()}, h, block, stride_);
    h = block;
  }
}

/// Sets `row` to a packed row times `weight`, with all columns.
template <typename Real>
void PackedRows::Expand(const Part& part, const Real* packed, Real weight, Real* row) const {
  std::fill_n(row, stride_, Real{0});
  for (int v = 0; v < part.width / kFour; ++v) {
    kernels::Store(row + columns_[part.first_column + static_cast<size_t>(v)],
                   kernels::Broadcast(weight) * kernels::Load(packed + static_cast<std::ptrdiff_t>(v) * kFour));
  }
}

template <typename Real>
void PackedRows::SetCouplingRows(int t, const Real* coefficients, const Real* d, BlockChain<Real>& chain) const {
  if (num_between(t) == 0) return;
  int row = 0;
  for (const std::uint32_t g : by_block_[static_cast<size_t>(t)]) {
    const Group& group = groups_[g];
    if (group.num_parts == 1 || group.parts[0].block != t) continue;
    const Real* left = coefficients + group.parts[0].begin;
    const Real* right = coefficients + group.parts[1].begin;
    for (size_t i = group.begin; i < group.begin + static_cast<size_t>(group.count); ++i, ++row) {
      Expand(group.parts[0], left, d[i], chain.left(t, row));
      Expand(group.parts[1], right, Real{1}, chain.right(t, row));
      left += group.parts[0].width;
      right += group.parts[1].width;
    }
  }
}

template void PackedRows::AddProducts(const double* coefficients, const AlignedDoubles& x,
                                      AlignedDoubles& product) const;
template void PackedRows::AddProducts(const float* coefficients, const AlignedNumbers<float>& x,
                                      AlignedNumbers<float>& product) const;
template void PackedRows::AddTransposed(int t, const double* coefficients, const double* c, AlignedDoubles& rhs) const;
template void PackedRows::AddTransposed(int t, const float* coefficients, const float* c,
                                        AlignedNumbers<float>& rhs) const;
template void PackedRows::AddSquares(int t, const double* coefficients, const double* d, const double* h,
                                     AlignedDoubles& scratch, BlockChain<double>& chain) const;
template void PackedRows::AddSquares(int t, const float* coefficients, const float* d, const float* h,
                                     AlignedNumbers<float>& scratch, BlockChain<float>& chain) const;
template void PackedRows::SetCouplingRows(int t, const double* coefficients, const double* d,
                                          BlockChain<double>& chain) const;
template void PackedRows::SetCouplingRows(int t, const float* coefficients, const float* d,
                                          BlockChain<float>& chain) const;

}  // namespace legopt
