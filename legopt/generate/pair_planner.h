#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <string_view>
#include <vector>

#include "legopt/generate/footstep_planner.h"

namespace legopt::generate {

/// Whether a plan stays on its floor.
enum class FloorChange {
  kSame,      ///< heights differ by at most PairOptions::same_m
  kDifferent  ///< heights differ by at least PairOptions::different_m
};
/// "same", "different".
std::string_view ToString(FloorChange change);

/// Which pairs are wanted, and how many.
struct PairOptions {
  std::uint64_t seed = 1;    ///< of the draws
  int wanted = 25;           ///< successful plans of each kind, >= 0
  int max_pairs = 400;       ///< tried before giving up
  double same_m = 0.5;       ///< stances whose heights differ by at most this share a floor
  double different_m = 1.5;  ///< and by at least this are on different ones
  int threads = 1;           ///< decides nothing
  /// Whether a plan counts, asked by thread 0 <= worker < threads; it must depend on the plan only. Empty: every one.
  std::function<bool(int, const FootstepPlan&)> counts = {};
};

/// A pair of stances and what the planner made of it; `plan.stances` is empty when it found nothing.
struct PlannedPair {
  int pair = 0;                                         ///< number of the draw
  int start = 0,                                        ///< index of the first stance
      goal = 0;                                         ///< index of the last stance
  FootstepPlan plan;                                    ///< of no use where nothing was found
  bool counts = false;                                  ///< PairOptions::counts of it; false without a plan
  bool found() const { return !plan.stances.empty(); }  ///< whether there is a plan
};

/// Draws random pairs of stances and plans between them until `wanted` plans of the kind have been found that count.
///
/// Pair k depends on (seed, kind, k) only, and pairs are tried in batches of fixed size: the result does not depend on
/// the number of threads. What is tried is kept in `state_file` (JSON, replaced after every batch) and taken from there
/// by a later call with the same arguments, of which only `wanted` may differ (one file, one PairOptions::counts).
/// `progress` (found, wanted) may be empty. Throws InputError: no such pair among the stances, or not enough plans.
std::vector<PlannedPair> PlanPairs(const std::shared_ptr<const ProbeModel>& model,
                                   const std::shared_ptr<const GuideMap>& guide, const PlannerOptions& planner_options,
                                   const std::vector<Stance>& stances, FloorChange change, const PairOptions& options,
                                   const std::filesystem::path& state_file,
                                   const std::function<void(int, int)>& progress);

}  // namespace legopt::generate
