#include "legopt/statics/internal/force_program.h"

#include "legopt/statics/internal/linear_program.h"

namespace legopt {

Eigen::Index SetForceProgram(const StanceForces& forces, const ForceProgram& program, Eigen::MatrixXd* A,
                             Eigen::VectorXd* b, Eigen::VectorXd* upper) {
  const Eigen::Index L = forces.num_generators();
  const Eigen::Index first_row = kBalanceRows + static_cast<Eigen::Index>(forces.bounds().size());
  const Eigen::Index rows = first_row + program.more_rows;
  const Eigen::Index first_slack = L + program.more_columns;
  A->setZero(rows, first_slack + rows);
  b->setZero(rows);
  upper->setConstant(A->cols(), LinearProgramSolver::kInfinity);
  upper->head(L) = forces.upper();
  const Eigen::Vector3d com = program.com_W - forces.origin_W();
  for (Eigen::Index l = 0; l < L; ++l) {
    A->block<3, 1>(0, l) = forces.directions().col(l);
    A->block<3, 1>(3, l) = forces.moments().col(l) - com.cross(forces.directions().col(l));
  }
  (*b)[2] = program.lift;
  // value + slack = right side + tolerance, with slack in [0, 2 tolerance]
  b->head<kBalanceRows>().array() += program.tolerance;
  upper->segment(first_slack, kBalanceRows).setConstant(2.0 * program.tolerance);
  for (Eigen::Index i = kBalanceRows; i < first_row; ++i) {
    const StanceForces::NormalBound& bound = forces.bounds()[static_cast<std::size_t>(i - kBalanceRows)];
    for (int l = 0; l < forces.num_generators(); ++l) {
      if (forces.surface_of(l) == bound.surface) (*A)(i, l) = 1.0;
    }
    (*b)[i] = bound.maximum;
  }
  for (Eigen::Index i = 0; i < rows; ++i) (*A)(i, first_slack + i) = 1.0;
  return first_row;
}

}  // namespace legopt
