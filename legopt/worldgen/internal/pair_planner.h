#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <string_view>
#include <vector>

#include "legopt/worldgen/internal/footstep_planner.h"

namespace legopt::worldgen {

/// Kind of a plan: does it change the floor?
enum class FloorChange {
  kSame,      ///< heights of start and goal differ by at most PairOptions::same_m
  kDifferent  ///< heights of start and goal differ by at least PairOptions::different_m
};
/// Returns "same" or "different".
std::string_view ToString(FloorChange change);

/// Options of pair planning.
struct PairOptions {
  std::uint64_t seed = 1;    ///< seed of the random pairs
  int wanted = 25;           ///< number of accepted plans, >= 0
  int max_pairs = 400;       ///< limit of pairs to try
  double same_m = 0.5;       ///< maximum height difference of stances on one floor
  double different_m = 1.5;  ///< minimum height difference of stances on different floors
  int threads = 1;           ///< does not affect the result
  /// Predicate for accepting a plan, called by thread 0 <= worker < threads. It must depend on the plan only. Empty:
  /// all plans are accepted.
  std::function<bool(int, const FootstepPlan&)> counts = {};
};

/// A pair of stances with its plan.
struct PlannedPair {
  int pair = 0;         ///< number of the random pair
  int start = 0,        ///< index of the first stance
      goal = 0;         ///< index of the last stance
  FootstepPlan plan;    ///< `plan.stances` is empty if no plan was found
  bool counts = false;  ///< accepted by PairOptions::counts; false without a plan
  bool found() const { return !plan.stances.empty(); }
};

/// Returns whether two of the stances are such a pair.
bool HasPair(const std::vector<Stance>& stances, FloorChange change, const PairOptions& options);

/// Draws random pairs of stances of the given kind and plans between them until `wanted` plans are accepted.
///
/// Pair k depends on (seed, kind, k) only, and pairs are tried in batches of fixed size, so that the result does not
/// depend on the number of threads. Results are stored in `state_file` (JSON, replaced after every batch) and reused by
/// later calls, whose arguments must be the same except for `wanted` (one file per PairOptions::counts). `progress`
/// (found, wanted) may be empty. Throws InputError: no such pair among the stances, or not enough plans.
std::vector<PlannedPair> PlanPairs(const std::shared_ptr<const ProbeModel>& model,
                                   const std::shared_ptr<const GuideMap>& guide, const PlannerOptions& planner_options,
                                   const std::vector<Stance>& stances, FloorChange change, const PairOptions& options,
                                   const std::filesystem::path& state_file,
                                   const std::function<void(int, int)>& progress);

}  // namespace legopt::worldgen
