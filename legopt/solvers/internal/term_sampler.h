#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <random>
#include <vector>

#include "legopt/problem/program.h"
#include "legopt/solvers/solver.h"

namespace legopt {

/// One linear model per term of a program, in the order of the terms.
using TermModels = std::vector<LinearModel>;

/// Moves all models along with x by dx (num_waypoints * tangent_size). Incremental methods keep the models of terms
/// that they do not evaluate.
void ShiftModels(const Program& program, const Eigen::VectorXd& dx, TermModels& models);

/// Random selection of the terms that an iteration evaluates. It selects sampling units (TermShape::unit), the paper's
/// F_i (docs/explanation/paper.md#terms-and-samples). Selections are the same on every machine and standard library.
/// One thread.
class TermSampler {
 public:
  /// Prepares for a program and a share of its units; the batch has max(1, round(percent/100 * units)) of them.
  void Reset(const Program& program, const Sampling& sampling);

  int num_units() const { return static_cast<int>(units_.size()); }
  int batch_size() const { return batch_size_; }  ///< number of units in a batch, 1 .. num_units()
  /// Iterations per pass over all units.
  int batches_per_epoch() const { return (num_units() + batch_size_ - 1) / batch_size_; }
  bool everything() const { return batch_size_ == num_units(); }  ///< every batch contains all terms

  /// Returns an independent sample without replacement (SQP): entry i is nonzero if term i is included. Valid until the
  /// next call.
  const std::vector<std::uint8_t>& Draw(std::mt19937_64& generator);

  /// Returns the next batch of a pass through all units in shuffled order (gradient methods). Every batch is full, as
  /// the paper defines the sample size: the remainder of a pass starts the next batch, which units of the next pass
  /// fill. (A batch of the remainder alone, one of a posture's five terms at 80 %, would mislead the line search.)
  const std::vector<std::uint8_t>& NextBatch(std::mt19937_64& generator);

  /// Starts a new pass with the next call of NextBatch.
  void Restart() { next_ = num_units(); }

  /// Selects all terms.
  const std::vector<std::uint8_t>& All();

 private:
  /// Fills the `count` places from `first` on with random units of those from `first` on.
  void Shuffle(std::mt19937_64& generator, int first, int count);
  void Mark(int begin, int end);

  std::vector<std::vector<int>> units_;  ///< indices of the terms of each unit
  std::vector<int> order_;
  std::vector<std::uint8_t> chosen_;
  int batch_size_ = 1;
  int next_ = 0;
};

}  // namespace legopt
