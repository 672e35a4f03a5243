#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "legopt/problem/program.h"
#include "legopt/solvers/subproblem/aligned_numbers.h"

namespace legopt {

/// The convex model that an SQP iteration minimises:
///
///     m(dx) = c + g^T dx + 1/2 dx^T H dx + sum_i w_i |a_i^T dx + b_i| + sum_j w_j max(0, a_j^T dx + b_j)
///     subject to lower <= dx <= upper,
///
/// over a chain of `num_blocks` blocks of `block_size` variables. H is positive semidefinite and block tridiagonal; a
/// row touches one block or two consecutive ones. Blocks are stored padded to `stride()` = PaddedSize(block_size).
///
/// Plain data with builders; refilling it allocates nothing once it has grown. One thread.
class ConvexSubproblem {
 public:
  /// One penalised row, a^T dx + b over one block or two consecutive ones.
  struct Row {
    int block = 0;          ///< first block that it touches
    int num_blocks = 1;     ///< number of blocks that it touches, 1 or 2
    bool absolute = false;  ///< |.| instead of max(0, .)
    double weight = 0.0;    ///< > 0
    double offset = 0.0;    ///< b
    size_t begin = 0;       ///< index of its first coefficient in coefficients()
  };

  /// Creates a subproblem without costs and rows, in which all bounds are 0 until SetBounds().
  ConvexSubproblem(int num_blocks, int block_size);

  /// Removes costs and rows; keeps bounds.
  void Clear();

  /// Adds |r + J dx|^2 (Gauss-Newton) of a cost model whose first waypoint is `block`.
  void AddCost(int block, const LinearModel& model);

  /// Adds weight * sum of the penalties of a constraint model.
  void AddPenalties(int block, const LinearModel& model, TermKind kind, double weight);

  /// Sets the bounds of dx, num_blocks * block_size entries, unpadded; lower <= upper, finite.
  void SetBounds(Eigen::Ref<const Eigen::VectorXd> lower, Eigen::Ref<const Eigen::VectorXd> upper);

  /// Returns m(dx); dx unpadded.
  double Value(Eigen::Ref<const Eigen::VectorXd> dx) const;

  int num_blocks() const { return num_blocks_; }  ///< number of waypoints T
  int block_size() const { return block_size_; }  ///< variables per block: the tangent size
  int stride() const { return stride_; }          ///< doubles of a padded block, PaddedSize(block_size)
  double constant() const { return constant_; }   ///< c
  /// Largest w; 0 without penalties. Solvers divide the objective by it.
  double max_weight() const { return max_weight_; }
  const std::vector<Row>& rows() const { return rows_; }  ///< all penalties, in the order of addition
  /// Returns the coefficients of a row's k-th block, stride() doubles.
  const double* coefficients(const Row& row, int k = 0) const {
    return coefficients_.data() + row.begin + static_cast<size_t>(k) * static_cast<size_t>(stride_);
  }
  /// Returns H's diagonal block t, stride() x stride(), of which the upper triangle is set.
  const double* hessian(int t) const { return diagonal_.data() + BlockOffset(t); }
  /// Returns block (t, t + 1) of H, stride() x stride(), rows by block t; zero if no cost couples the two.
  const double* coupling(int t) const { return coupling_.data() + BlockOffset(t); }
  bool has_coupling() const { return has_coupling_; }  ///< some cost touches two blocks
  /// Returns whether diagonal block t of H is zero outside the 4 x 4 tiles along its diagonal.
  bool hessian_is_tiled(int t) const { return tiled_diagonal_[static_cast<size_t>(t)] != 0; }
  /// Returns whether block (t, t + 1) is zero outside these tiles.
  bool coupling_is_tiled(int t) const { return tiled_coupling_[static_cast<size_t>(t)] != 0; }
  /// Padded vectors, num_blocks * stride() entries.
  const AlignedDoubles& gradient() const { return gradient_; }
  const AlignedDoubles& lower() const { return lower_; }  ///< lower bounds of dx, padded
  const AlignedDoubles& upper() const { return upper_; }  ///< upper bounds of dx, padded

 private:
  int AddSparseCost(int block, const LinearModel& model);
  void AddDenseCost(int block, const LinearModel& model, int first);
  void ClearBlock(AlignedDoubles& blocks, int t, bool tiled);
  double QuadraticValue(int t, const double* x) const;
  size_t BlockOffset(int t) const {
    return static_cast<size_t>(t) * static_cast<size_t>(stride_) * static_cast<size_t>(stride_);
  }

  int num_blocks_, block_size_, stride_;
  double constant_ = 0.0;
  double max_weight_ = 0.0;
  bool has_coupling_ = false;
  AlignedDoubles diagonal_, coupling_, gradient_, lower_, upper_;
  std::vector<std::uint8_t> tiled_diagonal_, tiled_coupling_;  ///< one entry per block
  std::vector<Row> rows_;
  AlignedDoubles coefficients_;
  AlignedDoubles twos_;     ///< weights of the rows of a cost
  AlignedDoubles scratch_;  ///< scratch of the kernels
  std::vector<int> all_columns_;
  mutable AlignedDoubles padded_;
};

/// Calls visit(i, j, H_ij) with i <= j, unpadded indices, in a fixed order: all entries of the diagonal blocks' upper
/// triangles and, if `coupled`, of the off-diagonal blocks, including zeros.
template <class Visit>
void ForEachHessianEntry(const ConvexSubproblem& problem, bool coupled, Visit visit) {
  const int size = problem.block_size();
  for (int t = 0; t < problem.num_blocks(); ++t) {
    for (int i = 0; i < size; ++i) {
      for (int j = i; j < size; ++j) visit(t * size + i, t * size + j, problem.hessian(t)[i * problem.stride() + j]);
    }
    if (!coupled || t + 1 == problem.num_blocks()) continue;
    for (int i = 0; i < size; ++i) {
      for (int j = 0; j < size; ++j) {
        visit(t * size + i, (t + 1) * size + j, problem.coupling(t)[i * problem.stride() + j]);
      }
    }
  }
}

/// Solver of ConvexSubproblem. One thread; keeps its workspace between solves.
class SubproblemSolver {
 public:
  /// End of a solve.
  enum class Status {
    kSolved,          ///< the requested accuracy is reached
    kIterationLimit,  ///< limit reached, or no further progress: the point is within the bounds, not proven optimal
    kFailed           ///< non-finite numbers, or no point at all
  };

  /// Stopping criteria, in the unit of m. A solver may stop as soon as one of them holds; it may ignore all but `gap`.
  struct Accuracy {
    double gap = 0.0;         ///< maximum distance from the optimal value
    double share = 1.0;       ///< share of the largest possible decrease below m(0); 1: no criterion
    double negligible = 0.0;  ///< stop if no point can be this much below m(0); 0: no criterion
  };

  /// Result of a solve, without its point.
  struct Result {
    Status status = Status::kFailed;
    int iterations = 0;  ///< Newton steps, or Ipopt's iterations
    double gap = 0.0;    ///< bound on m(dx) - min m
  };

  virtual ~SubproblemSolver() = default;

  /// Minimises m to `accuracy`. Leaves `dx` (unpadded) within the bounds; with kIterationLimit it is the last point,
  /// with kFailed it is unusable.
  virtual Result Solve(const ConvexSubproblem& problem, const Accuracy& accuracy, Eigen::Ref<Eigen::VectorXd> dx) = 0;
};

}  // namespace legopt
