#pragma once

#include <Eigen/Core>
#include <vector>

#include "legopt/problem/program.h"

namespace legopt {

/// One linear model per term of a program, in the order of the terms.
using TermModels = std::vector<LinearModel>;

/// Moves all models along with x by dx (num_waypoints * tangent_size). Incremental methods keep the models of terms
/// that they do not evaluate.
void ShiftModels(const Program& program, const Eigen::VectorXd& dx, TermModels& models);

}  // namespace legopt
