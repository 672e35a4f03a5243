#include "legopt/planning/certify/internal/stance_certifier.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <string>
#include <string_view>
#include <utility>

#include "legopt/geometry/collision_query.h"
#include "legopt/math/blake2b.h"
#include "legopt/math/random_numbers.h"
#include "legopt/problem/terms/initial_guess.h"
#include "legopt/problem/terms/internal/waypoint_terms.h"
#include "legopt/problem/terms/task_program.h"
#include "legopt/robot/configuration.h"
#include "legopt/solvers/sqp_options.h"
#include "legopt/types/check.h"
#include "legopt/types/number_text.h"
#include "legopt/types/result.h"
#include "legopt/types/task.h"

namespace legopt::certify {
namespace {

/// A term without changes.
class ForwardingTerm : public Term {
 public:
  explicit ForwardingTerm(Term& term) : Term(term.shape()), term_(&term) {}

  void RowKeys(int rows, std::vector<int>& keys) override { term_->RowKeys(rows, keys); }
  double AbsentRow() const override { return term_->AbsentRow(); }

 private:
  void ComputeResiduals(std::vector<double>& residuals) override { term_->Evaluate(residuals); }
  void ComputeModel(LinearModel& model) override { term_->Linearize(model); }

  Term* term_;
};

/// Collision either with the scene or between links: rows of the other kind are always satisfied.
class FilteredCollisionTerm : public Term {
 public:
  FilteredCollisionTerm(Term& term, WaypointState& state, bool keeps_scene)
      : Term(term.shape()), term_(&term), state_(&state), keeps_scene_(keeps_scene) {}

  void RowKeys(int rows, std::vector<int>& keys) override { term_->RowKeys(rows, keys); }
  double AbsentRow() const override { return term_->AbsentRow(); }

 private:
  bool Keeps(std::size_t row) const { return (state_->contacts()[row].link_b == kScene) == keeps_scene_; }

  void ComputeResiduals(std::vector<double>& residuals) override {
    const std::size_t first = residuals.size();
    term_->Evaluate(residuals);
    for (std::size_t i = first; i < residuals.size(); ++i) {
      if (!Keeps(i - first)) residuals[i] = AbsentRow();
    }
  }
  void ComputeModel(LinearModel& model) override {
    term_->Linearize(model);
    for (int i = 0; i < model.rows(); ++i) {
      if (Keeps(static_cast<std::size_t>(i))) continue;
      model.value(i) = AbsentRow();
      std::fill_n(model.row(0, i), model.stride(), 0.0);
    }
  }

