#include "legopt/worldgen/internal/legged_planner.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <numeric>
#include <set>
#include <utility>

#include "legopt/planning/certify/internal/stance_certifier.h"
#include "legopt/types/number_text.h"
#include "legopt/worldgen/internal/anytime_search.h"

namespace legopt::worldgen {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using Placements = std::vector<ReachCloud::Placement>;

double WrappedAngle(double angle) { return std::remainder(angle, 2.0 * M_PI); }

/// Reasons why a phase is not allowed.
enum class Refusal : std::uint8_t { kGround, kSpan, kReach, kReachDuring, kBalance, kTrunk, kPosture };
constexpr std::array<const char*, 7> kRefusals = {
    "there is no ground to stand on within a step's height",
    "the contacts would be too far apart, or the trunk would move too far",
    "a contact would be out of reach",
    "a contact that stands would be out of reach during the phase",
    "the centre of mass would be outside of the contacts that stand during the phase by more than a stride",
    "the trunk would collide",
    "no posture was found"};
using RefusalCounts = std::array<std::int64_t, kRefusals.size()>;

/// Valid footholds on a grid, found at first use.
class GridOfFootholds {
 public:
  GridOfFootholds(const std::shared_ptr<const ProbeModel>& model, double grid_m, int headings)
      : probe_(model), grid_m_(grid_m), headings_(headings) {}

  StanceProbe& probe() { return probe_; }
  const ContactTarget& foothold(int id) const { return footholds_[static_cast<size_t>(id)]; }

  int Add(ContactTarget foothold) {
    footholds_.push_back(std::move(foothold));
    return static_cast<int>(footholds_.size()) - 1;
  }

  /// Returns the foothold of a contact nearest in height to `z_m` and no farther than `step_m` from it, at the grid
  /// point nearest to `at` or at one of its neighbours; -1 if there is none.
  int Nearest(int contact, const Vector2d& at, double yaw_rad, double z_m, double step_m) {
    static constexpr std::array<std::array<int, 2>, 9> kOffsets = {
        {{0, 0}, {1, 0}, {-1, 0}, {0, 1}, {0, -1}, {1, 1}, {1, -1}, {-1, 1}, {-1, -1}}};
    const int i = static_cast<int>(std::lround(at.x() / grid_m_));
    const int j = static_cast<int>(std::lround(at.y() / grid_m_));
    for (const auto& offset : kOffsets) {
      int best = -1;
      double nearest_m = step_m;
      for (const int id : At(contact, i + offset[0], j + offset[1], yaw_rad)) {
        const double distance_m = std::abs(foothold(id).position.z() - z_m);
        if (distance_m > nearest_m) continue;
        nearest_m = distance_m;
        best = id;
      }
      if (best >= 0) return best;
    }
    return -1;
  }

 private:
  const std::vector<int>& At(int contact, int i, int j, double yaw_rad) {
    const bool point =
        probe_.model().dataset->feet()[static_cast<size_t>(contact)].facts().shape == ContactShape::kBall;
    const double turn_rad = 2.0 * M_PI / headings_;
    const int heading =
        point ? 0 : ((static_cast<int>(std::lround(yaw_rad / turn_rad)) % headings_) + headings_) % headings_;
    const auto [found, fresh] = known_.try_emplace({contact, i, j, heading});
    if (!fresh) return found->second;
    probe_.Footholds(contact, i * grid_m_, j * grid_m_, heading * turn_rad, scratch_);
    for (ContactTarget& target : scratch_) found->second.push_back(Add(std::move(target)));
    return found->second;
  }

  StanceProbe probe_;
  double grid_m_;
  int headings_;
  std::vector<ContactTarget> footholds_;
  std::vector<ContactTarget> scratch_;
  std::map<std::array<int, 4>, std::vector<int>> known_;
};

}  // namespace

