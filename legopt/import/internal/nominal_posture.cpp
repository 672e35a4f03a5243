#include "legopt/import/internal/nominal_posture.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "legopt/geometry/collision_query.h"
#include "legopt/import/internal/standing_stage.h"
#include "legopt/judge/judge.h"
#include "legopt/problem/terms/initial_guess.h"
#include "legopt/problem/terms/task_program.h"
#include "legopt/robot/configuration.h"
#include "legopt/robot/kinematics.h"
#include "legopt/solvers/methods/method.h"

namespace legopt {
namespace {

constexpr double kBend = 0.12;         // share of its length by which a leg is shortened
constexpr double kHeightWeight = 3.0;  // residual of a base that is not lowered
constexpr double kTiltWeight = 2.0;    // per rad
constexpr double kPlaceWeight = 2.0;   // per leg length
constexpr int kStartsPerBend = 4;

/// Cost: weighted difference from a reference configuration with an upright base.
class ReferenceCostTerm : public Term {
 public:
  struct Weights {
    double horizontal;  ///< per m
    double vertical;    ///< per m
  };

  ReferenceCostTerm(WaypointState& state, const Eigen::VectorXd& reference, const Weights& weights)
      : Term({"reference", TermKind::kCost, 0, 1}), state_(&state), reference_(reference), weights_(weights) {}

 private:
  Eigen::Quaterniond BaseRotation() const {
    Eigen::Quaterniond q = PartsOf(state_->configuration()).base_rotation();
    if (q.w() < 0.0) q.coeffs() *= -1.0;
    return q;
  }

  Eigen::VectorXd Residuals() const {
    const auto x = PartsOf(state_->configuration());
    const auto goal = PartsOf(reference_);
    const Eigen::Index n = x.num_joints();
    Eigen::VectorXd r(n + 6);
    r.head(n) = x.joints() - goal.joints();
    r.segment<3>(n) = PlaceWeights().cwiseProduct(x.base_position() - goal.base_position());
    r.tail<3>() = 2.0 * kTiltWeight * BaseRotation().vec();
    return r;
  }

  Eigen::Vector3d PlaceWeights() const { return {weights_.horizontal, weights_.horizontal, weights_.vertical}; }

  void ComputeResiduals(std::vector<double>& residuals) override {
    const Eigen::VectorXd r = Residuals();
    residuals.insert(residuals.end(), r.begin(), r.end());
  }

  void ComputeModel(LinearModel& model) override {
    const Eigen::VectorXd r = Residuals();
    const auto size = static_cast<int>(r.size());
    const int n = size - 6;
    model.Reset(size, size, 1);
    const Eigen::Quaterniond q = BaseRotation();
    Eigen::Matrix3d turn = q.w() * Eigen::Matrix3d::Identity();  // twice the derivative of the vector part: w I - [e]x
    turn(0, 1) += q.z();
    turn(0, 2) -= q.y();
    turn(1, 0) -= q.z();
    turn(1, 2) += q.x();
    turn(2, 0) += q.y();
    turn(2, 1) -= q.x();
    for (int i = 0; i < size; ++i) {
      model.value(i) = r[i];
      if (i < n) model.row(0, i)[i] = 1.0;
      if (i >= n && i < n + 3) model.row(0, i)[i] = PlaceWeights()[i - n];
      for (int j = 0; i >= n + 3 && j < 3; ++j) model.row(0, i)[n + 3 + j] = kTiltWeight * turn(i - n - 3, j);
    }
  }