  Term* term_;
  WaypointState* state_;
  bool keeps_scene_;
};

}  // namespace

StanceProgram::StanceProgram(const Dataset& dataset, CollisionQuery& query, const Stance& stance,
                             const ProgramOptions& proximity, ConstraintGroups left_out)
    : whole_(dataset, query, std::array{WaypointConstraints{.stance = &stance}}, proximity) {
  const bool scene = !left_out.Has(ConstraintGroup::kEnvironment);
  const bool self = !left_out.Has(ConstraintGroup::kSelf);
  for (const auto& term : whole_.terms()) {
    const bool collision = dynamic_cast<const CollisionTerm*>(term.get()) != nullptr;
    const bool balance = dynamic_cast<const ComTerm*>(term.get()) != nullptr;
    if ((balance && left_out.Has(ConstraintGroup::kBalance)) || (collision && !scene && !self)) continue;
    if (collision && scene != self) {
      terms_.push_back(std::make_unique<FilteredCollisionTerm>(*term, whole_.state(0), scene));
    } else {
      terms_.push_back(std::make_unique<ForwardingTerm>(*term));
    }
  }
}

namespace {

using Eigen::VectorXd;

constexpr Task kTaskOfOneStance = Task::kPosture;
constexpr double kPerDegree = M_PI / 180.0;

/// Options of the search: infeasible postures are recognised without large penalties, and without costs nothing
/// improves once the constraints hold.
SqpOptions FeasibilitySqp() {
  SqpOptions options = BestOptions::WideSqp();
  constexpr int kPenalties = 4;
  options.max_penalty_iterations = kPenalties;
  options.stop_when_feasible = FeasibleStop::kAlways;
  return options;
}

/// Options for a start: those with odd numbers use the relaxed margin, because the judge tolerates 1 mm of depth
/// between links.
ProgramOptions ContactsOfStart(int number) {
  ProgramOptions proximity;
  if (number % 2 == 1) proximity.margin_m = proximity.relaxed_margin_m;
  return proximity;
}

double Between(double low, double high, std::mt19937_64& generator) {
  return low + (high - low) * UniformRandom(generator);
}

std::mt19937_64 GeneratorOfStart(const Stance& stance, int number) {
  constexpr std::size_t kDigits = 16;
  constexpr int kHexadecimal = 16;
  const std::string identity = "certify/" + StanceKey(stance) + "/" + std::to_string(number);
  return std::mt19937_64(*ParseInteger<std::uint64_t>(Blake2bHex(identity).substr(0, kDigits), kHexadecimal));
}

void ScatterBase(double height_m, std::mt19937_64& generator, Eigen::Ref<VectorXd> base) {
  constexpr double kSpread = 0.2;
  constexpr double kLowest = 0.5;
  base[0] += Between(-kSpread, kSpread, generator) * height_m;
  base[1] += Between(-kSpread, kSpread, generator) * height_m;
  base[2] -= kGoodSoleHeight_m + Between(0.0, 1.0 - kLowest, generator) * height_m;
  const double yaw = Between(-40.0, 40.0, generator) * kPerDegree;
  const double pitch = Between(-10.0, 40.0, generator) * kPerDegree;
  const double roll = Between(-15.0, 15.0, generator) * kPerDegree;
  const auto parts = MutablePartsOf(base);
  const Eigen::Quaterniond turned = parts.base_quaternion() * Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()) *
                                    Eigen::AngleAxisd(pitch, Eigen::Vector3d::UnitY()) *
                                    Eigen::AngleAxisd(roll, Eigen::Vector3d::UnitX());
  parts.set_base_quaternion(turned);
}

/// Moves all joints by the same random share towards random values within their limits.
void ScatterJoints(const RobotModel& robot, std::mt19937_64& generator, Eigen::Ref<VectorXd> joints) {
  const double share = UniformRandom(generator);
  for (Eigen::Index i = 0; i < joints.size(); ++i) {
    const double low = std::max(robot.lower_limits()[i], -M_PI);
    const double high = std::min(robot.upper_limits()[i], M_PI);
    joints[i] += share * (Between(low, high, generator) - joints[i]);
  }
}

/// Removes the waypoint's number, because there is only one waypoint.
std::string WithoutWaypoint(std::string detail) {
  constexpr std::string_view kWaypoint = "waypoint 0: ";
  if (detail.starts_with(kWaypoint)) detail.erase(0, kWaypoint.size());
  return detail;
}

VectorXd Rounded(const VectorXd& x) {
  // The division gives the same double as reading this many decimals.
  constexpr double kSteps = 1e6;
  static_assert(kSteps * StanceCertifier::kResolution == 1.0);
  return x.unaryExpr([](double value) { return std::round(value * kSteps) / kSteps + 0.0; });  // no -0
}

}  // namespace

std::string Obstruction::Describe() const {
  if (without.empty()) return "feet and joint limits";
  std::string text;
  for (const auto& groups : without) {
    text += text.empty() ? "without " : ", or without ";
    for (std::size_t i = 0; i < groups.size(); ++i) text += (i > 0 ? " and " : "") + std::string(ToString(groups[i]));
  }
  return text;
}

StanceCertifier::StanceCertifier(std::shared_ptr<const Dataset> dataset)
    : dataset_(std::move(dataset)), query_(dataset_->collision_model()), judge_(dataset_), solver_(FeasibilitySqp()) {}

VectorXd StanceCertifier::Start(const Stance& stance, int number) const {
  VectorXd x = InitialGuess(*dataset_, stance, Initialization::kGood);
  if (number == 0) return x;
  std::mt19937_64 generator = GeneratorOfStart(stance, number);
  const int n = dataset_->robot().num_dofs();
  ScatterBase(dataset_->trunk_height_m(), generator, x.tail(x.size() - n));
  ScatterJoints(dataset_->robot(), generator, x.head(n));
  return x;
}

