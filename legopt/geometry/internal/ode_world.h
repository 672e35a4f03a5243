#pragma once

#include <Eigen/Geometry>
#include <memory>
#include <stdexcept>
#include <vector>

#include "legopt/geometry/internal/convex_shape.h"
#include "legopt/geometry/internal/signed_distance.h"

namespace legopt {

/// A failed assertion or an error reported by ODE. ODE would abort the process; UseOdeOnThisThread installs handlers
/// that throw this exception instead. The text contains ODE's condition, function, file and line.
///
/// Catching it around dCollide of two meshes is safe with Debian's ODE: the library is compiled with unwind tables and
/// exceptions, the collider keeps its data on the stack and in the process-wide cache, and each collision query clears
/// that cache first. `TrimeshFailure` in tests/geometry checks queries after a failure.
class OdeFailure : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Prepares ODE for the calling thread: process-wide initialization and error handlers once, ODE's per-thread data once
/// per thread (freed by ODE when the thread ends). Classes that own ODE objects call it in their constructor and before
/// colliding. Throws OdeFailure if ODE cannot be initialized.
void UseOdeOnThisThread();

/// The solver's interface to ODE: a static space of convex solids, and moving convex shapes.
///
/// Hulls among the solids, and every moving shape, are geometries of a custom class registered with ODE, whose collider
/// returns the exact signed distance within a margin. Primitives among the solids are ODE's own box, sphere, capsule
/// and cylinder; against a moving shape they use the same collider, never ODE's. Colliding the custom class with a
/// trimesh aborts; this class cannot create one. ODE's types do not appear here. Not thread-safe.
class OdeConvexWorld {
 public:
  /// `solids` have support sets in world coordinates. `moving`: one support set per moving shape, updated by the caller
  /// before each query. All three must outlive this object and keep their addresses.
  OdeConvexWorld(const std::vector<ConvexShape>& solids, const std::vector<SupportSet>& solid_sets,
                 const std::vector<SupportSet>& moving);
  ~OdeConvexWorld();
  OdeConvexWorld(const OdeConvexWorld&) = delete;
  OdeConvexWorld& operator=(const OdeConvexWorld&) = delete;

  /// Finds the solids whose bounds overlap the box; stores their ascending indices in `solids` (cleared first).
  void CollectSolids(const Eigen::AlignedBox3d& box, std::vector<int>& solids);

  /// Computes the signed distance (A = moving shape, B = solid). Returns false if it is not below `margin_m`. `hint`:
  /// see SignedDistance(); may be null.
  bool CollideWithSolid(int moving, int solid, double margin_m, PairDistance& result, DistanceHint* hint = nullptr);
  /// Computes the signed distance of two moving shapes, A = `moving_a` and B = `moving_b`, like CollideWithSolid.
  bool CollideMoving(int moving_a, int moving_b, double margin_m, PairDistance& result, DistanceHint* hint = nullptr);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace legopt
