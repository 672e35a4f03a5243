#pragma once

namespace legopt {

/// Whether what cannot touch is told by hulls, bounds and distances before exact meshes are compared. It changes no
/// result, only the time (docs/readings.md#what-judge-and-solver-share); off for audits of that.
enum class Culling {
  kOn,  ///< the usual
  kOff  ///< every pair of meshes, every vertex
};

}  // namespace legopt
