#include "client/report/push_report.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>

#include "client/report/motion_path.h"
#include "client/report/solution_items.h"
#include "legopt/judge/judge.h"
#include "legopt/math/parallel.h"
#include "legopt/robot/kinematics.h"
#include "legopt/statics/stance_forces.h"
#include "legopt/statics/static_equilibrium.h"

namespace legopt::client {
namespace {

/// Judges solutions and computes efforts and pushes of postures. A workspace: not thread-safe.
class PushMeter {
 public:
  explicit PushMeter(const Dataset& dataset)
      : dataset_(dataset),
        judge_({std::shared_ptr<void>(), &dataset}),  // owns nothing: the dataset outlives this object
        kinematics_(dataset_.robot()),
        equilibrium_(dataset_.robot(), dataset_.gravity_m_s2()) {}

  Verdict Judge(Task task, const SolutionItem& item) {
    return judge_.Evaluate(task, *item.problem, item.solution->waypoints).physical;
  }

  /// Raises the effort of a solution to that of another waypoint, and reduces its pushes.
  void Add(const Stance& stance, Eigen::VectorXd x, int waypoint, PushedSolution* result) {
    dataset_.robot().ClampJoints(x);
    kinematics_.Update(x);
    const StanceForces forces(SurfacesOf(dataset_, stance, &kinematics_));
    const double share = equilibrium_.ComputeTorqueRatio(forces, kinematics_).ratio;
    result->effort_share = std::max(result->effort_share, share);
    const DirectedPushes all_N = equilibrium_.ResistedPushes_N(forces, kinematics_, PushLimits::kContactsAndEfforts);
    const DirectedPushes contacts_N = equilibrium_.ResistedPushes_N(forces, kinematics_, PushLimits::kContacts);
    const auto least = std::ranges::min_element(all_N);
    if (waypoint == 0 || *least < result->push_N) {
      constexpr int kDirectionStep_deg = 360 / kPushDirections;
      result->push_N = *least;
      result->waypoint = waypoint;
      result->direction_deg = static_cast<int>(least - all_N.begin()) * kDirectionStep_deg;
    }
    const double contacts = std::ranges::min(contacts_N);
    result->contacts_N = waypoint == 0 ? contacts : std::min(result->contacts_N, contacts);
  }

  double weight_N() const { return dataset_.robot().total_mass() * dataset_.gravity_m_s2(); }

