#pragma once

#include <Eigen/Core>
#include <memory>
#include <string>
#include <vector>

#include "legopt/dataset/dataset.h"

namespace legopt {

/// Whether a robot can stand.
struct StandingProof {
  bool stands = false;        ///< solved, and accepted by the judge's solid rule
  Eigen::VectorXd x;          ///< configuration on the stage (n + 7), also if it does not stand
  double com_margin_m = 0.0;  ///< distance of the centre of mass from the edge of the support polygon; < 0: outside
  double solve_s = 0.0;       ///< wall time of the solve that led to `x`
  std::string detail;         ///< the judge's failure; empty if it stands
  std::vector<std::string> conflict;  ///< smallest set of terms found that contradict each other within the joint
                                      ///< limits; empty if it stands or each set of terms has a solution
};

/// Solves one stance on the stage of standing_stage.h with LegOpt-best, contacts below their places in `nominal`
/// (n + 7, a posture that stands on the level ground or a guess), and judges it. Starts from `nominal` and, until a
/// solution stands, from postures near it (of robots with at most kManyDofs): until the solver failed 8 times, at
/// most 40. `on_ramp`: on the ramp, else on the level ground. Deterministic, except for the time.
StandingProof ProveStanding(const std::shared_ptr<const Dataset>& stage, const Eigen::VectorXd& nominal, bool on_ramp);

}  // namespace legopt
