#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "legopt/dataset/dataset.h"
#include "legopt/dataset/problem_definition.h"
#include "legopt/worldgen/internal/stance_probe.h"

namespace legopt::worldgen {

/// Options of stance sampling.
struct StanceSamplerOptions {
  int count = 100;              ///< number of stances, >= 1
  std::uint64_t seed = 1;       ///< seed of all random numbers
  int max_candidates = 200000;  ///< limit of candidates
  int max_infeasible = 1000;    ///< limit of candidates without a posture while no stance is found
  int max_rejected = 20000;     ///< limit of candidates with another common cause while no stance is found
  int second_foot_tries = 12;   ///< tries per first foot
  Eigen::AlignedBox2d region;   ///< region for first feet; empty: everywhere
  int threads = 1;              ///< does not affect the result
  bool prove = true;            ///< keep only stances that have a posture; otherwise all geometrically valid ones
};

/// Numbers of candidates by outcome.
struct SamplingStatistics {
  std::int64_t candidates = 0;   ///< candidates up to and including the last accepted stance
  std::int64_t first_foot = 0;   ///< rejected: slope, support or collision of the first foot, or of any of many feet
  std::int64_t second_foot = 0;  ///< no second foot found; with more than two feet, no feet within reach of one trunk
  std::int64_t trunk = 0;        ///< trunk box in collision
  std::int64_t infeasible = 0;   ///< no posture found by SQP, or not accepted by the judge
  bool two_feet = true;          ///< the robot has two feet, which names the causes

  /// Summary of all numbers in one sentence.
  std::string Describe() const;
};

/// Result of sampling.
struct SampledStances {
  std::vector<Stance> stances;  ///< ordered by candidate
  SamplingStatistics tally;     ///< counts all candidates up to the last stance
};

/// Samples stances by the paper's procedure. First foot: a random point, uniform by area, on all surfaces that are flat
/// enough, with a uniform yaw. Second foot: random points, uniform in the disc of the reach, on a surface within the
/// step height, with a yaw within 30 degrees of the first. Rejects steep surfaces, contact patches that are not fully
/// supported, trunks in collision, and, with `prove`, stances for which SQP with restarts finds no posture that the
/// judge accepts by its literal and strict rules (the original evaluator's rule, and every listed pair).
///
/// Robots with more than two feet: see MakeLeggedCandidates (stance_candidates.h); the checks are the same.
///
/// Candidate k depends on (seed, k) only, and stances are kept in the order of k, so that the result does not depend on
/// the number of threads. `progress` (stances, wanted) is called from one thread at a time; may be empty. Throws
/// InputError with the constraint responsible (stance_refusal.h) if max_candidates do not give enough stances, or if
/// there is no stance after max_infeasible or max_rejected candidates with the same cause.
SampledStances SampleStances(const std::shared_ptr<const ProbeModel>& model, const StanceSamplerOptions& options,
                             const std::function<void(int, int)>& progress);

/// Task of a single stance.
inline constexpr Task kStanceTask = Task::kPosture;

/// Posture of a stance found by SQP from the good initial guess with up to ten restarts, and judged.
struct PostureProof {
  bool accepted = false;  ///< judged by the literal and strict rules
  Eigen::VectorXd x;      ///< posture found, accepted or not; size n + 7
  double cost = 0.0;      ///< the judge's cost; NaN if there is none
  double time_s = 0.0;    ///< wall time of the solver
  std::string failure;    ///< not accepted: first failed check and its subject, "foot_pose of l_foot"
};

/// A solver and a judge for one thread.
class PostureProver {
 public:
  /// Builds the collision model of `dataset` if necessary.
  explicit PostureProver(const std::shared_ptr<const Dataset>& dataset);
  ~PostureProver();
  /// A moved-from prover may only be destroyed.
  PostureProver(PostureProver&&) noexcept;
  /// Searches a posture. The result depends only on the stance and on `id`, the seed of the restarts.
  PostureProof Prove(const Stance& stance, int id);
  /// Name of the method in solution files.
  static const char* method_name();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Reads the stances of a solution file (solution_file.h, one stance per problem) that have a posture: the judge of
/// `dataset` accepts at least one of the solutions by the literal and the strict rule (the original evaluator's rule,
/// and every listed pair). Unique, in the order of the file. The success flags of the file are ignored.
///
/// Throws InputError: see ReadSolutions; a problem with more than one stance or without its definition; no stance left.
std::vector<Stance> ReadFeasibleStances(const std::shared_ptr<const Dataset>& dataset,
                                        const std::filesystem::path& path);

}  // namespace legopt::worldgen