struct LeggedPlanner::Impl {
  Impl(std::shared_ptr<const ProbeModel> probe_model, std::shared_ptr<const GuideMap> guide_map,
       const PlannerOptions& planner_costs, LeggedActions action_set)
      : model(std::move(probe_model)),
        guide(std::move(guide_map)),
        costs(planner_costs),
        actions(std::move(action_set)),
        gaits(GaitsOf(*model->reach)),
        certifier(model->dataset),
        grid(model, std::max(actions.least_grid_m, actions.grid * model->reach->stride_m()), actions.headings) {}

  std::shared_ptr<const ProbeModel> model;
  std::shared_ptr<const GuideMap> guide;
  PlannerOptions costs;
  LeggedActions actions;
  std::vector<Gait> gaits;
  certify::StanceCertifier certifier;
  GridOfFootholds grid;
  std::map<std::vector<int>, bool> postures;  ///< known results of LeggedSearch::HasPosture
  RefusalCounts refusals{};

  /// Counts a refusal. Returns false.
  bool Refuse(Refusal reason) {
    ++refusals[static_cast<size_t>(reason)];
    return false;
  }
};

namespace {

/// Movement of the trunk in its own axes.
struct Movement {
  Vector2d offset_m;
  double turn_rad;
};

class LeggedSearch : public AnytimeSearch {
 public:
  /// Key of a state: footholds, gait and phase.
  using Key = std::vector<int>;

  /// `start` and `goal`: numbers of footholds; `excluded`: states that must not be used. They must outlive the search.
  /// `only_postures`: expands only states with postures.
  LeggedSearch(LeggedPlanner::Impl& planner, const std::vector<int>& start, const std::vector<int>& goal,
               const std::set<Key>& excluded, bool only_postures);
  /// Searches. Returns false if no plan was found.
  bool Search();
  /// Returns the plan of a successful search.
  FootstepPlan Extract() const;
  /// Returns the keys of the plan's first states without a posture on all contacts, or on those that stand during the
  /// phase.
  std::vector<Key> Infeasible() const;

 private:
  struct Node {
    std::vector<int> footholds;  ///< per contact: number in the grid; empty: the goal
    int gait = -1;               ///< last phase; -1: none
    int phase = 0;
    TrunkPose trunk;
  };

  Placements PlacementsAt(const std::vector<int>& footholds, const std::vector<int>* lifted = nullptr) const;
  double Estimate(const TrunkPose& trunk, const Placements& placements) const;
  int StateOf(std::vector<int> footholds, int gait, int phase, const TrunkPose& trunk);
  std::vector<Movement> MovementsOf(const std::vector<int>& moving) const;
  bool ExpandGait(int id, int gait);
  bool ExpandPhase(int id, int gait, int phase);
  void ExpandToGoal(int id, int gait, int phase);
  bool Try(int id, std::vector<int> footholds, int gait, int phase);
  bool Allowed(const std::vector<int>& footholds, const std::vector<int>& lifted, const TrunkPose& before,
               const TrunkPose& after);
  bool TrunkIsFree(const std::vector<int>& footholds, const TrunkPose& trunk);
  Stance StanceOf(const std::vector<int>& footholds, const std::vector<int>* lifted) const;
  bool HasPosture(const std::vector<int>& footholds, const std::vector<int>* lifted) const;
  bool HasPostures(const Node& node) const;
  void Expand(int id) override;
  static Key KeyOf(const std::vector<int>& footholds, int gait, int phase);
  const std::vector<int>& Moving(int gait, int phase) const {
    return planner_.gaits[static_cast<size_t>(gait)].phases[static_cast<size_t>(phase)];
  }