 private:
  const Dataset& dataset_;
  legopt::Judge judge_;
  Kinematics kinematics_;
  StaticEquilibrium equilibrium_;
};

bool IsHeld(const PushedSolution& solution) { return solution.fault.empty() && std::isfinite(solution.push_N); }

/// Returns the reason why points are no configurations with a pose, or an empty text.
std::string FaultOf(const TimedPath& path, int size) {
  for (const std::size_t w : path.waypoints) {
    const Eigen::VectorXd& x = path.points[w];
    const bool has_pose = x.size() == size && x.allFinite() && !x.tail<4>().isZero(0.0);
    if (!has_pose) return "point " + std::to_string(w) + " is not " + std::to_string(size) + " finite numbers";
  }
  return "";
}

PushedSolution Push(const SolutionItem& item, Task task, int size, PushMeter* meter) {
  const auto& stances = item.problem->stances;
  PushedSolution pushed{.method = item.solution->method,
                        .problem_id = item.problem->id,
                        .num_waypoints = NumWaypoints(task, static_cast<int>(stances.size())),
                        .fault = "",
                        .weight_N = meter->weight_N(),
                        .asked_N = {}};
  for (const Stance& stance : stances) {
    if (stance.push_N) pushed.asked_N = std::max(pushed.asked_N.value_or(0.0), *stance.push_N);
  }
  const MotionPath solution = ReadMotionPath(task, *item.problem, *item.solution, size);
  const TimedPath& path = solution.path;
  pushed.fault = solution.fault;
  if (pushed.fault.empty()) pushed.fault = FaultOf(path, size);
  if (!pushed.fault.empty()) return pushed;
  pushed.verdict = meter->Judge(task, item);
  for (int w = 0; w < pushed.num_waypoints; ++w) {
    const Stance& stance = stances[static_cast<std::size_t>(StanceOfWaypoint(task, w))];
    meter->Add(stance, path.points[path.waypoints[static_cast<std::size_t>(w)]], w, &pushed);
  }
  return pushed;
}

}  // namespace

std::vector<PushedSolution> PushSolutions(const SolutionFile& file, const Dataset& dataset, int threads) {
  const std::vector<SolutionItem> items = SolutionItems(file, dataset);
  for (const SolutionItem& item : items) {
    for (const Stance& stance : item.problem->stances) {
      for (const ContactTarget& target : stance.contacts) dataset.contact(target.contact);  // throws if unknown
    }
  }
  std::vector<std::unique_ptr<PushMeter>> meters;
  for (int k = 0; k < threads; ++k) meters.push_back(std::make_unique<PushMeter>(dataset));
  std::vector<PushedSolution> pushed(items.size());
  ForEachIndex(threads, items.size(), [&](int worker, std::size_t i) {
    pushed[i] =
        Push(items[i], file.task, dataset.robot().configuration_size(), meters[static_cast<std::size_t>(worker)].get());
  });
  return pushed;
}

Listing ListingOf(const std::vector<PushedSolution>& solutions) {
  Listing listing;
  listing.columns = {"method",       "problem",    "waypoints", "verdict",  "effort_share",  "push_N",
                     "push_weights", "contacts_N", "asked_N",   "waypoint", "direction_deg", "fault"};
  for (const PushedSolution& solution : solutions) {
    std::vector<nlohmann::json>& row = listing.rows.emplace_back();
    row = {solution.method, solution.problem_id, solution.num_waypoints};
    row.resize(listing.columns.size());
    if (solution.asked_N) row[8] = *solution.asked_N;
    if (!solution.fault.empty()) {
      row.back() = solution.fault;
      continue;
    }
    row[3] = ToString(solution.verdict);
    row[4] = FiniteOrNull(solution.effort_share);
    row[5] = FiniteOrNull(solution.push_N);
    row[6] = FiniteOrNull(solution.push_N / solution.weight_N);
    row[7] = FiniteOrNull(solution.contacts_N);
    row[9] = solution.waypoint;
    if (std::isfinite(solution.push_N)) row[10] = solution.direction_deg;
  }
  return listing;
}

Listing SummaryOf(const std::vector<PushedSolution>& solutions) {
  struct Sum {
    int solutions = 0, solved = 0;
    std::vector<double> shares, pushes_N, weights, contacts_N;
  };
  std::map<std::string, Sum> sums;
  for (const PushedSolution& solution : solutions) {
    Sum& sum = sums[solution.method];
    ++sum.solutions;
    if (solution.fault.empty() && solution.verdict == Verdict::kSuccess) ++sum.solved;
    if (!IsHeld(solution)) continue;
    sum.shares.push_back(solution.effort_share);
    sum.pushes_N.push_back(solution.push_N);
    sum.weights.push_back(solution.push_N / solution.weight_N);
    sum.contacts_N.push_back(solution.contacts_N);
  }
  Listing listing;
  listing.columns = {"method",
                     "solutions",
                     "solved",
                     "held",
                     "median_effort_share",
                     "largest_effort_share",
                     "least_N",
                     "median_N",
                     "median_weights",
                     "median_contacts_N"};
  for (const auto& [method, sum] : sums) {
    nlohmann::json largest, least;
    if (!sum.pushes_N.empty()) {
      largest = std::ranges::max(sum.shares);
      least = std::ranges::min(sum.pushes_N);
    }
    listing.rows.push_back({method, sum.solutions, sum.solved, sum.pushes_N.size(), MedianOrNull(sum.shares), largest,
                            least, MedianOrNull(sum.pushes_N), MedianOrNull(sum.weights),
                            MedianOrNull(sum.contacts_N)});
  }
  return listing;
}

}  // namespace legopt::client
