#pragma once

#include "legopt/subproblem/convex_subproblem.h"

namespace legopt {

/// ConvexSubproblem by Ipopt with MUMPS: an independent second opinion on InteriorPointSolver, two orders of magnitude
/// slower. Every penalty becomes a slack s >= |a| or s >= max(0, a) with cost w s; the objective is divided by the
/// largest weight.
///
/// MUMPS allows one solve per process at a time: solves of all instances are serialised by a lock.
class IpoptSubproblemSolver : public SubproblemSolver {
 public:
  Result Solve(const ConvexSubproblem& problem, const Accuracy& accuracy, Eigen::Ref<Eigen::VectorXd> dx) override;
};

}  // namespace legopt
