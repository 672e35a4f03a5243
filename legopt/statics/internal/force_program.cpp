#include "legopt/statics/internal/force_program.h"

#include <limits>

namespace legopt {

Eigen::Index SetForceProgram(const StanceForces& forces, const ForceProgram& size, LinearProgram* program) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  const Eigen::Index L = forces.num_generators();
  const Eigen::Index first_row = kBalanceRows + static_cast<Eigen::Index>(forces.bounds().size());
  const Eigen::Index rows = first_row + size.more_rows;
  Eigen::MatrixXd& A = program->A;
  A.setZero(rows, L + size.more_columns);
  program->b.setZero(rows);
  program->range.setConstant(rows, kInfinity);
  program->upper.setConstant(A.cols(), kInfinity);
  program->upper.head(L) = forces.upper();
  const Eigen::Vector3d com = size.com_W - forces.origin_W();
  for (Eigen::Index l = 0; l < L; ++l) {
    A.block<3, 1>(0, l) = forces.directions().col(l);
    A.block<3, 1>(3, l) = forces.moments().col(l) - com.cross(forces.directions().col(l));
  }
  program->b[2] = size.lift;
  program->b.head<kBalanceRows>().array() += size.tolerance;
  program->range.head<kBalanceRows>().setConstant(2.0 * size.tolerance);
  for (Eigen::Index i = kBalanceRows; i < first_row; ++i) {
    const StanceForces::NormalBound& bound = forces.bounds()[static_cast<std::size_t>(i - kBalanceRows)];
    for (int l = 0; l < forces.num_generators(); ++l) {
      if (forces.surface_of(l) == bound.surface) A(i, l) = 1.0;
    }
    program->b[i] = bound.maximum;
  }
  return first_row;
}

}  // namespace legopt
