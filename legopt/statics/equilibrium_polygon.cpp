#include "legopt/statics/equilibrium_polygon.h"

#include <algorithm>
#include <cmath>

#include "legopt/dataset/contact.h"
#include "legopt/statics/internal/linear_program.h"
#include "legopt/statics/internal/support_search.h"

namespace legopt {
namespace {

constexpr int kFixedRows = 4;  // three forces, and the moment about their sum
constexpr int kReachRows = 2;

/// Searches extreme positions of the centre of mass, where forces of the sum `total` (weight; vertical part 1) act.
class PositionProgram {
 public:
  PositionProgram(const StanceForces& forces, const Eigen::Vector3d& total)
      : forces_(forces), num_generators_(forces.num_generators()) {
    const auto num_bounds = static_cast<Eigen::Index>(forces.bounds().size());
    const Eigen::Index rows = kFixedRows + kReachRows + num_bounds;
    A_.setZero(rows, num_generators_ + kReachRows + num_bounds);
    b_.setZero(rows);
    upper_.setConstant(A_.cols(), LinearProgramSolver::kInfinity);
    upper_.head(num_generators_) = forces.upper();
    A_.topLeftCorner(3, num_generators_) = forces.directions();
    A_.row(3).head(num_generators_) = total.transpose() * forces.moments();
    b_.head<3>() = total;
    const double reach_m = std::max(kPolygonReach_m, forces.com_reach_m());
    // position + slack = reach, with slack in [0, 2 reach]
    A_.row(4).head(num_generators_) = -forces.moments().row(1);
    A_.row(5).head(num_generators_) = forces.moments().row(0);
    for (Eigen::Index i = 0; i < kReachRows; ++i) {
      A_(kFixedRows + i, num_generators_ + i) = 1.0;
      b_[kFixedRows + i] = reach_m;
      upper_[num_generators_ + i] = 2.0 * reach_m;
    }
    for (Eigen::Index i = 0; i < num_bounds; ++i) AddBound(i);
    status_ = solver_.Constrain(A_, b_, upper_);
  }

  LinearProgramStatus status() const { return status_; }
  const Eigen::VectorXd& multipliers() const { return solver_.multipliers(); }

  /// Returns the furthest position in a direction, with the multipliers of the program; empty if it was not found.
  std::optional<Extreme> Furthest(const Eigen::Vector2d& direction) {
    cost_.setZero(A_.cols());
    cost_.head(num_generators_) =
        (direction.x() * forces_.moments().row(1) - direction.y() * forces_.moments().row(0)).transpose();
    if (solver_.Minimize(cost_) != LinearProgramStatus::kOptimal) return std::nullopt;
    const Eigen::Vector3d moment = forces_.moments() * solver_.x().head(num_generators_);
    return Extreme{direction, Eigen::Vector2d(-moment.y(), moment.x())};
  }

 private:
  void AddBound(Eigen::Index index) {
    const StanceForces::NormalBound& bound = forces_.bounds()[static_cast<size_t>(index)];
    const Eigen::Index row = kFixedRows + kReachRows + index;
    for (int l = 0; l < num_generators_; ++l) {
      if (forces_.surface_of(l) == bound.surface) A_(row, l) = 1.0;
    }
    A_(row, num_generators_ + kReachRows + index) = 1.0;
    b_[row] = bound.maximum;
  }

