#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>

#include "legopt/dataset/dataset.h"
#include "legopt/robot/robot_model.h"
#include "legopt/solvers/solver.h"

namespace legopt {

/// For robots with more degrees of freedom no posture is searched, and standing is tried once: a solve takes minutes.
inline constexpr int kManyDofs = 100;

/// Returns a check that ends a solve of such a robot after 10 iterations; of other robots, one that never does.
StopCheck StopOfLarge(const RobotModel& robot);

/// Searches a nominal posture for a robot on the stage of standing_stage.h: all contacts on level ground, the centre of
/// mass over them, no collision, and legs bent by at least an eighth of their length, since straight legs are a bad
/// start for every solver. Among such postures it has the least squared distance from `reference` (n + 7; joints only).
/// The contacts are below their places in the reference configuration or, if that has no solution, below the first
/// joints of their legs.
///
/// SQP solves it from up to twelve starts with legs bent both ways; only postures that pass the judge's solid rule
/// count. Returns the configuration on the stage (n + 7); nothing if there is none. Deterministic.
std::optional<Eigen::VectorXd> FindNominalPosture(const std::shared_ptr<const Dataset>& stage,
                                                  const Eigen::VectorXd& reference);

}  // namespace legopt