  WaypointState* state_;
  Eigen::VectorXd reference_;
  Weights weights_;
};

/// The joints that move a contact, from the base outwards, and the length of the chain.
struct Leg {
  std::vector<int> bodies;
  Eigen::Vector3d hip_B = Eigen::Vector3d::Zero();  ///< origin of the first joint, in the base frame
  double length_m = 0.0;                            ///< along the joints' origins, from the first to the contact
  double distance_m = 0.0;                          ///< distance of the first joint from the contact
};

Leg LegOf(const Dataset& stage, const Contact& contact, const Kinematics& kinematics) {
  const RobotModel& robot = stage.robot();
  Leg leg;
  leg.bodies = robot.body_chain(robot.link_body(contact.link_index));
  const Eigen::Vector3d foot = kinematics.link_pose(contact.link_index) * contact.X_LC.translation();
  std::vector<Eigen::Vector3d> places;
  for (const int body : leg.bodies) {
    const Joint& joint = robot.joints()[static_cast<std::size_t>(robot.body_joint(body))];
    places.push_back(kinematics.link_pose(joint.child_link).translation());
  }
  places.push_back(foot);
  for (std::size_t i = 1; i < places.size(); ++i) leg.length_m += (places[i] - places[i - 1]).norm();
  leg.hip_B = places.front();
  leg.distance_m = (foot - places.front()).norm();
  return leg;
}

/// Search on one stage.
class NominalSearch {
 public:
  NominalSearch(const std::shared_ptr<const Dataset>& stage, const Eigen::VectorXd& reference)
      : stage_(stage),
        reference_(reference),
        query_(stage->collision_model(SceneRepresentation::kSolid, PairSelection::kAll)),
        judge_(stage),
        solver_(MakeSolver(Method::Of("sqp"))) {
    Kinematics kinematics(stage->robot());
    kinematics.UpdatePoses(reference_);
    double lowest = std::numeric_limits<double>::infinity(), needed_m = 0.0;
    for (const Contact& contact : stage->feet()) {
      legs_.push_back(LegOf(*stage, contact, kinematics));
      lowest = std::min(
          lowest, contact.facts().shape == ContactShape::kBall
                      ? (kinematics.link_pose(contact.link_index) * contact.X_LC).translation().z() - contact.radius_m
                      : (kinematics.link_pose(contact.link_index) * contact.X_LC).translation().z());
      needed_m = std::max(needed_m, legs_.back().distance_m - (1.0 - kBend) * legs_.back().length_m);
      length_m_ = std::max(length_m_, legs_.back().length_m);
    }
    MutablePartsOf(reference_).base_position().z() = -lowest - needed_m;
  }

  std::optional<Eigen::VectorXd> Search() {
    // Feet may be too large to stand below their hips.
    constexpr std::array<std::optional<double>, 4> kSpreads = {std::nullopt, 1.0, 1.5, 2.2};
    for (const std::optional<double> spread : kSpreads) {
      std::optional<Eigen::VectorXd> best;
      double best_cost = std::numeric_limits<double>::infinity();
      const Stance stance = StanceOf(spread);
      for (const double bend : {0.0, 1.0, -1.0}) {
        for (int attempt = 0; attempt < kStartsPerBend; ++attempt) {
          Eigen::VectorXd x = Start(bend, attempt);
          const std::optional<double> cost = Solve(stance, attempt, &x);
          if (!cost || !(*cost < best_cost) || !Stands(stance, x)) continue;
          best = x;
          best_cost = *cost;
        }
      }
      if (best) return best;
    }
    return {};
  }

 private:
  /// Returns contacts below their places in the reference or, with `spread`, below the first joints of their legs, this
  /// many times as far from their mean.
  Stance StanceOf(std::optional<double> spread) const {
    Stance stance = StanceBelow(*stage_, reference_, StandingFrame(false));
    if (!spread) return stance;
    Eigen::Vector2d mean = Eigen::Vector2d::Zero();
    for (const Leg& leg : legs_) mean += leg.hip_B.head<2>() / static_cast<double>(legs_.size());
    for (std::size_t i = 0; i < legs_.size(); ++i) {
      stance.contacts[i].position.head<2>() = mean + *spread * (legs_[i].hip_B.head<2>() - mean);
    }
    return stance;
  }

