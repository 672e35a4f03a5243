#pragma once

#include <Eigen/Geometry>
#include <memory>
#include <vector>

#include "legopt/collision/convex_shape.h"
#include "legopt/collision/signed_distance.h"
#include "legopt/collision/support_set.h"

namespace legopt {

/// The solver's side of ODE: a static space of convex solids and the moving convex shapes that are collided with it.
///
/// Solids of kind hull, and every moving shape, are geometries of a class that legopt registers with ODE; its collider
/// returns the exact signed distance within a margin. Solids that are primitives are ODE's own box, sphere, capsule and
/// cylinder; paired with a moving shape they meet the same collider, never ODE's. Colliding our class with a trimesh
/// aborts; this class has no way to make one. ODE's types do not appear here. One thread at a time.
class OdeConvexWorld {
 public:
  /// `solids` with their support sets in world coordinates; `moving`: one support set per moving shape, refilled by the
  /// caller before each query. All three must outlive this object and keep their addresses.
  OdeConvexWorld(const std::vector<ConvexShape>& solids, const std::vector<SupportSet>& solid_sets,
                 const std::vector<SupportSet>& moving);
  ~OdeConvexWorld();
  OdeConvexWorld(const OdeConvexWorld&) = delete;
  OdeConvexWorld& operator=(const OdeConvexWorld&) = delete;

  /// Indices of the solids whose bounds overlap the box, ascending, into `solids` (cleared first).
  void CollectSolids(const Eigen::AlignedBox3d& box, std::vector<int>& solids);

  /// Signed distance (A = moving shape, B = the other) when smaller than `margin_m`; false otherwise. `hint`: as of
  /// SignedDistance(); may be null.
  bool CollideWithSolid(int moving, int solid, double margin_m, PairDistance& result, NearestHint* hint = nullptr);
  /// The same for two moving shapes, A = `moving_a` and B = `moving_b`.
  bool CollideMoving(int moving_a, int moving_b, double margin_m, PairDistance& result, NearestHint* hint = nullptr);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace legopt
