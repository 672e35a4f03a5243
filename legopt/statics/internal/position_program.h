#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "legopt/statics/equilibrium_polygon.h"
#include "legopt/statics/internal/linear_program.h"
#include "legopt/statics/stance_forces.h"

namespace legopt {

/// Linear program for extreme horizontal positions (-m_y, m_x) of the centre of mass, relative to the origin of
/// moments, where contact forces of a given sum act (ComputeEquilibriumPolygon, ComputePushPolygon).
///
/// Not thread-safe. `forces` must outlive it.
class PositionProgram {
 public:
  /// Rows of the sum of the forces and of the moment about it; their multipliers can be a SlideProof.
  static constexpr int kFixedRows = 4;

  /// `total`: sum of the forces, weights, with vertical part 1.
  PositionProgram(const StanceForces& forces, const Eigen::Vector3d& total);
  PositionProgram(const PositionProgram&) = delete;  // the solver refers to the program
  PositionProgram& operator=(const PositionProgram&) = delete;

  /// kOptimal if there is a position, kInfeasible if there is none.
  LinearProgramStatus status() const { return status_; }
  const Eigen::VectorXd& multipliers() const { return solver_.multipliers(); }

  /// Returns the corners of all positions, counter-clockwise, by turning the direction once around; empty if that did
  /// not lead back to the first corner.
  std::vector<Eigen::Vector2d> TurnedCorners();

  /// Returns corners, counter-clockwise, which approximate all positions from within up to `accuracy_m`, by one search
  /// in the direction normal to each edge; empty if a search failed. This takes longer, but rounding does not
  /// accumulate.
  std::vector<Eigen::Vector2d> SearchedCorners(double accuracy_m);

 private:
  void AddBound(Eigen::Index index);
  /// Returns the furthest position in a direction; empty if the search failed.
  std::optional<Eigen::Vector2d> FurthestAlong(const Eigen::Vector2d& direction);
  /// Appends the corners after `begin` up to `end`, counter-clockwise. Returns false if a search failed.
  bool AppendCorners(const Eigen::Vector2d& begin, const Eigen::Vector2d& end, double accuracy_m,
                     std::vector<Eigen::Vector2d>* corners);
  Eigen::Vector2d PositionOf(const Eigen::VectorXd& x) const { return {-rows_x_.dot(x), -rows_y_.dot(x)}; }

  const StanceForces& forces_;
  Eigen::VectorXd rows_x_, rows_y_;  ///< costs of the furthest positions along +x and +y
  LinearProgram program_;
  LinearProgramSolver solver_;
  LinearProgramStatus status_ = LinearProgramStatus::kStalled;
};

}  // namespace legopt
