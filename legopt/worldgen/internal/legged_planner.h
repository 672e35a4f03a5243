#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "legopt/worldgen/internal/footstep_planner.h"
#include "legopt/worldgen/internal/gait.h"

namespace legopt::worldgen {

/// Action set and effort limits of the planner for more than two feet. Lengths are shares of the stride,
/// ReachCloud::stride_m; all combinations with at most one of sideways and turn are actions.
struct LeggedActions {
  std::vector<double> forward = {1.0, 0.5, 0.0, -0.5};  ///< movement of the feet's nominal places along the heading
  std::vector<double> sideways = {0.7, -0.7};           ///< movement to the left
  std::vector<double> turn_rad = {0.3, -0.3};           ///< rotation to the left
  double grid = 0.25;                                   ///< spacing of the grid of contacts
  double least_grid_m = 0.02;                           ///< minimum spacing
  int headings = 36;                                    ///< number of headings of soles on the grid
  int starts = 3;                                       ///< initial guesses for a posture of each state of a plan
  int searches = 12;                                    ///< searches until all states of a plan have a posture
  std::int64_t max_expansions = 3000;                   ///< limit until the first solution
  std::int64_t extra_expansions = 300;                  ///< additional limit after the first solution
};

/// Plans contacts of robots with more than two feet by ARA* (AnytimeSearch).
///
/// State: the footholds of all contacts, and the last phase. Action: one phase of a gait (GaitsOf). Its contacts move
/// to their nominal places relative to a trunk that is moved and turned by an action, rounded to the grid, or to the
/// nearest valid neighbour on the grid. Phases follow the cycle of their gait, if it has one; another gait may begin
/// after any phase. Walk is tried only where no other gait gets nearer to the goal. The goal's exact contacts are
/// additional actions.
///
/// An action is allowed if all contacts are in reach of the trunk over them (ReachCloud), those that stand also during
/// the phase, if the centre of mass is then at most a stride outside of their support polygon, if the feet are no
/// farther apart than the reach and a step's height, and if the trunk box is free. Cost: 1 per
/// phase plus terms for height and rotation.
///
/// All states of a plan must have a posture, and so must the contacts that stand during each phase: states for which
/// the certifier finds none are excluded, and the search is repeated. After `searches` of these, a last search only
/// expands states with postures.
///
/// Heuristic: the weighted distance of GuideMap from the middle of the feet, divided by the progress of a phase, plus
/// the missing rotation. Bound: see FootstepPlanner; no action moves the middle of the feet by more than
/// kMostProgress strides.
///
/// Not thread-safe. Contacts and postures are cached for later plans; the cache does not affect results.
class LeggedPlanner {
 public:
  static constexpr double kMostProgress = 2.5;  ///< maximum progress of a phase, in strides

  /// Model and map are shared by all planners. `costs`: costs, and inflation of the heuristic; its
  /// action set and effort limits are not used.
  LeggedPlanner(std::shared_ptr<const ProbeModel> model, std::shared_ptr<const GuideMap> guide,
                const PlannerOptions& costs, LeggedActions actions = {});
  ~LeggedPlanner();
  /// A moved-from planner may only be destroyed.
  LeggedPlanner(LeggedPlanner&&) noexcept;

  /// Plans from `start` to `goal`, stances on all contacts in the order of the dataset. Empty if no plan was found
  /// within the effort limits. The plan alternates between all contacts and those that stand during a phase.
  std::optional<FootstepPlan> Plan(const Stance& start, const Stance& goal);
  /// Returns the most frequent reason why phases of all plans so far were not allowed, with its share; empty if all
  /// were.
  std::string MainRefusal() const;

  struct Impl;  // internal

 private:
  std::unique_ptr<Impl> impl_;
};

}  // namespace legopt::worldgen
