#include "legopt/terms/task_program.h"

#include <algorithm>
#include <array>
#include <cstddef>

#include "legopt/terms/swept_collision_term.h"
#include "legopt/terms/velocity_term.h"
#include "legopt/terms/waypoint_terms.h"

namespace legopt {
namespace {

double SumOfWindows(const RobotModel&, std::span<const Eigen::VectorXd>, double window_costs) { return window_costs; }

/// Of all transitions once: windows share some.
double SumOfTransitions(const RobotModel& robot, std::span<const Eigen::VectorXd> waypoints, double) {
  Eigen::VectorXd difference(robot.tangent_size());
  double cost = 0.0;
  for (std::size_t w = 1; w < waypoints.size(); ++w) {
    ConfigurationDifference(robot, waypoints[w - 1], waypoints[w], difference);
    cost += difference.squaredNorm();
  }
  return cost;
}

/// What a task's programs consist of beyond the constraints of their waypoints.
struct TaskTerms {
  Task task{};
  int window_stances = 1;  ///< at most
  int window_overlap = 0;  ///< stances shared with the window before
  void (*add_terms)(const Dataset&, CollisionQuery&, const ContactOptions&, WaypointProgram&) = nullptr;
  decltype(SumOfWindows)* solution_cost = nullptr;
};

void AddTorqueCost(const Dataset&, CollisionQuery&, const ContactOptions&, WaypointProgram& program) {
  for (int t = program.num_waypoints() - 1; t >= 0; --t) {
    program.Prepend(std::make_unique<TorqueCostTerm>(t, program.state(t)));
  }
}

void AddTransitions(const Dataset& dataset, CollisionQuery& query, const ContactOptions& contacts,
                    WaypointProgram& program) {
  constexpr int kVelocityUnit = 0;
  for (int t = 0; t + 1 < program.num_waypoints(); ++t) {
    WaypointState& from = program.state(t);
    WaypointState& to = program.state(t + 1);
    program.Append(std::make_unique<VelocityCostTerm>(t, kVelocityUnit, from, to));
    if (contacts.continuous == ContinuousCollision::kNone) continue;
    const double weight = contacts.continuous == ContinuousCollision::kPreferred ? contacts.continuous_weight : 0.0;
    program.Append(std::make_unique<SweptCollisionTerm>(t, from, to, dataset.robot(), query, contacts.margin_m,
                                                        contacts.range_m, weight));
  }
}

/// In the order of the enumerators.
constexpr std::array kTaskTerms = {
    TaskTerms{.task = Task::kPosture, .add_terms = AddTorqueCost, .solution_cost = SumOfWindows},
    TaskTerms{.task = Task::kMotion,
              .window_stances = 6,
              .window_overlap = 1,
              .add_terms = AddTransitions,
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
                                                 std::span<const Stance> stances, const ContactOptions& contacts,
                                                 bool fixed_first) {
  std::vector<const Stance*> per_waypoint;
  for (const Stance& stance : stances) {
    per_waypoint.insert(per_waypoint.end(), static_cast<std::size_t>(DescriptionOf(task).waypoints_per_stance),
                        &stance);
  }
  auto program = std::make_unique<WaypointProgram>(dataset, query, per_waypoint, contacts, fixed_first);
  TermsOf(task).add_terms(dataset, query, contacts, *program);
  return program;
}

double SolutionCost(Task task, const RobotModel& robot, std::span<const Eigen::VectorXd> waypoints,
                    double window_costs) {
  return TermsOf(task).solution_cost(robot, waypoints, window_costs);
}

}  // namespace legopt