  LeggedPlanner::Impl& planner_;
  const ReachCloud& reach_;
  const std::vector<int>& goal_;
  const std::set<Key>& excluded_;
  const bool only_postures_;
  TrunkPose goal_trunk_;
  std::vector<float> cautious_;
  std::vector<float> shortest_;
  double progress_m_ = 1.0;    ///< estimated progress of a phase
  double progress_rad_ = 1.0;  ///< estimated rotation of a phase
  std::vector<Node> nodes_;
  std::map<Key, int> state_of_;
  std::map<std::vector<int>, bool> trunk_free_;  ///< key: footholds
};

LeggedSearch::LeggedSearch(LeggedPlanner::Impl& planner, const std::vector<int>& start, const std::vector<int>& goal,
                           const std::set<Key>& excluded, bool only_postures)
    : planner_(planner),
      reach_(*planner.model->reach),
      goal_(goal),
      excluded_(excluded),
      only_postures_(only_postures),
      nodes_(1) {
  const Placements places = PlacementsAt(goal_);
  goal_trunk_ = reach_.Fit(places, 0.0);
  std::vector<Vector3d> points = {{goal_trunk_.position.x(), goal_trunk_.position.y(), goal_trunk_.ground_m}};
  for (const ReachCloud::Placement& place : places) points.push_back(place.position);
  cautious_ = planner.guide->DistancesTo(points, GuideMap::Measure::kWeighted);
  shortest_ = planner.guide->DistancesTo(points, GuideMap::Measure::kShortest);
  const auto moving = static_cast<double>(Moving(0, 0).size());
  const double share = moving / reach_.num_contacts();
  progress_m_ = std::max(1e-3, 2.0 * reach_.stride_m() * share / (1.0 - share));
  progress_rad_ = 2.0 * planner.actions.turn_rad.front() * share;
  StateOf(start, -1, 0, reach_.Fit(PlacementsAt(start), 0.0));
}

LeggedSearch::Key LeggedSearch::KeyOf(const std::vector<int>& footholds, int gait, int phase) {
  Key key = footholds;
  key.push_back(gait);
  key.push_back(phase);
  return key;
}

Placements LeggedSearch::PlacementsAt(const std::vector<int>& footholds, const std::vector<int>* lifted) const {
  Placements placements;
  for (int c = 0; c < reach_.num_contacts(); ++c) {
    if (lifted != nullptr && std::binary_search(lifted->begin(), lifted->end(), c)) continue;
    placements.push_back({c, planner_.grid.foothold(footholds[static_cast<size_t>(c)]).position});
  }
  return placements;
}

/// Estimates the number of phases to the goal. The middle may be over a gap: then the nearest foot counts.
double LeggedSearch::Estimate(const TrunkPose& trunk, const Placements& placements) const {
  double distance_m = planner_.guide->Distance(cautious_, {trunk.position.x(), trunk.position.y(), trunk.ground_m});
  for (size_t k = 0; k < placements.size() && !std::isfinite(distance_m); ++k) {
    distance_m = planner_.guide->Distance(cautious_, placements[k].position);
  }
  const double turn_rad = std::abs(WrappedAngle(goal_trunk_.yaw_rad - trunk.yaw_rad));
  // The map's squares are wide: near the goal the straight distance counts.
  distance_m = std::max(distance_m, (goal_trunk_.position - trunk.position).norm());
  return distance_m / progress_m_ + turn_rad / progress_rad_;
}

int LeggedSearch::StateOf(std::vector<int> footholds, int gait, int phase, const TrunkPose& trunk) {
  const auto [found, fresh] = state_of_.try_emplace(KeyOf(footholds, gait, phase), static_cast<int>(nodes_.size()));
  if (fresh) {
    const Placements placements = PlacementsAt(footholds);
    double least_m = 0.0;
    for (const ReachCloud::Placement& placement : placements) {
      const double bound_m = planner_.guide->LowerBound(shortest_, placement.position);
      if (std::isfinite(bound_m)) least_m = std::max(least_m, bound_m - planner_.model->options.reach_m);
    }
    AddState(Estimate(trunk, placements), least_m / (LeggedPlanner::kMostProgress * reach_.stride_m()));
    nodes_.push_back({.footholds = std::move(footholds), .gait = gait, .phase = phase, .trunk = trunk});
  }
  return found->second;
}

/// Movements of a phase. A contact at the hind end of its stride moves to the front end, relative to a trunk that moves
/// meanwhile.
std::vector<Movement> LeggedSearch::MovementsOf(const std::vector<int>& moving) const {
  const LeggedActions& actions = planner_.actions;
  const double share = static_cast<double>(moving.size()) / reach_.num_contacts();
  const double lead_m = reach_.stride_m() * (1.0 + 2.0 * share / (1.0 - share));
  std::vector<Movement> movements;
  for (const double forward : actions.forward) {
    const double x = forward * lead_m;
    movements.push_back({{x, 0.0}, 0.0});
    for (const double sideways : actions.sideways) movements.push_back({{x, sideways * lead_m}, 0.0});
    for (const double turn_rad : actions.turn_rad) movements.push_back({{x, 0.0}, turn_rad});
  }
  return movements;
}

/// Expands the next phase of the gait, or any phase after another gait and where the order is free. Returns true if a
/// successor is nearer to the goal.
bool LeggedSearch::ExpandGait(int id, int gait) {
  const Node& node = nodes_[static_cast<size_t>(id)];
  const bool any_order = planner_.gaits[static_cast<size_t>(gait)].any_order;
  const int count = static_cast<int>(planner_.gaits[static_cast<size_t>(gait)].phases.size());
  if (node.gait == gait && !any_order) return ExpandPhase(id, gait, (node.phase + 1) % count);
  bool nearer = false;
  for (int phase = 0; phase < count; ++phase) nearer = ExpandPhase(id, gait, phase) || nearer;
  return nearer;
}

bool LeggedSearch::ExpandPhase(int id, int gait, int phase) {
  const Node node = nodes_[static_cast<size_t>(id)];  // a copy, since nodes_ grows
  const std::vector<int>& moving = Moving(gait, phase);
  const double step_m = planner_.model->options.step_m;
  bool nearer = false;
  std::vector<std::vector<int>> tried;
  for (const Movement& movement : MovementsOf(moving)) {
    const TrunkPose trunk = node.trunk.Moved(movement.offset_m, movement.turn_rad);
    std::vector<int> footholds = node.footholds;
    bool found = true;
    for (const int c : moving) {
      const ReachSample& nominal = reach_.nominal(c);
      const int foothold = planner_.grid.Nearest(c, trunk.At(nominal.position.head<2>()),
                                                 trunk.yaw_rad + nominal.yaw_rad, trunk.ground_m, step_m);
      found = found && foothold >= 0;
      footholds[static_cast<size_t>(c)] = foothold;
    }
    if (!found) planner_.Refuse(Refusal::kGround);
    if (!found || footholds == node.footholds) continue;
    if (std::find(tried.begin(), tried.end(), footholds) != tried.end()) continue;
    tried.push_back(footholds);
    nearer = Try(id, std::move(footholds), gait, phase) || nearer;
  }
  ExpandToGoal(id, gait, phase);
  return nearer;
}

/// Moves the contacts of a phase to the goal.
void LeggedSearch::ExpandToGoal(int id, int gait, int phase) {
  std::vector<int> footholds = nodes_[static_cast<size_t>(id)].footholds;
  for (const int c : Moving(gait, phase)) footholds[static_cast<size_t>(c)] = goal_[static_cast<size_t>(c)];
  if (footholds != nodes_[static_cast<size_t>(id)].footholds) Try(id, std::move(footholds), gait, phase);
}

/// Adds a successor if the action is allowed. Returns true if it is nearer to the goal.
bool LeggedSearch::Try(int id, std::vector<int> footholds, int gait, int phase) {
  if (excluded_.contains(KeyOf(footholds, gait, phase))) return false;
  const TrunkPose before = nodes_[static_cast<size_t>(id)].trunk;
  const TrunkPose after = reach_.Fit(PlacementsAt(footholds), before.yaw_rad);
  if (!Allowed(footholds, Moving(gait, phase), before, after)) return false;
  constexpr double kFullTurn = M_PI / 6.0;
  const double height = std::abs(after.ground_m - before.ground_m) / planner_.model->options.step_m;
  const double turn = std::abs(WrappedAngle(after.yaw_rad - before.yaw_rad)) / kFullTurn;
  const double cost = 1.0 + planner_.costs.height_cost * height + planner_.costs.turn_cost * turn;
  const int to = StateOf(std::move(footholds), gait, phase, after);
  Relax(id, to, cost);
  return estimate(to) < estimate(id);
}

bool LeggedSearch::Allowed(const std::vector<int>& footholds, const std::vector<int>& lifted, const TrunkPose& before,
                           const TrunkPose& after) {
  const ProbeOptions& options = planner_.model->options;
  if ((after.position - before.position).norm() > LeggedPlanner::kMostProgress * reach_.stride_m()) {
    return planner_.Refuse(Refusal::kSpan);
  }
  const Placements all = PlacementsAt(footholds);
  for (const ReachCloud::Placement& a : all) {
    for (const ReachCloud::Placement& b : all) {
      const Vector3d apart = a.position - b.position;
      if (apart.head<2>().norm() > options.reach_m || std::abs(apart.z()) > options.step_m) {
        return planner_.Refuse(Refusal::kSpan);
      }
    }
  }
  if (!reach_.ReachesAll(all, after)) return planner_.Refuse(Refusal::kReach);
  // During the phase, the trunk is half way over the contacts that stand.
  const Placements standing = PlacementsAt(footholds, &lifted);
  TrunkPose middle = before;
  middle.position = 0.5 * (before.position + after.position);
  middle.yaw_rad += 0.5 * WrappedAngle(after.yaw_rad - before.yaw_rad);
  middle.ground_m = 0.5 * (before.ground_m + after.ground_m);
  if (!reach_.ReachesAll(standing, middle)) return planner_.Refuse(Refusal::kReachDuring);
  std::vector<Vector2d> points;
  for (const ReachCloud::Placement& place : standing) points.emplace_back(place.position.head<2>());
  if (SignedDistanceToPolygon(ConvexHull2d(points), middle.At(reach_.com())) > reach_.stride_m()) {
    return planner_.Refuse(Refusal::kBalance);
  }
  return TrunkIsFree(footholds, after) || planner_.Refuse(Refusal::kTrunk);
}

bool LeggedSearch::TrunkIsFree(const std::vector<int>& footholds, const TrunkPose& trunk) {
  constexpr double kFreeTrunk_m = 1e-3;
  const auto [found, fresh] = trunk_free_.try_emplace(footholds, false);
  if (fresh) found->second = planner_.grid.probe().TrunkDistance(trunk, kFreeTrunk_m) >= kFreeTrunk_m;
  return found->second;
}

/// Returns the stance on all contacts, or on those that are not lifted.
Stance LeggedSearch::StanceOf(const std::vector<int>& footholds, const std::vector<int>* lifted) const {
  Stance stance;
  for (int c = 0; c < reach_.num_contacts(); ++c) {
    if (lifted != nullptr && std::binary_search(lifted->begin(), lifted->end(), c)) continue;
    stance.contacts.push_back(planner_.grid.foothold(footholds[static_cast<size_t>(c)]));
  }
  return stance;
}

bool LeggedSearch::HasPosture(const std::vector<int>& footholds, const std::vector<int>* lifted) const {
  std::vector<int> key = footholds;
  if (lifted != nullptr) {
    for (const int c : *lifted) key[static_cast<size_t>(c)] = -1;
  }
  const auto [found, fresh] = planner_.postures.try_emplace(std::move(key), false);
  if (fresh) {
    const Stance stance = StanceOf(footholds, lifted);
    found->second = planner_.certifier.Search(stance, 0, planner_.actions.starts, {}).has_value();
  }
  return found->second;
}

/// Returns true if a state has postures on all contacts and on those that stand during its phase.
bool LeggedSearch::HasPostures(const Node& node) const {
  return (HasPosture(node.footholds, &Moving(node.gait, node.phase)) && HasPosture(node.footholds, nullptr)) ||
         planner_.Refuse(Refusal::kPosture);
}

std::vector<LeggedSearch::Key> LeggedSearch::Infeasible() const {
  constexpr std::size_t kEnough = 3;  // the next plan may differ from here on
  std::vector<Key> keys;
  for (const int id : Path()) {
    const Node& node = nodes_[static_cast<size_t>(id)];
    if (id == kStart) continue;
    if (HasPostures(node)) continue;
    keys.push_back(KeyOf(node.footholds, node.gait, node.phase));
    if (keys.size() == kEnough) break;
  }
  return keys;
}

void LeggedSearch::Expand(int id) {
  if (only_postures_ && id != kStart && !HasPostures(nodes_[static_cast<size_t>(id)])) return;
  if (nodes_[static_cast<size_t>(id)].footholds == goal_) {
    constexpr double kNothing = 1e-9;  // costs are positive
    Relax(id, kDone, kNothing);
    return;
  }
  for (int gait = 0; gait < static_cast<int>(planner_.gaits.size()); ++gait) {
    if (ExpandGait(id, gait)) break;
  }
}

FootstepPlan LeggedSearch::Extract() const {
  FootstepPlan plan;
  plan.cost = cost();
  plan.bound = Bound();
  plan.expansions = expansions();
  for (const int id : Path()) {
    const Node& node = nodes_[static_cast<size_t>(id)];
    if (id == kStart) {
      plan.stances.push_back(StanceOf(node.footholds, nullptr));
      continue;
    }
    const std::vector<int>& moving = Moving(node.gait, node.phase);
    plan.steps += static_cast<int>(moving.size());
    plan.stances.push_back(StanceOf(node.footholds, &moving));
    plan.stances.push_back(StanceOf(node.footholds, nullptr));
  }
  return plan;
}

bool LeggedSearch::Search() {
  return Run({.first_epsilon = planner_.costs.first_epsilon,
              .epsilon_step = planner_.costs.epsilon_step,
              .max_expansions = planner_.actions.max_expansions,
              .extra_expansions = planner_.actions.extra_expansions});
}

}  // namespace

