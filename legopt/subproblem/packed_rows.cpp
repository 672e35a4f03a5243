#include "legopt/subproblem/packed_rows.h"

#include <algorithm>
#include <bit>
#include <span>

#include "legopt/subproblem/block_kernels.h"
#include "legopt/subproblem/dense_kernels.h"

namespace legopt {
namespace {

constexpr int kFour = kernels::kLanes;

constexpr std::uint32_t kLeftOut = UINT32_MAX;
constexpr int kMostBits = 64;  // a longer row is taken as a whole
/// Beyond this share of all columns, packing saves less than one long row gains.
constexpr double kWholeShare = 0.7;

}  // namespace

void PackedRows::Pack(const ConvexSubproblem& problem, const Freedom& freedom) {
  stride_ = problem.stride();
  num_blocks_ = freedom.end_block - freedom.first_block;
  FindGroups(problem, freedom);
  PlaceGroups();
  CopyRows(problem, freedom);
}

std::uint64_t PackedRows::Support(const double* coefficients, const double* free) const {
  const int vectors = stride_ / kFour;
  const std::uint64_t whole = vectors >= kMostBits ? ~std::uint64_t{0} : (std::uint64_t{1} << vectors) - 1;
  std::uint64_t support = 0;
  for (int v = 0; v < std::min(vectors, kMostBits); ++v) {
    const std::ptrdiff_t column = std::ptrdiff_t{v} * kFour;
    const unsigned here = kernels::NonZeros(kernels::Load(coefficients + column));
    const bool any = here != 0 && (here & kernels::NonZeros(kernels::Load(free + column))) != 0;
    support |= std::uint64_t{any} << v;
  }
  if (vectors > kMostBits) return whole;
  return std::popcount(support) > kWholeShare * vectors ? whole : support;
}

void PackedRows::FindGroups(const ConvexSubproblem& problem, const Freedom& freedom) {
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

/// Counts one row more of the group, which is made if there is none.
size_t PackedRows::GroupOf(int block, const std::uint64_t supports[2], int num_parts) {
  for (const std::uint32_t g : by_block_[static_cast<size_t>(block)]) {
    Group& group = groups_[g];
    if (group.parts[0].block != block || group.num_parts != num_parts) continue;
    if (group.parts[0].support != supports[0] || group.parts[1].support != supports[1]) continue;
    ++group.count;
    return g;
  }
  Group group;
  group.num_parts = num_parts;
  group.count = 1;
  for (int k = 0; k < num_parts; ++k) {
    group.parts[k].block = block + k;
    group.parts[k].support = supports[k];
    by_block_[static_cast<size_t>(block + k)].push_back(static_cast<std::uint32_t>(groups_.size()));
  }
  groups_.push_back(group);
  return groups_.size() - 1;
}

void PackedRows::PlaceGroups() {
  columns_.clear();
  between_.assign(static_cast<size_t>(num_blocks_), 0);
  any_between_ = false;
  size_t rows = 0, coefficients = 0, most_rows = 0;
  for (Group& group : groups_) {
    group.begin = rows;
    rows += static_cast<size_t>(group.count);
    most_rows = std::max(most_rows, static_cast<size_t>(group.count));
    if (group.num_parts > 1) {
      between_[static_cast<size_t>(group.parts[0].block)] += group.count;
      any_between_ = true;
    }
    for (int k = 0; k < group.num_parts; ++k) {
      Part& part = group.parts[k];
      part.first_column = columns_.size();
      for (int column = 0; column < stride_; column += kFour) {
        const bool whole = stride_ / kFour > kMostBits;
        if (whole || (part.support >> (column / kFour) & 1) != 0) columns_.push_back(column);
      }
      part.width = static_cast<int>(columns_.size() - part.first_column) * kFour;
      part.begin = coefficients;
      coefficients += static_cast<size_t>(part.width) * static_cast<size_t>(group.count);
    }
    group.count = 0;  // of those that have been copied
  }
  offset_.resize(rows);
  weight_.resize(rows);
  absolute_.resize(rows);
  if (coefficients_.size() < coefficients) coefficients_.resize(coefficients);
  gathered_.resize(static_cast<size_t>(stride_));
  if (scratch_.size() < kFour * most_rows) scratch_.resize(kFour * most_rows);
}

void PackedRows::CopyRows(const ConvexSubproblem& problem, const Freedom& freedom) {
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

void PackedRows::AddProducts(const AlignedDoubles& x, AlignedDoubles& product) const {
  for (const Group& group : groups_) {
    for (const Part& part : std::span(group.parts, static_cast<size_t>(group.num_parts))) {
      const double* const block = x.data() + static_cast<std::ptrdiff_t>(part.block) * stride_;
      const double* packed = block;
      if (part.width < stride_) {
        for (int v = 0; v < part.width / kFour; ++v) {
          kernels::Store(gathered_.data() + static_cast<std::ptrdiff_t>(v) * kFour,
                         kernels::Load(block + columns_[part.first_column + static_cast<size_t>(v)]));
        }
        packed = gathered_.data();
      }
      kernels::AddProducts(coefficients_.data() + part.begin, part.width, group.count, packed,
                           product.data() + group.begin, part.width);
    }
  }
}

void PackedRows::AddTransposed(const AlignedDoubles& c, AlignedDoubles& rhs) const {
  for (int t = 0; t < num_blocks_; ++t) AddTransposed(t, c, rhs);
}

void PackedRows::AddTransposed(int t, const AlignedDoubles& c, AlignedDoubles& rhs) const {
  double* const block = rhs.data() + static_cast<std::ptrdiff_t>(t) * stride_;
  for (const std::uint32_t g : by_block_[static_cast<size_t>(t)]) {
    const Group& group = groups_[g];
    const Part& part = PartIn(group, t);
    const double* const rows = coefficients_.data() + part.begin;
    if (part.width == stride_) {
      kernels::AddCombination(c.data() + group.begin, rows, part.width, group.count, block, part.width);
      continue;
    }
    for (int v = 0; v < part.width / kFour; ++v) {
      double* const to = block + columns_[part.first_column + static_cast<size_t>(v)];
      const double* row = rows + static_cast<std::ptrdiff_t>(v) * kFour;
      kernels::Lanes sum = kernels::Load(to);
      for (size_t i = group.begin; i < group.begin + static_cast<size_t>(group.count); ++i, row += part.width) {
        sum = kernels::MulAdd(kernels::Broadcast(c[i]), kernels::Load(row), sum);
      }
      kernels::Store(to, sum);
    }
  }
}

void PackedRows::AddSquares(int t, const AlignedDoubles& d, BlockChain& chain) {
  for (const std::uint32_t g : by_block_[static_cast<size_t>(t)]) {
    const Group& group = groups_[g];
    const Part& part = PartIn(group, t);
    const std::span<const int> columns(columns_.data() + part.first_column, static_cast<size_t>(part.width / kFour));
    kernels::ChosenKernels().add_squares(
        {coefficients_.data() + part.begin, d.data() + group.begin, group.count, columns, scratch_.data()},
        chain.block(t), stride_);
  }
}

/// A packed row times `weight`, with all of its columns.
void PackedRows::Expand(const Part& part, const double* packed, double weight, double* row) const {
  std::fill_n(row, stride_, 0.0);
  for (int v = 0; v < part.width / kFour; ++v) {
    kernels::Store(row + columns_[part.first_column + static_cast<size_t>(v)],
                   kernels::Broadcast(weight) * kernels::Load(packed + static_cast<std::ptrdiff_t>(v) * kFour));
  }
}

void PackedRows::SetCouplingRows(int t, const AlignedDoubles& d, BlockChain& chain) const {
  if (num_between(t) == 0) return;
  int row = 0;
  for (const std::uint32_t g : by_block_[static_cast<size_t>(t)]) {
    const Group& group = groups_[g];
    if (group.num_parts == 1 || group.parts[0].block != t) continue;
    const double* left = coefficients_.data() + group.parts[0].begin;
    const double* right = coefficients_.data() + group.parts[1].begin;
    for (size_t i = group.begin; i < group.begin + static_cast<size_t>(group.count); ++i, ++row) {
      Expand(group.parts[0], left, d[i], chain.left(t, row));
      Expand(group.parts[1], right, 1.0, chain.right(t, row));
      left += group.parts[0].width;
      right += group.parts[1].width;
    }
  }
}

}  // namespace legopt