  /// Returns the reference, lowered, with the pitch joints of all legs bent by half a radian and random noise.
  Eigen::VectorXd Start(double bend, int attempt) {
    constexpr double kAngle_rad = 0.5, kNoise_rad = 0.2;
    const RobotModel& robot = stage_->robot();
    Kinematics kinematics(robot);
    kinematics.UpdatePoses(reference_);
    Eigen::VectorXd x = reference_;
    for (const Leg& leg : legs_) {
      std::vector<int> pitch;  // degrees of freedom that turn about the robot's y axis
      for (const int body : leg.bodies) {
        const Joint& joint = robot.joints()[static_cast<std::size_t>(robot.body_joint(body))];
        const Eigen::Vector3d axis = kinematics.link_pose(joint.child_link).linear() * joint.axis;
        constexpr double kParallel = 0.9;
        if (joint.dof >= 0 && std::abs(axis.y()) > kParallel)
          pitch.push_back(axis.y() > 0 ? joint.dof : -joint.dof - 1);
      }
      constexpr std::array kShares = {-1.0, 2.0, -1.0};
      for (std::size_t i = 0; pitch.size() >= 2 && i < std::min(pitch.size(), kShares.size()); ++i) {
        const int dof = pitch[i] >= 0 ? pitch[i] : -pitch[i] - 1;
        x[dof] += (pitch[i] >= 0 ? 1.0 : -1.0) * bend * kAngle_rad * kShares.at(i);
      }
    }
    if (attempt > 0) {
      std::mt19937_64 generator(static_cast<std::uint64_t>(attempt));
      PerturbJoints(robot, generator, kNoise_rad, x);
    }
    robot.ClampJoints(x);
    return x;
  }

  /// Solves from `x`, which becomes the solution. Returns its cost; nothing if it is infeasible.
  std::optional<double> Solve(const Stance& stance, int attempt, Eigen::VectorXd* x) {
    const WaypointConstraints constraints{.stance = &stance};
    WaypointProgram program(*stage_, query_, {&constraints, 1}, {});
    const double lowered_m = kBend * length_m_;
    program.Prepend(std::make_unique<ReferenceCostTerm>(
        program.state(0), reference_,
        ReferenceCostTerm::Weights{.horizontal = kPlaceWeight / length_m_, .vertical = kHeightWeight / lowered_m}));
    std::mt19937_64 generator(static_cast<std::uint64_t>(attempt));
    const SolverResult result = solver_->Solve(program, *x, {.stop = {}, .generator = &generator});
    if (!result.feasible) return {};
    return result.value.cost;
  }

  bool Stands(const Stance& stance, const Eigen::VectorXd& x) {
    const ProblemDefinition problem{.id = 0, .stances = {stance}};
    return judge_.Evaluate(Task::kPosture, problem, {&x, 1}).solid == Verdict::kSuccess;
  }

  std::shared_ptr<const Dataset> stage_;
  Eigen::VectorXd reference_;
  CollisionQuery query_;
  Judge judge_;
  std::unique_ptr<Solver> solver_;
  std::vector<Leg> legs_;  ///< per contact
  double length_m_ = 0.0;  ///< length of the longest leg
};

}  // namespace

StopCheck StopOfLarge(const RobotModel& robot) {
  if (robot.num_dofs() <= kManyDofs) return {};
  return [iterations = 0]() mutable -> std::optional<SolveStatus> {
    constexpr int kMost = 10;
    return ++iterations > kMost ? std::optional(SolveStatus::kEffortLimit) : std::nullopt;
  };
}

std::optional<Eigen::VectorXd> FindNominalPosture(const std::shared_ptr<const Dataset>& stage,
                                                  const Eigen::VectorXd& reference) {
  if (stage->robot().num_dofs() > kManyDofs) return {};
  return NominalSearch(stage, reference).Search();
}

}  // namespace legopt
