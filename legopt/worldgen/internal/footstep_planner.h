#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "legopt/worldgen/internal/guide_map.h"
#include "legopt/worldgen/internal/stance_probe.h"

namespace legopt::worldgen {

/// Action set and effort limits of the planner. Lengths are for Atlas (base 0.874 m above the contact patches) and are
/// scaled with the robot. Positions are relative to the stance foot, in the direction of its heading.
struct PlannerOptions {
  std::vector<double> forward_m = {-0.25, 0.0, 0.15, 0.3, 0.45, 0.58};  ///< step lengths along the heading
  std::vector<double> sideways_m = {0.22, 0.3, 0.4};                    ///< step widths, outwards
  std::vector<double> turn_rad = {0.0, M_PI / 9.0};                     ///< rotations, outwards
  double grid_m = 0.1;                                                  ///< spacing of the grid of contacts
  int headings = 36;                                                    ///< number of headings on the grid
  std::vector<double> slides_m = {0.0, 0.03, -0.03};  ///< shifts along the heading, tried in turn if a contact is
                                                      ///< invalid
  double height_cost = 0.3;                           ///< cost of a step over the full step height, in steps
  double turn_cost = 0.2;                             ///< cost of a rotation by 30 degrees, in steps
  double first_epsilon = 5.0;                         ///< initial inflation of the heuristic, >= 1
  double epsilon_step = 1.0;                          ///< decrease of epsilon after every solution
  std::int64_t max_expansions = 8000;                 ///< limit until the first solution
  std::int64_t extra_expansions = 1500;               ///< additional limit after the first solution, to improve the
                                                      ///< bound
};

/// A footstep plan with its cost and suboptimality bound.
struct FootstepPlan {
  std::vector<Stance> stances;  ///< double, left, double, right, double, ...: see ExpandSteps
  int steps = 0;                ///< number of contacts after the start
  double cost = 0.0;            ///< total cost, in steps
  double bound = 0.0;           ///< the cost is at most `bound` times the optimum of the action set
  std::int64_t expansions = 0;  ///< number of expanded states
};

/// Plans footsteps of robots with two feet by ARA* (Likhachev et al. 2003): A* with the heuristic inflated by epsilon.
/// After a solution epsilon decreases and the search continues with its previous results, until epsilon is 1 or the
/// effort limit is reached.
///
/// State: the last placed foot. Action: place the other foot at one of the relative positions of the action set,
/// rounded to the grid, on any surface within the step height. An action is allowed if the contact is valid
/// (StanceProbe), the feet are at most the reach apart, and the trunk box over both feet is collision-free. Near the
/// goal its exact contacts are additional actions. Cost: 1 per step plus terms for height and rotation.
///
/// Heuristic: the weighted distance of GuideMap divided by the reach, an estimate of the remaining steps, not a bound.
/// Bound: cost / min of g + l over the open states, where l = GuideMap::LowerBound / reach is a lower bound of the
/// number of steps (consecutive contacts are at most the reach apart) up to the resolution of the map. This is the
/// published bound of ARA* without its first part, epsilon, which needs an admissible heuristic.
///
/// Not thread-safe. Contacts are cached for later plans; the cache does not affect results.
class FootstepPlanner {
 public:
  /// Model and map are shared by all planners. The lengths in `options` are those for Atlas and are scaled here.
  FootstepPlanner(std::shared_ptr<const ProbeModel> model, std::shared_ptr<const GuideMap> guide,
                  const PlannerOptions& options);
  ~FootstepPlanner();
  /// A moved-from planner may only be destroyed.
  FootstepPlanner(FootstepPlanner&&) noexcept;

  /// Plans from `start` to `goal`, two-foot stances with the left foot first. Empty if no plan was found within the
  /// effort limits. The first step moves the right foot, so that the plan starts with double support, then left
  /// support.
  std::optional<FootstepPlan> Plan(const Stance& start, const Stance& goal);

  struct Impl;  // internal

 private:
  std::unique_ptr<Impl> impl_;
};

/// Expands contacts placed alternately, right foot first, into stances: `start`, then for each step the single support
/// during the swing and the double support after it.
std::vector<Stance> ExpandSteps(const Stance& start, const std::vector<ContactTarget>& steps);

}  // namespace legopt::worldgen
