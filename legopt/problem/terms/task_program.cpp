#include "legopt/problem/terms/task_program.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>

#include "legopt/dataset/contact.h"
#include "legopt/problem/terms/internal/statics_terms.h"
#include "legopt/problem/terms/internal/transition_terms.h"
#include "legopt/problem/terms/internal/waypoint_terms.h"

namespace legopt {

WaypointProgram::WaypointProgram(const Dataset& dataset, CollisionQuery& query,
                                 std::span<const WaypointConstraints> demands, const ProgramOptions& proximity)
    : dataset_(&dataset), robot_(&dataset.robot()) {
  SetJointBounds(proximity.joint_reserve);
  for (const WaypointConstraints& demand : demands) {
    stances_.push_back(demand.stance != nullptr ? *demand.stance : Stance{});
    states_.emplace_back(*robot_, query, proximity.range_m);
    fixed_.push_back(demand.fixed);
    if (demand.stance != nullptr) AddConstraints(dataset, demand, num_waypoints() - 1, proximity);
  }
}

void WaypointProgram::SetJointBounds(double reserve) {
  constexpr double kLargestShare = 0.25;  // share of a joint's range that the reserve may take at either end
  lower_ = robot_->lower_limits();
  upper_ = robot_->upper_limits();
  for (Eigen::Index i = 0; reserve > 0.0 && i < lower_.size(); ++i) {
    const double kept = std::min(reserve, kLargestShare * (upper_[i] - lower_[i]));
    lower_[i] += kept;
    upper_[i] -= kept;
  }
}

void WaypointProgram::AddConstraints(const Dataset& dataset, const WaypointConstraints& demand, int waypoint,
                                     const ProgramOptions& proximity) {
  WaypointState& state = states_.back();
  const Stance& stance = *demand.stance;
  ContactPoseTerm::Weights weights;
  double margin_m = proximity.margin_m;
  if (demand.fixed) {  // a fixed waypoint only has to be valid
    weights.kept = weights.spent;
    margin_m = proximity.relaxed_margin_m;
  } else if (demand.on_segment) {
    weights.spent = weights.kept;
  }
  for (const ContactTarget& target : stance.contacts) {
    const Contact& contact = dataset.contact(target.contact);
    switch (contact.facts().free_rotation) {
      case FreeRotation::kNone:
        terms_.push_back(std::make_unique<ContactPoseTerm>(waypoint, state, contact.link_index,
                                                           contact.LinkTarget(target), target.contact, weights));
        break;
      case FreeRotation::kAll:
        terms_.push_back(std::make_unique<ContactPointTerm>(waypoint, state, contact, target));
        break;
      case FreeRotation::kAboutNormal:
      case FreeRotation::kAboutBar:
        AddAxis(contact, target, waypoint);
        break;
    }
  }
  if (demand.balanced) {
    terms_.push_back(std::make_unique<ComTerm>(waypoint, state, BalanceEdges(dataset, stance, proximity.physics)));
  }
  if (demand.balanced && proximity.prefer_middle) PreferMiddle(dataset, stance, waypoint);
  if (proximity.physics != Physics::kNone && stance.push_N) {
    terms_.push_back(std::make_unique<PushTerm>(waypoint, state, PushHalfSpaces(dataset, stance)));
  }
  if (proximity.physics == Physics::kEffort) AddTorqueLimits(dataset, stance, waypoint);
  if (proximity.physics == Physics::kEffort && stance.push_N) {
    terms_.push_back(std::make_unique<LoadedPushTerm>(waypoint, state, dataset, stance));
  }
  terms_.push_back(std::make_unique<CollisionTerm>(waypoint, state, margin_m, proximity.relaxed_margin_m));
}

/// A bar that carries is gripped at its target, because the forces of the stance are computed there.
void WaypointProgram::AddAxis(const Contact& contact, const ContactTarget& target, int waypoint) {
  WaypointState& state = states_.back();
  const double slide_m = target.carries ? 0.0 : contact.SlideOf(target);
  terms_.push_back(std::make_unique<ContactAxisTerm>(waypoint, state, contact, target, slide_m));
  if (slide_m > 0.0) {
    terms_.push_back(std::make_unique<ContactSlideTerm>(waypoint, state, contact, target, slide_m));
  }
}

void WaypointProgram::PreferMiddle(const Dataset& dataset, const Stance& stance, int waypoint) {
  constexpr BalanceInset kMiddle = {.most_m = 0.03, .share = 1.5};
  constexpr double kWeight = 5.0;  // per metre
  if (!StandsOnFeet(dataset, stance)) return;
  terms_.push_back(std::make_unique<ComTerm>(waypoint, state(waypoint),
                                             BalanceEdges(dataset, stance, Physics::kBalance, kMiddle), kWeight));
}

void WaypointProgram::AddTorqueLimits(const Dataset& dataset, const Stance& stance, int waypoint) {
  WaypointState& state = states_.back();
  terms_.push_back(std::make_unique<FreeTorqueTerm>(waypoint, state, dataset, stance));
  terms_.push_back(std::make_unique<LoadedTorqueTerm>(waypoint, state, dataset, stance));
}

void WaypointProgram::SetPoint(Eigen::Ref<const Eigen::VectorXd> x) {
  const Eigen::Index size = point_size();
  for (size_t t = 0; t < states_.size(); ++t) states_[t].Update(x.segment(static_cast<Eigen::Index>(t) * size, size));
}

void WaypointProgram::Retract(Eigen::Ref<const Eigen::VectorXd> x, Eigen::Ref<const Eigen::VectorXd> dx,
                              Eigen::Ref<Eigen::VectorXd> x_next) const {
  const Eigen::Index points = point_size();
  const Eigen::Index tangents = tangent_size();
  for (Eigen::Index t = 0; t < num_waypoints(); ++t) {
    if (IsFixed(t)) {
      x_next.segment(t * points, points) = x.segment(t * points, points);
    } else {
      legopt::Retract(x.segment(t * points, points), dx.segment(t * tangents, tangents),
                      x_next.segment(t * points, points));
    }
  }
  ProjectOnBounds(x_next);
}

void WaypointProgram::PullBack(const double* dx, double* row) const {
  constexpr double kSmallAngle = 1e-4;  // below it, the next terms of the series are at most about 1e-16
  const Eigen::Index base = robot_->base_rotation_index();
  const Eigen::Map<const Eigen::Vector3d> phi(dx + base);
  Eigen::Map<Eigen::Vector3d> g(row + base);
  const double angle = phi.norm();
  double first = 0.5;       // (1 - cos angle) / angle^2
  double second = 1.0 / 6;  // (angle - sin angle) / angle^3
  if (angle >= kSmallAngle) {
    first = (1.0 - std::cos(angle)) / (angle * angle);
    second = (angle - std::sin(angle)) / (angle * angle * angle);
  }
  // J^T g with J = I + first [phi]x + second [phi]x^2; the transpose changes the sign of the odd term.
  const Eigen::Vector3d across = phi.cross(g);
  g += second * phi.cross(across) - first * across;
}

void WaypointProgram::StepBounds(Eigen::Ref<const Eigen::VectorXd> x, Eigen::Ref<Eigen::VectorXd> lower,
                                 Eigen::Ref<Eigen::VectorXd> upper) const {
  const Eigen::Index n = robot_->num_dofs();
  lower.setConstant(-std::numeric_limits<double>::infinity());
  upper.setConstant(std::numeric_limits<double>::infinity());
  for (Eigen::Index t = 0; t < num_waypoints(); ++t) {
    if (IsFixed(t)) {
      lower.segment(t * tangent_size(), tangent_size()).setZero();
      upper.segment(t * tangent_size(), tangent_size()).setZero();
      continue;
    }
    const auto joints = x.segment(t * point_size(), n);
    lower.segment(t * tangent_size(), n) = lower_ - joints;
    upper.segment(t * tangent_size(), n) = upper_ - joints;
  }
}

void WaypointProgram::ProjectOnBounds(Eigen::Ref<Eigen::VectorXd> x) const {
  const Eigen::Index n = robot_->num_dofs();
  for (Eigen::Index t = 0; t < num_waypoints(); ++t) {
    if (IsFixed(t)) continue;
    auto joints = x.segment(t * point_size(), n);
    joints = joints.cwiseMax(lower_).cwiseMin(upper_);
  }
}

namespace {

double SumOfWindows(const RobotModel&, std::span<const Eigen::VectorXd>, double window_costs) { return window_costs; }

/// Counts every transition once, although windows share some.
double SumOfTransitions(const RobotModel& robot, std::span<const Eigen::VectorXd> waypoints, double) {
  Eigen::VectorXd difference(robot.tangent_size());
  double cost = 0.0;
  for (std::size_t w = 1; w < waypoints.size(); ++w) {
    ConfigurationDifference(waypoints[w - 1], waypoints[w], difference);
    cost += difference.squaredNorm();
  }
  return cost;
}

/// Inputs for adding the terms of a task to a program.
struct TermInputs {
  const Dataset& dataset;
  CollisionQuery& query;
  const ProgramOptions& proximity;
  std::span<const WaypointConstraints> demands;  ///< one entry per waypoint of the program
};

void AddTorqueCost(const TermInputs&, WaypointProgram& program) {
  for (int t = program.num_waypoints() - 1; t >= 0; --t) {
    program.Prepend(std::make_unique<TorqueCostTerm>(t, program.state(t)));
  }
}

void AddTransitions(const TermInputs& of, WaypointProgram& program) {
  constexpr int kVelocityUnit = 0;
  for (int t = 0; t + 1 < program.num_waypoints(); ++t) {
    WaypointState& from = program.state(t);
    WaypointState& to = program.state(t + 1);
    program.Append(std::make_unique<VelocityCostTerm>(t, kVelocityUnit, from, to));
    if (of.proximity.continuous == ContinuousCollision::kNone) continue;
    const bool preferred = of.proximity.continuous == ContinuousCollision::kPreferred;
    program.Append(std::make_unique<SweptCollisionTerm>(t, from, to, of.dataset.robot(), of.query,
                                                        of.proximity.margin_m, of.proximity.range_m,
                                                        preferred ? of.proximity.continuous_weight : 0.0));
  }
}

/// Adds balance on the planted contacts to a waypoint, if they are fewer than its own: they carry the robot on the
/// adjacent segment. With Physics::kEffort, within effort limits.
void AddBalanceOnSegment(const Dataset& dataset, WaypointProgram& program, int waypoint, const Stance& own,
                         const Stance& planted, const ProgramOptions& proximity) {
  const Physics physics = proximity.segment_physics;
  if (planted.contacts.empty()) return;
  const auto is_own = [&](const ContactTarget& target) {
    return std::ranges::find(own.contacts, target) != own.contacts.end();
  };
  const bool same_size = planted.contacts.size() == own.contacts.size();
  if (same_size && std::ranges::all_of(planted.contacts, is_own)) return;  // same as the waypoint's own constraint
  WaypointState& state = program.state(waypoint);
  program.Append(std::make_unique<ComTerm>(waypoint, state, BalanceEdges(dataset, planted, physics)));
  if (proximity.prefer_middle) program.PreferMiddle(dataset, planted, waypoint);
  if (physics != Physics::kEffort) return;
  program.Append(std::make_unique<FreeTorqueTerm>(waypoint, state, dataset, planted));
  program.Append(std::make_unique<LoadedTorqueTerm>(waypoint, state, dataset, planted));
}

void AddBalancedTransitions(const TermInputs& of, WaypointProgram& program) {
  AddTransitions(of, program);
  for (int t = 0; t + 1 < program.num_waypoints(); ++t) {
    const Stance& from = *of.demands[static_cast<std::size_t>(t)].stance;
    const Stance& to = *of.demands[static_cast<std::size_t>(t) + 1].stance;
    const Stance planted = PlantedContacts(of.dataset, from, to);
    AddBalanceOnSegment(of.dataset, program, t, from, planted, of.proximity);
    AddBalanceOnSegment(of.dataset, program, t + 1, to, planted, of.proximity);
  }
}

/// Windows and terms of a task's programs, without the constraints of the waypoints.
struct TaskTerms {
  Task task{};
  int window_stances = 1;  ///< maximum number of stances in a window
  int window_overlap = 0;  ///< stances shared with the previous window
  decltype(AddTorqueCost)* add_terms = nullptr;
  decltype(SumOfWindows)* solution_cost = nullptr;
};

/// In the order of the enumerators.
constexpr std::array kTaskTerms = {
    TaskTerms{.task = Task::kPosture, .add_terms = AddTorqueCost, .solution_cost = SumOfWindows},
    TaskTerms{.task = Task::kMotion,
              .window_stances = 6,
              .window_overlap = 1,
              .add_terms = AddTransitions,
              .solution_cost = SumOfTransitions},
    TaskTerms{.task = Task::kContinuous,
              .window_stances = 6,
              .window_overlap = 1,
              .add_terms = AddTransitions,
              .solution_cost = SumOfTransitions},
    TaskTerms{.task = Task::kBalanced,
              .window_stances = 6,
              .window_overlap = 1,
              .add_terms = AddBalancedTransitions,
              .solution_cost = SumOfTransitions},
    TaskTerms{.task = Task::kTimed,
              .window_stances = 6,
              .window_overlap = 1,
              .add_terms = AddBalancedTransitions,
              .solution_cost = SumOfTransitions},
};

consteval bool InOrder() {
  for (std::size_t i = 0; i < kTaskTerms.size(); ++i) {
    if (kTaskTerms[i].task != kTasks[i].task) return false;
  }
  return kTaskTerms.size() == kTasks.size();
}
static_assert(InOrder());

const TaskTerms& TermsOf(Task task) { return kTaskTerms.at(static_cast<std::size_t>(task)); }

}  // namespace

std::vector<StanceWindow> StanceWindows(Task task, int num_stances) {
  const TaskTerms& terms = TermsOf(task);
  std::vector<StanceWindow> windows;
  int first = 0;
  do {
    windows.push_back({first, std::min(terms.window_stances, num_stances - first)});
    first += terms.window_stances - terms.window_overlap;
  } while (first + terms.window_overlap < num_stances);
  return windows;
}

std::unique_ptr<WaypointProgram> MakeTaskProgram(Task task, const Dataset& dataset, CollisionQuery& query,
                                                 std::span<const Stance> stances, const ProgramOptions& proximity,
                                                 bool fixed_first) {
  std::vector<WaypointConstraints> demands;
  for (const Stance& stance : stances) {
    demands.insert(demands.end(), static_cast<std::size_t>(DescriptionOf(task).waypoints_per_stance),
                   {.stance = &stance});
  }
  demands.front().fixed = fixed_first;
  auto program = std::make_unique<WaypointProgram>(dataset, query, demands, proximity);
  TermsOf(task).add_terms({dataset, query, proximity, demands}, *program);
  return program;
}

std::unique_ptr<WaypointProgram> MakePathProgram(const Dataset& dataset, CollisionQuery& query,
                                                 std::span<const Stance* const> stances, PathEnds ends, int pieces,
                                                 bool balanced, const ProgramOptions& proximity, double step_m,
                                                 Sweep sweep) {
  constexpr int kVelocityUnit = 0;
  const auto ways = stances.size() - 1;
  std::vector<Stance> planted;
  for (std::size_t w = 0; w < ways; ++w) planted.push_back(PlantedContacts(dataset, *stances[w], *stances[w + 1]));
  const WaypointConstraints fixed = {.stance = nullptr, .fixed = true};
  std::vector<WaypointConstraints> demands = {{.stance = stances.front(), .on_segment = true}};
  for (std::size_t w = 0; w < ways; ++w) {
    const bool has_polygon = !planted[w].contacts.empty();
    demands.insert(demands.end(), static_cast<std::size_t>(pieces) - 1,
                   {.stance = &planted[w], .balanced = balanced && has_polygon, .on_segment = true});
    demands.push_back({.stance = stances[w + 1], .on_segment = true});
  }
  if (!ends.first_moves) demands.front() = fixed;
  if (!ends.last_moves) demands.back() = fixed;
  auto program = std::make_unique<WaypointProgram>(dataset, query, demands, proximity);
  const auto moves = [&](std::size_t w) { return w == 0 ? ends.first_moves : w < ways || ends.last_moves; };
  for (std::size_t w = 0; balanced && w < ways; ++w) {
    for (const std::size_t end : {w, w + 1}) {
      if (!moves(end)) continue;
      AddBalanceOnSegment(dataset, *program, static_cast<int>(end) * pieces, *stances[end], planted[w], proximity);
    }
  }
  for (int t = 0; t + 1 < program->num_waypoints(); ++t) {
    WaypointState& from = program->state(t);
    WaypointState& to = program->state(t + 1);
    program->Append(std::make_unique<VelocityCostTerm>(t, kVelocityUnit, from, to));
    program->Append(std::make_unique<SweptCollisionTerm>(t, from, to, dataset.robot(), query, proximity.margin_m,
                                                         proximity.range_m, 0.0, step_m, sweep));
  }
  return program;
}

double SolutionCost(Task task, const RobotModel& robot, std::span<const Eigen::VectorXd> waypoints,
                    double window_costs) {
  return TermsOf(task).solution_cost(robot, waypoints, window_costs);
}

}  // namespace legopt
