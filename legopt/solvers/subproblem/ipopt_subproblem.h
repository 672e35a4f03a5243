#pragma once

#include "legopt/solvers/subproblem/convex_subproblem.h"

namespace legopt {

/// Solves ConvexSubproblem with Ipopt and MUMPS: an independent check of InteriorPointSolver, two orders of magnitude
/// slower. Every penalty becomes a slack s >= |a| or s >= max(0, a) with cost w s; the objective is divided by the
/// largest weight.
///
/// MUMPS allows one solve per process at a time: a lock serialises the solves of all instances.
class IpoptSubproblemSolver : public SubproblemSolver {
 public:
  Result Solve(const ConvexSubproblem& problem, const Accuracy& accuracy, Eigen::Ref<Eigen::VectorXd> dx) override;
};

}  // namespace legopt
