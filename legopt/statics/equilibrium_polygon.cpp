#include "legopt/statics/equilibrium_polygon.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "legopt/dataset/contact.h"
#include "legopt/statics/internal/linear_program.h"
#include "legopt/statics/internal/position_program.h"

namespace legopt {
namespace {

const std::array kAxisDirections = {Eigen::Vector2d(1, 0), Eigen::Vector2d(0, 1), Eigen::Vector2d(-1, 0),
                                    Eigen::Vector2d(0, -1)};

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
  const Eigen::Vector4d y = multipliers.head<PositionProgram::kFixedRows>();
  const double scale = y.cwiseAbs().maxCoeff();
  if (!(scale > 0.0)) return std::nullopt;
  const SlideProof proof = CheckedProof(forces, y.head<3>() / scale, y[3] / scale);
  return IsProof(proof) ? std::optional(proof) : std::nullopt;
}

/// Returns true if all corners between two of them are at most `accuracy_m` away from their chord.
bool IsNearChord(const std::vector<Eigen::Vector2d>& corners, size_t begin, size_t end, double accuracy_m) {
  const Eigen::Vector2d chord = corners[end % corners.size()] - corners[begin];
  const double square = chord.squaredNorm();
  for (size_t i = begin + 1; i < end; ++i) {
    const Eigen::Vector2d corner = corners[i] - corners[begin];
    const double share = square > 0.0 ? std::clamp(corner.dot(chord) / square, 0.0, 1.0) : 0.0;
    if ((corner - share * chord).norm() > accuracy_m) return false;
  }
  return true;
}

/// Removes corners, counter-clockwise, as long as the polygon shrinks by at most `accuracy_m`.
std::vector<Eigen::Vector2d> Simplified(const std::vector<Eigen::Vector2d>& corners, double accuracy_m) {
  std::vector<Eigen::Vector2d> kept;
  size_t end = 1;
  for (size_t begin = 0; begin < corners.size(); begin = end) {
    kept.push_back(corners[begin]);
    for (end = begin + 1; end < corners.size() && IsNearChord(corners, begin, end + 1, accuracy_m);) ++end;
  }
  return kept;
}

/// Returns the corners of all positions of a program that has some.
std::vector<Eigen::Vector2d> CornersOf(PositionProgram* program, const StanceForces& forces, double accuracy_m) {
  std::vector<Eigen::Vector2d> positions = program->TurnedCorners();
  if (positions.empty()) positions = program->SearchedCorners(accuracy_m);
  for (Eigen::Vector2d& position : positions) position += forces.origin_W().head<2>();
  return Simplified(ConvexHull2d(std::move(positions)), accuracy_m);
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
  LinearProgram program{.A = Eigen::MatrixXd(kRows, columns),
                        .b = Eigen::VectorXd::Unit(kRows, kRows - 1),
                        .range = Eigen::VectorXd::Zero(kRows),
                        .upper = Eigen::VectorXd::Constant(columns, LinearProgramSolver::kInfinity)};
  Eigen::MatrixXd positions(2, columns);
  for (Eigen::Index i = 0; i < columns; ++i) {
    const int l = free[static_cast<size_t>(i)];
    program.A.col(i) << forces.directions().col(l), forces.moments()(2, l), 1.0;
    positions.col(i) << -forces.moments()(1, l), forces.moments()(0, l);
  }
  LinearProgramSolver solver;
  if (solver.Constrain(program) != LinearProgramStatus::kOptimal) return false;
  for (const Eigen::Vector2d& direction : kAxisDirections) {
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