LeggedPlanner::LeggedPlanner(std::shared_ptr<const ProbeModel> model, std::shared_ptr<const GuideMap> guide,
                             const PlannerOptions& costs, LeggedActions actions)
    : impl_(std::make_unique<Impl>(std::move(model), std::move(guide), costs, std::move(actions))) {}
LeggedPlanner::~LeggedPlanner() = default;
LeggedPlanner::LeggedPlanner(LeggedPlanner&&) noexcept = default;

std::optional<FootstepPlan> LeggedPlanner::Plan(const Stance& start, const Stance& goal) {
  const auto adopt = [&](const Stance& stance) {
    std::vector<int> footholds;
    for (const ContactTarget& target : stance.contacts) footholds.push_back(impl_->grid.Add(target));
    return footholds;
  };
  const std::vector<int> from = adopt(start), to = adopt(goal);
  std::set<LeggedSearch::Key> excluded;
  for (int k = 0; k <= impl_->actions.searches; ++k) {
    LeggedSearch search(*impl_, from, to, excluded, k == impl_->actions.searches);
    if (!search.Search()) return {};
    const std::vector<LeggedSearch::Key> infeasible = search.Infeasible();
    if (infeasible.empty()) return search.Extract();
    excluded.insert(infeasible.begin(), infeasible.end());
  }
  return {};
}

std::string LeggedPlanner::MainRefusal() const {
  const RefusalCounts& counts = impl_->refusals;
  const auto most = std::max_element(counts.begin(), counts.end());
  const double all = static_cast<double>(std::accumulate(counts.begin(), counts.end(), std::int64_t{0}));
  if (all == 0.0) return "";
  constexpr double kPercent = 100.0;
  return std::string(kRefusals.at(static_cast<size_t>(most - counts.begin()))) + " (" +
         FormatFixed(kPercent * static_cast<double>(*most) / all, 0) + " % of the phases that were not possible)";
}

}  // namespace legopt::worldgen