  const StanceForces& forces_;
  int num_generators_;
  Eigen::MatrixXd A_;
  Eigen::VectorXd b_, upper_, cost_;
  LinearProgramSolver solver_;
  LinearProgramStatus status_ = LinearProgramStatus::kStalled;
};

/// Returns the generators whose forces have no bound.
std::vector<int> FreeGenerators(const StanceForces& forces) {
  std::vector<int> free;
  for (int l = 0; l < forces.num_generators(); ++l) {
    const bool bounded = std::ranges::any_of(
        forces.bounds(), [&](const StanceForces::NormalBound& bound) { return bound.surface == forces.surface_of(l); });
    if (!bounded && !std::isfinite(forces.upper()[l])) free.push_back(l);
  }
  return free;
}

std::optional<SlideProof> ProofOf(const StanceForces& forces, const Eigen::VectorXd& multipliers) {
  const Eigen::Vector4d y = multipliers.head<kFixedRows>();
  const double scale = y.cwiseAbs().maxCoeff();
  if (!(scale > 0.0)) return std::nullopt;
  const SlideProof proof = CheckedProof(forces, y.head<3>() / scale, y[3] / scale);
  return IsProof(proof) ? std::optional(proof) : std::nullopt;
}

/// Returns the corners of all positions of a program that has some.
std::vector<Eigen::Vector2d> CornersOf(PositionProgram* program, const StanceForces& forces, double accuracy_m) {
  const auto furthest = [program](const Eigen::Vector2d& direction) { return program->Furthest(direction); };
  std::vector<Eigen::Vector2d> positions;
  for (const Extreme& extreme : SearchExtremes(furthest, accuracy_m)) {
    positions.push_back(extreme.position + forces.origin_W().head<2>());
  }
  return ConvexHull2d(std::move(positions));
}

}  // namespace

SlideProof CheckedProof(const StanceForces& forces, const Eigen::Vector3d& direction, double turn) {
  SlideProof proof{
      .direction = direction, .turn = turn, .margin = direction.z(), .largest = -LinearProgramSolver::kInfinity};
  std::vector<double> largest_of_bound(forces.bounds().size(), 0.0);
  for (int l = 0; l < forces.num_generators(); ++l) {
    const double product = direction.dot(forces.directions().col(l)) + turn * forces.moments()(2, l);
    if (std::isfinite(forces.upper()[l])) {
      proof.margin -= forces.upper()[l] * std::max(0.0, product);
      continue;
    }
    const int surface = forces.surface_of(l);
    const auto bound = std::find_if(forces.bounds().begin(), forces.bounds().end(),
                                    [&](const StanceForces::NormalBound& b) { return b.surface == surface; });
    if (bound == forces.bounds().end()) {
      proof.largest = std::max(proof.largest, product);
    } else {
      double& largest = largest_of_bound[static_cast<size_t>(bound - forces.bounds().begin())];
      largest = std::max(largest, product);
    }
  }
  for (size_t i = 0; i < largest_of_bound.size(); ++i) proof.margin -= forces.bounds()[i].maximum * largest_of_bound[i];
  return proof;
}

std::vector<Eigen::Vector2d> BalancePolygon(const Dataset& dataset, const Stance& stance) {
  if (StandsOnFeet(dataset, stance)) return TargetSupportPolygon(dataset, stance);
  return ComputeEquilibriumPolygon(StanceForces(SurfacesOf(dataset, stance))).corners;
}

bool IsProof(const SlideProof& proof) { return proof.largest <= kProofRounding && proof.margin >= kProofMargin; }

EquilibriumPolygon ComputeEquilibriumPolygon(const StanceForces& forces) {
  PositionProgram program(forces, Eigen::Vector3d::UnitZ());
  EquilibriumPolygon result;
  if (program.status() == LinearProgramStatus::kOptimal)
    result.corners = CornersOf(&program, forces, kPolygonAccuracy_m);
  if (program.status() == LinearProgramStatus::kInfeasible) result.slide = ProofOf(forces, program.multipliers());
  return result;
}

bool IsUnbounded(const StanceForces& forces) {
  constexpr double kLeast_m = 1e-6;  // movement of the centre of mass by forces that sum up to one weight
  constexpr Eigen::Index kRows = 5;
  const std::vector<int> free = FreeGenerators(forces);
  const auto columns = static_cast<Eigen::Index>(free.size());
  const auto lifts = [&](int l) { return forces.directions()(2, l) > 0.0; };
  if (std::ranges::all_of(free, lifts)) return false;  // their sum cannot vanish, as on level ground
  Eigen::MatrixXd A(kRows, columns), positions(2, columns);
  for (Eigen::Index i = 0; i < columns; ++i) {
    const int l = free[static_cast<size_t>(i)];
    A.col(i) << forces.directions().col(l), forces.moments()(2, l), 1.0;
    positions.col(i) << -forces.moments()(1, l), forces.moments()(0, l);
  }
  const Eigen::VectorXd b = Eigen::VectorXd::Unit(kRows, kRows - 1);
  LinearProgramSolver solver;
  if (solver.Constrain(A, b, Eigen::VectorXd::Constant(columns, LinearProgramSolver::kInfinity)) !=
      LinearProgramStatus::kOptimal) {
    return false;
  }
  for (const Eigen::Vector2d& direction : AxisDirections()) {
    const Eigen::VectorXd cost = -positions.transpose() * direction;
    const bool moves = solver.Minimize(cost) == LinearProgramStatus::kOptimal && solver.objective() < -kLeast_m;
    if (moves) return !ComputeEquilibriumPolygon(forces).corners.empty();
  }
  return false;
}

std::vector<Eigen::Vector2d> ComputePushPolygon(const StanceForces& forces, const Eigen::Vector2d& push) {
  PositionProgram program(forces, Eigen::Vector3d(-push.x(), -push.y(), 1.0));
  if (program.status() != LinearProgramStatus::kOptimal) return {};
  return CornersOf(&program, forces, kPushPolygonAccuracy_m);
}

}  // namespace legopt
