#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "legopt/generate/guide_map.h"
#include "legopt/generate/stance_probe.h"

namespace legopt::generate {

/// The action set and the effort of the planner. Lengths are for Atlas (base 0.874 m above the soles) and scale with
/// the robot; positions are relative to the foot that stands, turned by its heading.
struct PlannerOptions {
  std::vector<double> forward_m = {-0.25, 0.0, 0.15, 0.3, 0.45, 0.58};  ///< steps along the heading
  std::vector<double> sideways_m = {0.22, 0.3, 0.4};                    ///< outwards
  std::vector<double> turn_rad = {0.0, M_PI / 9.0};                     ///< outwards
  double grid_m = 0.1;                                                  ///< footholds lie on this grid ...
  int headings = 36;                                                    ///< ... with one of these headings
  std::vector<double> slides_m = {0.0, 0.03, -0.03};  ///< along the heading, tried in turn where a foot does not hold
  double height_cost = 0.3;                           ///< of a step over the full step height, in steps
  double turn_cost = 0.2;                             ///< of a turn by 30 degrees, in steps
  double first_epsilon = 5.0;                         ///< inflation of the heuristic at the beginning, >= 1
  double epsilon_step = 1.0;                          ///< by which it shrinks after every solution
  std::int64_t max_expansions = 8000;                 ///< until the first solution
  std::int64_t extra_expansions = 1500;               ///< after it, to improve the bound
};

/// A plan, and what is known of its quality.
struct FootstepPlan {
  std::vector<Stance> stances;  ///< double, left, double, right, double, ...: see ExpandSteps
  int steps = 0;                ///< footholds placed after the start
  double cost = 0.0;            ///< of all steps, in steps
  double bound = 0.0;           ///< the cost is at most this times the optimum of the action set
  std::int64_t expansions = 0;  ///< states looked at
};

/// Plans footsteps between stances by ARA* (Likhachev et al. 2003): A* with the heuristic inflated by epsilon; after a
/// solution epsilon shrinks and the search goes on with what it has, until epsilon is 1 or the effort is spent.
///
/// State: the foot that has been placed last. Action: place the other foot at one of the relative positions of the
/// action set, rounded to the grid, on any surface within the step height. It is legal when the foot holds
/// (StanceProbe), the feet are at most the reach apart, and the trunk box over both feet is free. Near the goal its
/// exact footholds are actions, too. Cost: 1 per step plus shares for height and turning.
///
/// Heuristic: the cautious distance of GuideMap over the reach, an estimate of the steps that are left, not a bound.
/// Bound: cost / min of g + l over the states still open, where l = GuideMap::LowerBound / reach is a lower bound of
/// the number of steps (consecutive footholds are at most the reach apart) up to the resolution of the map. This is the
/// published bound of ARA* without its first part, epsilon, which needs an admissible heuristic.
///
/// One thread. Footholds found are remembered for later plans and do not change them.
class FootstepPlanner {
 public:
  /// Model and map are shared by all planners. `options` are Atlas's; their lengths are scaled here.
  FootstepPlanner(std::shared_ptr<const ProbeModel> model, std::shared_ptr<const GuideMap> guide,
                  const PlannerOptions& options);
  ~FootstepPlanner();
  /// What is moved from may only be destroyed.
  FootstepPlanner(FootstepPlanner&&) noexcept;

  /// Both stances on two feet, left foot first. Nothing when no plan was found within the effort. The first step is the
  /// right foot's, so that the plan starts in double, then left support.
  std::optional<FootstepPlan> Plan(const Stance& start, const Stance& goal);

  struct Impl;  // internal

 private:
  std::unique_ptr<Impl> impl_;
};

/// Stances of a sequence of footholds placed alternately, right foot first, from `start`: the start, then per step the
/// single support it swings over and the double support it ends in.
std::vector<Stance> ExpandSteps(const Stance& start, const std::vector<Foothold>& steps);

}  // namespace legopt::generate
