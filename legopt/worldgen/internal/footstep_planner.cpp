#include "legopt/worldgen/internal/footstep_planner.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <unordered_map>
#include <utility>

#include "legopt/worldgen/internal/anytime_search.h"

namespace legopt::worldgen {
namespace {

using Eigen::Vector2d;
constexpr int kLeft = 0;
constexpr int kRight = 1;

/// Cache of contacts on the grid.
class FootholdTable {
 public:
  FootholdTable(const std::shared_ptr<const ProbeModel>& model, const PlannerOptions& options, double scale)
      : probe_(model), options_(options), scale_(scale), grid_m_(options.grid_m * scale) {}

  struct Entry {
    ContactTarget foothold;
    int foot;
    double yaw;
  };

  StanceProbe& probe() { return probe_; }
  double grid_m() const { return grid_m_; }
  const Entry& entry(int id) const { return entries_[static_cast<size_t>(id)]; }

  int AddLoose(int foot, const ContactTarget& foothold) {
    entries_.push_back({foothold, foot, Yaw(foothold)});
    return static_cast<int>(entries_.size()) - 1;
  }

  /// Returns the indices of the contacts above the grid point nearest to (x, y).
  const std::vector<int>& At(int foot, double x, double y, double yaw) {
    const double turn = 2.0 * M_PI / options_.headings;
    const Key key = {
        foot, static_cast<int>(std::lround(x / grid_m_)), static_cast<int>(std::lround(y / grid_m_)),
        ((static_cast<int>(std::lround(yaw / turn)) % options_.headings) + options_.headings) % options_.headings};
    const auto [found, fresh] = known_.try_emplace(key);
    if (!fresh) return found->second;
    const double heading = key[3] * turn;
    std::vector<ContactTarget> footholds;
    for (const double slide : options_.slides_m) {
      probe_.Footholds(foot, key[1] * grid_m_ + slide * scale_ * std::cos(heading),
                       key[2] * grid_m_ + slide * scale_ * std::sin(heading), heading, footholds);
      if (!footholds.empty()) break;
    }
    std::vector<int> ids;
    for (ContactTarget& foothold : footholds) {
      entries_.push_back({std::move(foothold), foot, heading});
      ids.push_back(static_cast<int>(entries_.size()) - 1);
    }
    return known_[key] = std::move(ids);
  }

 private:
  using Key = std::array<int, 4>;
  struct KeyHash {
    std::size_t operator()(const Key& key) const {
      std::uint64_t hash = 0x9E3779B97F4A7C15ULL;
      for (const int part : key) hash = (hash ^ static_cast<std::uint64_t>(part)) * 0xFF51AFD7ED558CCDULL;
      return hash ^ (hash >> 29);
    }
  };
  StanceProbe probe_;
  const PlannerOptions& options_;
  double scale_;
  double grid_m_;
  std::vector<Entry> entries_;
  std::unordered_map<Key, std::vector<int>, KeyHash> known_;  ///< never iterated, since its order is unspecified
};

double Wrapped(double angle) { return std::remainder(angle, 2.0 * M_PI); }

}  // namespace

struct FootstepPlanner::Impl {
  Impl(std::shared_ptr<const ProbeModel> probe_model, std::shared_ptr<const GuideMap> guide_map,
       const PlannerOptions& planner_options)
      : model(std::move(probe_model)),
        guide(std::move(guide_map)),
        options(planner_options),
        scale(model->options.reach_m / ProbeOptions{}.reach_m),
        table(model, options, scale) {}

  std::shared_ptr<const ProbeModel> model;
  std::shared_ptr<const GuideMap> guide;
  PlannerOptions options;
  double scale;
  FootholdTable table;
  std::unordered_map<std::uint64_t, double> step_costs;  ///< between two contacts of the table; never iterated
};

namespace {

/// A single search. States are numbered in the order in which this search reaches them, so that ties do not depend on
/// earlier content of the table.
class FootstepSearch : public AnytimeSearch {
 public:
  FootstepSearch(FootstepPlanner::Impl& planner, const Stance& start, const Stance& goal);
  std::optional<FootstepPlan> Search();