StanceCertifier::Attempt StanceCertifier::Solve(StanceProgram& program, VectorXd& x, const Stop& stop) {
  SolverContext context;
  if (stop) {
    context.stop = [&stop]() -> std::optional<SolveStatus> {
      return stop() ? std::optional(SolveStatus::kCancelled) : std::nullopt;
    };
  }
  const SolverResult result = solver_.Solve(program, x, context);
  const bool finite = result.value.IsFinite();
  return {finite ? result.value.max_violation : std::numeric_limits<double>::infinity(), finite && result.feasible,
          IsStopped(result.status)};
}

Evaluation StanceCertifier::JudgePosture(const Stance& stance, const VectorXd& x) {
  const ProblemDefinition problem{.id = 0, .stances = {stance}};
  return judge_.Evaluate(kTaskOfOneStance, problem, std::span(&x, 1));
}

bool StanceCertifier::Accepts(const Stance& stance, const VectorXd& x) {
  const Evaluation evaluation = JudgePosture(stance, x);
  return evaluation.literal == Verdict::kSuccess && evaluation.strict == Verdict::kSuccess;
}

std::optional<FoundPosture> StanceCertifier::Search(const Stance& stance, int first, int last, const Stop& stop) {
  std::array programs = {StanceProgram(*dataset_, query_, stance, ContactsOfStart(0)),
                         StanceProgram(*dataset_, query_, stance, ContactsOfStart(1))};
  for (int number = first; number < last; ++number) {
    if (stop && stop()) return std::nullopt;
    VectorXd x = Start(stance, number);
    if (Solve(programs.at(static_cast<std::size_t>(number) % programs.size()), x, stop).stopped) return std::nullopt;
    x = Rounded(x);
    if (Accepts(stance, x)) return FoundPosture{std::move(x), number};
  }
  return std::nullopt;
}

std::optional<FoundPosture> StanceCertifier::SearchFrom(const Stance& stance, std::span<const VectorXd> starts,
                                                        const Stop& stop) {
  StanceProgram program(*dataset_, query_, stance, ContactsOfStart(1));
  for (std::size_t i = 0; i < starts.size(); ++i) {
    if (stop && stop()) return std::nullopt;
    VectorXd x = starts[i];
    if (Solve(program, x, stop).stopped) return std::nullopt;
    x = Rounded(x);
    if (Accepts(stance, x)) return FoundPosture{std::move(x), static_cast<int>(i)};
  }
  return std::nullopt;
}

bool StanceCertifier::FindsWithout(const Stance& stance, ConstraintGroups left_out, int starts, const Stop& stop) {
  StanceProgram program(*dataset_, query_, stance, ContactsOfStart(1), left_out);
  for (int number = 0; number < starts; ++number) {
    if (stop && stop()) return false;
    VectorXd x = Start(stance, number);
    if (Solve(program, x, stop).feasible) return true;
  }
  return false;
}

std::string StanceCertifier::Nearest(const Stance& stance, int starts, const Stop& stop) {
  StanceProgram program(*dataset_, query_, stance, ContactsOfStart(1));
  VectorXd nearest;
  double violation = std::numeric_limits<double>::infinity();
  for (int number = 0; number < starts; ++number) {
    if (stop && stop()) return {};
    VectorXd x = Start(stance, number);
    const Attempt attempt = Solve(program, x, stop);
    if (attempt.violation >= violation) continue;
    violation = attempt.violation;
    nearest = x;
  }
  return nearest.size() == 0 ? std::string() : WithoutWaypoint(JudgePosture(stance, nearest).detail);
}

Obstruction StanceCertifier::Explain(const Stance& stance, int starts, const Stop& stop) {
  using enum ConstraintGroup;
  static const std::vector<std::vector<std::vector<ConstraintGroup>>> kSetsBySize = {
      {{kBalance}, {kSelf}, {kEnvironment}},
      {{kBalance, kSelf}, {kBalance, kEnvironment}, {kSelf, kEnvironment}},
      {{kBalance, kSelf, kEnvironment}}};
  Obstruction obstruction;
  obstruction.nearest = Nearest(stance, starts, stop);
  for (const auto& sets : kSetsBySize) {
    for (const auto& groups : sets) {
      ConstraintGroups left_out;
      for (const ConstraintGroup group : groups) left_out.Add(group);
      if (FindsWithout(stance, left_out, starts, stop)) obstruction.without.push_back(groups);
    }
    if (!obstruction.without.empty()) break;
  }
  return obstruction;
}

}  // namespace legopt::certify
