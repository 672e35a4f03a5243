#pragma once

#include <span>
#include <string>

#include "legopt/collision/terrain.h"
#include "legopt/import/finding.h"
#include "legopt/import/footholds.h"

namespace legopt {

/// How well the two ways of reading a pose's first four numbers agree with the ground. A reading agrees when the z axis
/// of the foothold is within 5 degrees of the normal of the surface at its position, or, where there is no surface
/// within 0.3 m, within 45 degrees of the vertical.
struct QuaternionEvidence {
  int footholds = 0;      ///< looked at
  int agree_w_first = 0;  ///< of them, read as w x y z
  int agree_x_first = 0;  ///< of them, read as x y z w

  /// Which reading the ground speaks for; see verdict().
  enum class Verdict {
    kWFirst,  ///< w x y z
    kXFirst,  ///< x y z w
    kEither,  ///< both equally
    kNeither  ///< less than half agree with either
  };
  /// The reading with which more footholds agree; kEither when both do equally well (feet that only turn by 0 or 180
  /// degrees), kNeither when less than half agree with either.
  Verdict verdict() const;
  std::string Describe() const;  ///< "w first: 70 of 70 normals agree, x first: 3"
};

/// Looks at every foothold under both readings; `footholds` have been read as w x y z.
QuaternionEvidence WeighQuaternionOrder(std::span<const UsedFoothold> footholds, const Terrain& terrain);

/// What the evidence means for files whose quaternions are taken as `w first`, the format's order.
DatasetFinding JudgeQuaternionOrder(const QuaternionEvidence& evidence);

/// The rotation of a pose whose numbers were x y z w, but have been read as w x y z.
Eigen::Quaterniond ReadAsXFirst(const Eigen::Quaterniond& read_as_w_first);

}  // namespace legopt
