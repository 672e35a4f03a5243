#pragma once

#include <cstdint>
#include <memory>
#include <span>

#include "legopt/collision/collision_model.h"
#include "legopt/collision/contact.h"
#include "legopt/collision/contact_memory.h"
#include "legopt/robot/kinematics.h"

namespace legopt {

/// Finds what is near: the robot against the scene and against itself. A workspace on one CollisionModel.
///
/// Exact signed distances between convex shapes (GJK, EPA), see the convention block in contact.h. For solids, ODE
/// spaces are the broadphase and hold our convex geometry class beside ODE's primitives; the triangles of a surface lie
/// in a tree of bounding boxes that belongs to the model.
///
/// Thread rule: one thread at a time; make one per thread (cheap, the model is shared). No allocation once the buffers
/// have grown to the largest query seen.
class CollisionQuery {
 public:
  /// `model` is shared; the query keeps it alive.
  explicit CollisionQuery(std::shared_ptr<const CollisionModel> model);
  ~CollisionQuery();
  /// What is moved from may only be destroyed or assigned to.
  CollisionQuery(CollisionQuery&&) noexcept;
  /// Likewise.
  CollisionQuery& operator=(CollisionQuery&&) noexcept;

  /// All contacts with distance < margin_m [m, >= 0] at the configuration held by `kinematics` (updated, of the model's
  /// robot). Each pair of shapes at most once; among contacts of one link that repeat each other (same obstacle plane,
  /// nearly the same point) only the nearest is kept, but penetrating contacts all stay. Order: scene contacts by
  /// (link, obstacle), then self contacts by (second, first) link. The result depends on the arguments only, never on
  /// earlier queries but by `memory`, which may be null. The span is valid until the next call.
  std::span<const Contact> Contacts(const Kinematics& kinematics, double margin_m, ContactMemory* memory = nullptr);

  /// The contacts of the given links (ascending, each once) with the scene, as Contacts() reports them.
  std::span<const Contact> SceneContacts(const Kinematics& kinematics, double margin_m, std::span<const int> links,
                                         ContactMemory* memory = nullptr);
  /// The same for all links.
  std::span<const Contact> SceneContacts(const Kinematics& kinematics, double margin_m);

  const CollisionModel& model() const;  ///< of which it is a query

  /// Calls of Contacts and SceneContacts so far.
  std::int64_t queries() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace legopt
