#include "legopt/solvers/term_models.h"

namespace legopt {

void ShiftModels(const Program& program, const Eigen::VectorXd& dx, TermModels& models) {
  const auto& terms = program.terms();
  const int size = program.tangent_size();
  for (size_t k = 0; k < terms.size(); ++k) {
    models[k].Shift(dx.data() + static_cast<Eigen::Index>(terms[k]->shape().waypoint) * size, size);
  }
}

}  // namespace legopt
