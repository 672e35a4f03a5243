#pragma once

#include <span>
#include <string>

#include "legopt/geometry/terrain.h"
#include "legopt/import/dataset_diagnostic.h"
#include "legopt/import/used_contacts.h"

namespace legopt {

/// Evidence for the order of the quaternions in a problem file: the number of contacts that agree with the ground under
/// each order. A contact agrees if its z axis is within 5 degrees of the surface normal at its position or, without a
/// surface within 0.3 m, within 45 degrees of the vertical.
struct QuaternionEvidence {
  int contacts = 0;       ///< number of contacts checked
  int agree_w_first = 0;  ///< number that agree if read as w x y z
  int agree_x_first = 0;  ///< number that agree if read as x y z w

  /// Conclusion from the evidence.
  enum class Verdict {
    kWFirst,  ///< w x y z
    kXFirst,  ///< x y z w
    kEither,  ///< equal evidence for both
    kNeither  ///< less than half agree with either order
  };
  /// Order with more agreeing contacts; kEither on a tie (feet rotated by 0 or 180 degrees only), kNeither if less than
  /// half agree with either.
  Verdict verdict() const;
  std::string Describe() const;  ///< text like "w first: 70 of 70 normals agree, x first: 3"
};

/// Compares every contact with the ground under both orders; `contacts` have been read as w x y z.
QuaternionEvidence CollectQuaternionEvidence(std::span<const UsedContact> contacts, const Terrain& terrain);

/// Returns the finding for files that are read as w x y z, the format's order.
DatasetDiagnostic DiagnoseQuaternionOrder(const QuaternionEvidence& evidence);

/// Returns the rotation of a pose whose numbers are x y z w, but were read as w x y z.
Eigen::Quaterniond ReadAsXFirst(const Eigen::Quaterniond& read_as_w_first);

}  // namespace legopt
