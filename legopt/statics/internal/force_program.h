#pragma once

#include <Eigen/Core>

#include "legopt/statics/internal/simplex_dictionary.h"
#include "legopt/statics/stance_forces.h"

namespace legopt {

/// Rows of the balance of forces (3) and moments (3).
inline constexpr Eigen::Index kBalanceRows = 6;

/// Size and right side of a program of forces.
struct ForceProgram {
  Eigen::Vector3d com_W = Eigen::Vector3d::Zero();  ///< point about which moments balance, m
  double lift = 1.0;                                ///< sum of the vertical forces, in units of the weight
  double tolerance = 0.0;                           ///< slack of each row of the balance, >= 0
  Eigen::Index more_rows = 0;                       ///< rows that the caller adds at the end
  Eigen::Index more_columns = 0;                    ///< columns that the caller adds behind the generators
};

/// Sets the linear program of the forces of a stance:
///
///     rows:     balance of forces and moments about com_W within +-tolerance; one for each bound of a normal force;
///               more_rows (zero, with an infinite range)
///     columns:  generators, more_columns (zero, without a bound)
///
/// Returns the first of the caller's rows.
Eigen::Index SetForceProgram(const StanceForces& forces, const ForceProgram& size, LinearProgram* program);

}  // namespace legopt
