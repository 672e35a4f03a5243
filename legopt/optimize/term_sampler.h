#pragma once

#include <cstdint>
#include <random>
#include <vector>

#include "legopt/optimize/sampling.h"
#include "legopt/program/program.h"

namespace legopt {

/// Draws the terms that an iteration looks at. What is drawn are sampling units (TermShape::unit), the paper's F_i
/// (docs/readings.md#terms-and-samples). Draws are the same on every machine and standard library. One thread.
class TermSampler {
 public:
  /// For a program and a share of its units; the batch has max(1, round(percent/100 * units)) of them.
  void Reset(const Program& program, const Sampling& sampling);

  int num_units() const { return static_cast<int>(units_.size()); }  ///< units that the program's terms make
  int batch_size() const { return batch_size_; }                     ///< units of a batch, 1 .. num_units()
  /// Iterations per pass over all units.
  int batches_per_epoch() const { return (num_units() + batch_size_ - 1) / batch_size_; }
  bool everything() const { return batch_size_ == num_units(); }  ///< every batch has all terms

  /// An independent draw without replacement (SQP). Entry i of the result: term i is in it. Valid until the next call.
  const std::vector<std::uint8_t>& Draw(std::mt19937_64& generator);

  /// The next batch of a pass through all units in shuffled order (gradient methods). Every batch is full, as the paper
  /// defines the sample size: what is left of a pass begins the next one, which fills the batch. (A batch of the
  /// remainder alone, one term of a posture's five at 80 %, would throw the line search far off.)
  const std::vector<std::uint8_t>& NextBatch(std::mt19937_64& generator);

  /// Starts a new pass with the next call of NextBatch.
  void Restart() { next_ = num_units(); }

  /// All terms.
  const std::vector<std::uint8_t>& All();

 private:
  /// Random order of the units from `first` on; the first `count` places of it.
  void Shuffle(std::mt19937_64& generator, int first, int count);
  void Mark(int begin, int end);

  std::vector<std::vector<int>> units_;  ///< terms of each unit
  std::vector<int> order_;
  std::vector<std::uint8_t> chosen_;
  int batch_size_ = 1;
  int next_ = 0;
};

}  // namespace legopt
