#include "tests/statics/reference_program.h"

#include <glpk.h>

#include <cmath>
#include <limits>

namespace legopt::test {

std::optional<double> MinimumByGlpk(const ReferenceProgram& program) {
  const int rows = static_cast<int>(program.A.rows()), columns = static_cast<int>(program.A.cols());
  glp_term_out(GLP_OFF);
  glp_prob* problem = glp_create_prob();
  glp_add_rows(problem, rows);
  glp_add_cols(problem, columns);
  for (int i = 0; i < rows; ++i) {
    const double low = program.lower[i], high = program.upper[i];
    const int type = low == high ? GLP_FX : !std::isfinite(low) ? GLP_UP : !std::isfinite(high) ? GLP_LO : GLP_DB;
    glp_set_row_bnds(problem, i + 1, type, low, high);
  }
  for (int j = 0; j < columns; ++j) {
    const double high = program.columns_upper[j];
    glp_set_col_bnds(problem, j + 1, std::isfinite(high) ? GLP_DB : GLP_LO, 0.0, high);
    glp_set_obj_coef(problem, j + 1, program.c[j]);
    std::vector<int> indices(1, 0);
    std::vector<double> values(1, 0.0);
    for (int i = 0; i < rows; ++i) {
      if (program.A(i, j) == 0.0) continue;
      indices.push_back(i + 1);
      values.push_back(program.A(i, j));
    }
    glp_set_mat_col(problem, j + 1, static_cast<int>(indices.size()) - 1, indices.data(), values.data());
  }
  glp_smcp options;
  glp_init_smcp(&options);
  options.msg_lev = GLP_MSG_OFF;
  options.tol_bnd = options.tol_dj = 1e-9;
  glp_simplex(problem, &options);
  const int status = glp_get_status(problem);
  std::optional<double> minimum;
  if (status == GLP_OPT) minimum = glp_get_obj_val(problem);
  if (status == GLP_UNBND) minimum = -std::numeric_limits<double>::infinity();
  glp_delete_prob(problem);
  return minimum;
}

ReferenceProgram ImbalanceProgram(const StanceForces& forces, const Eigen::Vector3d& com_W) {
  const int L = forces.num_generators();
  const double infinity = std::numeric_limits<double>::infinity();
  ReferenceProgram program;
  program.A.setZero(12 + static_cast<Eigen::Index>(forces.bounds().size()), L + 1);
  program.lower.setConstant(program.A.rows(), -infinity);
  program.upper.resize(program.A.rows());
  Eigen::Matrix<double, 6, 1> weight;
  weight << 0, 0, 1, 0, 0, 0;
  Eigen::MatrixXd wrenches(6, L);
  for (int l = 0; l < L; ++l) {
    const Eigen::Vector3d position_W = forces.points()[static_cast<size_t>(forces.point_of(l))].position_W;
    wrenches.col(l) << forces.directions().col(l), (position_W - com_W).cross(forces.directions().col(l));
  }
  program.A.topLeftCorner(6, L) = wrenches;
  program.A.block(6, 0, 6, L) = -wrenches;
  program.A.col(L).head(12).setConstant(-1.0);
  program.upper.head<6>() = weight;
  program.upper.segment<6>(6) = -weight;
  for (size_t k = 0; k < forces.bounds().size(); ++k) {
    const Eigen::Index row = 12 + static_cast<Eigen::Index>(k);
    for (int l = 0; l < L; ++l) program.A(row, l) = forces.surface_of(l) == forces.bounds()[k].surface ? 1.0 : 0.0;
    program.upper[row] = forces.bounds()[k].maximum;
  }
  program.columns_upper.setConstant(L + 1, infinity);
  program.columns_upper.head(L) = forces.upper();
  program.c.setZero(L + 1);
  program.c[L] = 1.0;
  return program;
}

}  // namespace legopt::test
