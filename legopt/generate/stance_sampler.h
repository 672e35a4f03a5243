#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "legopt/generate/stance_probe.h"

namespace legopt::generate {

/// How many stances, from where, and how hard to try.
struct StanceSamplerOptions {
  int count = 100;              ///< stances wanted, >= 1
  std::uint64_t seed = 1;       ///< of every draw
  int max_candidates = 200000;  ///< before giving up
  int second_foot_tries = 12;   ///< per first foot
  Eigen::AlignedBox2d region;   ///< where first feet may stand; empty: everywhere
  int threads = 1;              ///< decides nothing
  bool prove = true;            ///< keep only stances that have a posture; otherwise all that geometry allows
};

/// How many candidates ended where.
struct StanceTally {
  std::int64_t candidates = 0;   ///< first feet drawn, up to and including that of the last stance kept
  std::int64_t first_foot = 0;   ///< rejected: slope, support or collision of the first foot
  std::int64_t second_foot = 0;  ///< no second foot found
  std::int64_t trunk = 0;        ///< trunk box in collision
  std::int64_t infeasible = 0;   ///< no posture found by SQP, or not accepted by the judge

  /// All figures in a sentence.
  std::string Describe() const;
};

/// What sampling gave.
struct SampledStances {
  std::vector<Stance> stances;  ///< in the order of their candidates
  StanceTally tally;            ///< of all candidates up to the last stance
};

/// Samples stances by the paper's procedure: a point uniform by area on all surfaces that are flat enough and a uniform
/// yaw for the first foot; for the second one points uniform in the disc of the reach, on a surface within the step
/// height, yaw within 30 degrees of the first; rejected are slopes, soles that do not rest whole, trunks in collision,
/// and, with `prove`, stances for which SQP with restarts finds no posture that the judge accepts (literal and strict
/// rule).
///
/// Candidate k depends on (seed, k) only, and stances are kept in the order of k: the result does not depend on the
/// number of threads. `progress` (stances, wanted) is called from one thread at a time; may be empty. Throws InputError
/// with the tally when max_candidates do not give enough.
SampledStances SampleStances(const std::shared_ptr<const ProbeModel>& model, const StanceSamplerOptions& options,
                             const std::function<void(int, int)>& progress);

/// What a stance by itself is a problem of.
inline constexpr Task kStanceTask = Task::kPosture;

/// Posture of a stance: SQP from the good start with up to ten restarts, judged.
struct PostureProof {
  bool accepted = false;  ///< by the literal and the strict rule
  Eigen::VectorXd x;      ///< n + 7; of the posture found, accepted or not
  double cost = 0.0;      ///< by the judge; NaN where it gives none
  double time_s = 0.0;    ///< wall time of the solve
};

/// A solver and a judge for one thread.
class PostureProver {
 public:
  /// Builds the collision model of `dataset` when nobody has yet.
  explicit PostureProver(const std::shared_ptr<const Dataset>& dataset);
  ~PostureProver();
  /// What is moved from may only be destroyed.
  PostureProver(PostureProver&&) noexcept;
  /// Depends on the stance and `id` (restarts draw from it) only.
  PostureProof Prove(const Stance& stance, int id);
  /// Name of the method in solution files.
  static const char* method_name();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace legopt::generate
