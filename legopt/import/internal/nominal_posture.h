#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>

#include "legopt/dataset/dataset.h"

namespace legopt {

/// Robots with more degrees of freedom get few starts: each takes seconds to minutes.
inline constexpr int kManyDofs = 100;

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
