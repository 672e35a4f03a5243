#pragma once

#include <cstdint>
#include <memory>
#include <span>

#include "legopt/geometry/collision_model.h"
#include "legopt/geometry/proximity_pair.h"
#include "legopt/geometry/warm_start_cache.h"
#include "legopt/robot/kinematics.h"

namespace legopt {

/// Proximity queries of the robot against the scene and itself, on a CollisionModel.
///
/// Exact signed distances between convex shapes (GJK, EPA); the convention is in proximity_pair.h. For solids, the
/// broadphase
/// is an ODE space that contains our convex geometry class and ODE's primitives; for a surface, it is the model's
/// bounding-box tree of triangles.
///
/// Not thread-safe; create one per thread (cheap, the model is shared). No allocation once the buffers have reached
/// their final size.
class CollisionQuery {
 public:
  explicit CollisionQuery(std::shared_ptr<const CollisionModel> model);
  ~CollisionQuery();
  /// A moved-from query may only be destroyed or assigned to.
  CollisionQuery(CollisionQuery&&) noexcept;
  CollisionQuery& operator=(CollisionQuery&&) noexcept;

  /// Returns all contacts with distance < margin_m [m, >= 0] at the configuration of `kinematics` (updated, of the
  /// model's robot). Each pair of shapes occurs at most once. Of redundant contacts of one link (same obstacle plane,
  /// nearly the same point) only the nearest is kept, but penetrating contacts are all kept. Order: scene contacts by
  /// (link, obstacle), then self contacts by (second, first) link. The result does not depend on earlier queries except
  /// through `memory`, which may be null. The span is valid until the next call.
  std::span<const ProximityPair> Contacts(const Kinematics& kinematics, double margin_m,
                                          WarmStartCache* memory = nullptr);

  /// Returns the scene contacts of the given links (ascending, unique), in the form of Contacts().
  std::span<const ProximityPair> SceneContacts(const Kinematics& kinematics, double margin_m,
                                               std::span<const int> links, WarmStartCache* memory = nullptr);
  /// Returns the scene contacts of all links.
  std::span<const ProximityPair> SceneContacts(const Kinematics& kinematics, double margin_m);

  const CollisionModel& model() const;

  /// Number of calls of Contacts and SceneContacts so far.
  std::int64_t queries() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace legopt
