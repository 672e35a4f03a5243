#pragma once

namespace legopt {

/// Switch for culling with hulls, bounds and distances before exact meshes are compared. It affects only the time, not
/// the results (docs/explanation/judge.md#what-judge-and-solver-share); off for audits of this property.
enum class Culling {
  kOn,  ///< default
  kOff  ///< compares every pair of meshes and every vertex
};

}  // namespace legopt