 private:
  int FootholdOf(int state) const { return footholds_[static_cast<size_t>(state)]; }
  int StateOf(int foothold);
  double StepCost(int from, int to);
  void Expand(int id) override;
  void ExpandToGoal(int id, const FootholdTable::Entry& entry);
  FootstepPlan Extract();

  FootstepPlanner::Impl& planner_;
  const Stance& start_;
  std::array<int, 2> goal_{};  ///< indices in the table
  std::vector<float> cautious_;
  std::vector<float> shortest_;
  std::vector<int> footholds_;             ///< per state: index in the table; -1: both feet at the goal
  std::unordered_map<int, int> state_of_;  ///< keyed by index in the table; never iterated
};

FootstepSearch::FootstepSearch(FootstepPlanner::Impl& planner, const Stance& start, const Stance& goal)
    : planner_(planner), start_(start), footholds_(1, -1) {
  std::array<Eigen::Vector3d, 2> places;
  for (const int foot : {kLeft, kRight}) {
    const ContactTarget& foothold = goal.contacts[static_cast<size_t>(foot)];
    goal_[static_cast<size_t>(foot)] = planner.table.AddLoose(foot, foothold);
    places[static_cast<size_t>(foot)] = foothold.position;
  }
  cautious_ = planner.guide->DistancesTo(places, GuideMap::Measure::kWeighted);
  shortest_ = planner.guide->DistancesTo(places, GuideMap::Measure::kShortest);
  StateOf(planner.table.AddLoose(kLeft, start.contacts[kLeft]));
}

int FootstepSearch::StateOf(int foothold) {
  const auto [found, fresh] = state_of_.try_emplace(foothold, static_cast<int>(footholds_.size()));
  if (fresh) {
    const Eigen::Vector3d& place = planner_.table.entry(foothold).foothold.position;
    const double reach = planner_.model->options.reach_m;
    footholds_.push_back(foothold);
    AddState(planner_.guide->Distance(cautious_, place) / reach, planner_.guide->LowerBound(shortest_, place) / reach);
  }
  return found->second;
}

/// Returns the cost of a step between two contacts of the table; infinity if the step is not allowed.
double FootstepSearch::StepCost(int from, int to) {
  const FootholdTable::Entry& a = planner_.table.entry(from);
  const FootholdTable::Entry& b = planner_.table.entry(to);
  const ProbeOptions& probe = planner_.model->options;
  const Eigen::Vector3d apart = b.foothold.position - a.foothold.position;
  if (std::abs(apart.z()) > probe.step_m || apart.head<2>().norm() > probe.reach_m) return kInfinity;
  const std::uint64_t key = (static_cast<std::uint64_t>(from) << 32) | static_cast<std::uint64_t>(to);
  const auto [found, fresh] = planner_.step_costs.try_emplace(key, kInfinity);
  if (!fresh) return found->second;
  Stance stance{{a.foothold, b.foothold}};
  if (a.foot == kRight) std::swap(stance.contacts[0], stance.contacts[1]);
  constexpr double kTrunkMargin = 1e-3;
  if (planner_.table.probe().TrunkDistance(stance, kTrunkMargin) < kTrunkMargin) return kInfinity;
  constexpr double kFullTurn = M_PI / 6.0;
  const double height = std::abs(apart.z()) / probe.step_m;
  const double turn = std::abs(Wrapped(b.yaw - a.yaw)) / kFullTurn;
  found->second = 1.0 + planner_.options.height_cost * height + planner_.options.turn_cost * turn;
  return found->second;
}

void FootstepSearch::Expand(int id) {
  const FootholdTable::Entry entry = planner_.table.entry(FootholdOf(id));  // a copy, since the table may grow
  const int next = 1 - entry.foot;
  const double outwards = next == kLeft ? 1.0 : -1.0;
  const double c = std::cos(entry.yaw);
  const double s = std::sin(entry.yaw);
  const PlannerOptions& options = planner_.options;
  std::set<int> tried;
  for (const double forward : options.forward_m) {
    for (const double sideways : options.sideways_m) {
      const Vector2d d = planner_.scale * Vector2d(forward, outwards * sideways);
      const double x = entry.foothold.position.x() + c * d.x() - s * d.y();
      const double y = entry.foothold.position.y() + s * d.x() + c * d.y();
      for (const double turn : options.turn_rad) {
        for (const int to : planner_.table.At(next, x, y, entry.yaw + outwards * turn)) {
          if (!tried.insert(to).second) continue;
          const double cost = StepCost(FootholdOf(id), to);
          if (std::isfinite(cost)) Relax(id, StateOf(to), cost);
        }
      }
    }
  }
  ExpandToGoal(id, entry);
}

/// Adds the step to the goal's contact if it lies within the range of the action set, or if the other foot is already
/// at its goal.
void FootstepSearch::ExpandToGoal(int id, const FootholdTable::Entry& entry) {
  const int next = 1 - entry.foot;
  const double outwards = next == kLeft ? 1.0 : -1.0;
  const int to = goal_[static_cast<size_t>(next)];
  const FootholdTable::Entry& goal = planner_.table.entry(to);
  const Vector2d apart = (goal.foothold.position - entry.foothold.position).head<2>();
  const double sideways = outwards * (std::cos(entry.yaw) * apart.y() - std::sin(entry.yaw) * apart.x());
  const double turn = outwards * Wrapped(goal.yaw - entry.yaw);
  const PlannerOptions& options = planner_.options;
  const double half_heading = M_PI / options.headings;
  const bool standing = FootholdOf(id) == goal_[static_cast<size_t>(entry.foot)];
  const bool in_range = sideways > planner_.scale * options.sideways_m.front() - planner_.table.grid_m() &&
                        turn > -half_heading && turn < options.turn_rad.back() + half_heading;
  if (!in_range && !standing) return;
  const double cost = StepCost(FootholdOf(id), to);
  if (std::isfinite(cost)) Relax(id, standing ? kDone : StateOf(to), cost);
}

FootstepPlan FootstepSearch::Extract() {
  FootstepPlan plan;
  plan.cost = cost();
  plan.bound = Bound();
  const std::vector<int> path = Path();
  std::vector<ContactTarget> steps;
  for (const int id : path) {
    if (id != kStart) steps.push_back(planner_.table.entry(FootholdOf(id)).foothold);
  }
  const int other = 1 - planner_.table.entry(FootholdOf(path.back())).foot;
  steps.push_back(planner_.table.entry(goal_[static_cast<size_t>(other)]).foothold);
  plan.steps = static_cast<int>(steps.size());
  plan.stances = ExpandSteps(start_, steps);
  plan.expansions = expansions();
  return plan;
}

std::optional<FootstepPlan> FootstepSearch::Search() {
  const PlannerOptions& options = planner_.options;
  if (!Run({.first_epsilon = options.first_epsilon,
            .epsilon_step = options.epsilon_step,
            .max_expansions = options.max_expansions,
            .extra_expansions = options.extra_expansions})) {
    return {};
  }
  return Extract();
}

}  // namespace

FootstepPlanner::FootstepPlanner(std::shared_ptr<const ProbeModel> model, std::shared_ptr<const GuideMap> guide,
                                 const PlannerOptions& options)
    : impl_(std::make_unique<Impl>(std::move(model), std::move(guide), options)) {}
FootstepPlanner::~FootstepPlanner() = default;
FootstepPlanner::FootstepPlanner(FootstepPlanner&&) noexcept = default;

std::optional<FootstepPlan> FootstepPlanner::Plan(const Stance& start, const Stance& goal) {
  return FootstepSearch(*impl_, start, goal).Search();
}

std::vector<Stance> ExpandSteps(const Stance& start, const std::vector<ContactTarget>& steps) {
  std::vector<Stance> stances = {start};
  Stance both = start;
  for (size_t k = 0; k < steps.size(); ++k) {
    const size_t swings = k % 2 == 0 ? kRight : kLeft;
    stances.push_back({{both.contacts[1 - swings]}});
    both.contacts[swings] = steps[k];
    stances.push_back(both);
  }
  return stances;
}

}  // namespace legopt::worldgen
