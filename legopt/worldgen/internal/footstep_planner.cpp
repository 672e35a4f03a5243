#include "legopt/worldgen/internal/footstep_planner.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <queue>
#include <set>
#include <unordered_map>
#include <utility>

namespace legopt::worldgen {
namespace {

using Eigen::Vector2d;
constexpr double kInfinity = std::numeric_limits<double>::infinity();
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
class Search {
 public:
  Search(FootstepPlanner::Impl& planner, const Stance& start, const Stance& goal);
  std::optional<FootstepPlan> Run();

 private:
  struct State {
    int foothold = -1;  ///< index in the table; -1: both feet at the goal
    double g = kInfinity;
    double h = 0.0;      ///< estimated number of remaining steps
    double least = 0.0;  ///< lower bound of the number of remaining steps
    int parent = -1;
    int round = -1;  ///< round of the last expansion
  };
  using Entry = std::pair<double, int>;

  static constexpr int kDone = 0;
  static constexpr int kStart = 1;

  State& At(int id) { return states_[static_cast<size_t>(id)]; }
  int StateOf(int foothold);
  double StepCost(int from, int to);
  void Expand(int id);
  void ExpandToGoal(int id, const FootholdTable::Entry& entry);
  void Relax(int from, int to, double cost);
  bool Improve(std::int64_t limit);
  double LeastPossible();
  FootstepPlan Extract();
  void Reopen();

  FootstepPlanner::Impl& planner_;
  const Stance& start_;
  std::array<int, 2> goal_{};  ///< indices in the table
  std::vector<float> cautious_;
  std::vector<float> shortest_;
  std::vector<State> states_;
  std::unordered_map<int, int> state_of_;  ///< keyed by index in the table; never iterated
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> open_;
  std::set<int> members_;  ///< states in open_, which may also contain outdated entries
  std::set<int> inconsistent_;
  double epsilon_ = 1.0;
  int round_ = 0;
  std::int64_t expansions_ = 0;
};

Search::Search(FootstepPlanner::Impl& planner, const Stance& start, const Stance& goal)
    : planner_(planner), start_(start), states_(1) {
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

int Search::StateOf(int foothold) {
  const auto [found, fresh] = state_of_.try_emplace(foothold, static_cast<int>(states_.size()));
  if (fresh) {
    const Eigen::Vector3d& place = planner_.table.entry(foothold).foothold.position;
    const double reach = planner_.model->options.reach_m;
    states_.push_back({.foothold = foothold,
                       .h = planner_.guide->Distance(cautious_, place) / reach,
                       .least = planner_.guide->LowerBound(shortest_, place) / reach});
  }
  return found->second;
}

/// Returns the cost of a step between two contacts of the table; infinity if the step is not allowed.
double Search::StepCost(int from, int to) {
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

void Search::Relax(int from, int to, double cost) {
  const double g = At(from).g + cost;
  State& state = At(to);
  if (g >= state.g || !std::isfinite(state.h)) return;
  state.g = g;
  state.parent = from;
  if (state.round == round_) {
    inconsistent_.insert(to);
    return;
  }
  open_.emplace(g + epsilon_ * state.h, to);
  members_.insert(to);
}

void Search::Expand(int id) {
  const FootholdTable::Entry entry = planner_.table.entry(At(id).foothold);  // a copy, since the table may grow
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
          const double cost = StepCost(At(id).foothold, to);
          if (std::isfinite(cost)) Relax(id, StateOf(to), cost);
        }
      }
    }
  }
  ExpandToGoal(id, entry);
}

/// Adds the step to the goal's contact if it lies within the range of the action set, or if the other foot is already
/// at its goal.
void Search::ExpandToGoal(int id, const FootholdTable::Entry& entry) {
  const int next = 1 - entry.foot;
  const double outwards = next == kLeft ? 1.0 : -1.0;
  const int to = goal_[static_cast<size_t>(next)];
  const FootholdTable::Entry& goal = planner_.table.entry(to);
  const Vector2d apart = (goal.foothold.position - entry.foothold.position).head<2>();
  const double sideways = outwards * (std::cos(entry.yaw) * apart.y() - std::sin(entry.yaw) * apart.x());
  const double turn = outwards * Wrapped(goal.yaw - entry.yaw);
  const PlannerOptions& options = planner_.options;
  const double half_heading = M_PI / options.headings;
  const bool standing = At(id).foothold == goal_[static_cast<size_t>(entry.foot)];
  const bool in_range = sideways > planner_.scale * options.sideways_m.front() - planner_.table.grid_m() &&
                        turn > -half_heading && turn < options.turn_rad.back() + half_heading;
  if (!in_range && !standing) return;
  const double cost = StepCost(At(id).foothold, to);
  if (std::isfinite(cost)) Relax(id, standing ? kDone : StateOf(to), cost);
}

/// Expands states until no open state can improve the goal. Returns false if the effort limit is reached before.
bool Search::Improve(std::int64_t limit) {
  while (!open_.empty()) {
    const auto [f, id] = open_.top();
    if (At(kDone).g <= f) return true;
    if (At(id).round != round_ && id != kDone && expansions_ >= limit) return false;
    open_.pop();
    if (At(id).round == round_ || id == kDone) continue;
    members_.erase(id);
    At(id).round = round_;
    ++expansions_;
    Expand(id);
  }
  return std::isfinite(At(kDone).g);
}

double Search::LeastPossible() {
  double least = At(kDone).g;
  for (const std::set<int>* set : {&members_, &inconsistent_}) {
    for (const int id : *set) least = std::min(least, At(id).g + At(id).least);
  }
  return least;
}

/// Opens all states that may still be improved, with the current epsilon.
void Search::Reopen() {
  members_.insert(inconsistent_.begin(), inconsistent_.end());
  inconsistent_.clear();
  open_ = {};
  for (const int id : members_) open_.emplace(At(id).g + epsilon_ * At(id).h, id);
  ++round_;
}

FootstepPlan Search::Extract() {
  FootstepPlan plan;
  plan.cost = At(kDone).g;
  plan.bound = std::max(1.0, plan.cost / LeastPossible());
  std::vector<ContactTarget> steps;
  const int last = At(kDone).parent;
  const int other = 1 - planner_.table.entry(At(last).foothold).foot;
  steps.push_back(planner_.table.entry(goal_[static_cast<size_t>(other)]).foothold);
  for (int id = last; id != kStart; id = At(id).parent) {
    steps.push_back(planner_.table.entry(At(id).foothold).foothold);
  }
  std::reverse(steps.begin(), steps.end());
  plan.steps = static_cast<int>(steps.size());
  plan.stances = ExpandSteps(start_, steps);
  plan.expansions = expansions_;
  return plan;
}

std::optional<FootstepPlan> Search::Run() {
  epsilon_ = planner_.options.first_epsilon;
  if (!std::isfinite(At(kStart).h)) return {};
  At(kStart).g = 0.0;
  open_.emplace(epsilon_ * At(kStart).h, kStart);
  members_.insert(kStart);
  if (!Improve(planner_.options.max_expansions)) return {};
  const std::int64_t limit = expansions_ + planner_.options.extra_expansions;
  while (epsilon_ > 1.0) {
    epsilon_ = std::max(1.0, epsilon_ - planner_.options.epsilon_step);
    Reopen();
    if (!Improve(limit)) break;
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
  return Search(*impl_, start, goal).Run();
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
