#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "legopt/geometry/collision_model.h"
#include "legopt/geometry/internal/signed_distance.h"
#include "legopt/robot/kinematics.h"

namespace legopt {

/// @file
/// Sign conventions of all collision code, defined only here.
///
///  * Signed distance d [m]: d > 0 the shapes are separate by d; d = 0 they touch; d < 0 they penetrate and -d is the
///    length of the shortest translation that separates them. Penetration *depth* = -d, reported only as a
///    non-negative number (the judge's depths; 0 means no contact).
///  * Shape A belongs to `link_a`, which is always a robot link. Shape B belongs to `link_b`: a robot link with
///    link_b > link_a, or the environment (kScene).
///  * The normal is a unit vector in world axes and points from B to A: moving A along +normal increases d.
///  * Witness points: point_a_W lies on the surface of A, point_b_W on the surface of B, moved by the pair's false
///  depth
///    (LinkPairRules) against the normal, and
///        point_a_W - point_b_W = d * normal_W          for both signs of d
///    (separate: the closest points; penetrating: the deepest points, A's inside B and B's inside A).
///  * Linearised distance about the current configuration, points fixed in their links, normal constant:
///        d(x + dx) ~ d + normal^T (J_A(point_a_W) - J_B(point_b_W)) dx,     J_B = 0 for the environment.
///  * `distance < margin` selects contacts; a margin is the positive distance up to which contacts are reported.

/// `link_b` of a contact with the environment.
inline constexpr int kScene = -1;

/// One pair of convex shapes closer than the query's margin. World frame, metres; signs as defined in this file.
struct ProximityPair {
  int link_a = 0;                                       ///< robot link
  int link_b = kScene;                                  ///< robot link > link_a, or kScene
  Eigen::Vector3d point_a_W = Eigen::Vector3d::Zero();  ///< on the surface of A
  Eigen::Vector3d point_b_W = Eigen::Vector3d::Zero();  ///< on the surface of B
  Eigen::Vector3d normal_W = Eigen::Vector3d::UnitZ();  ///< unit vector from B to A
  double distance_m = 0.0;                              ///< signed distance
  int pair_id = 0;                                      ///< identifies the pair of shapes within one CollisionModel
};

/// Warm starts for pairs of shapes, for queries at similar configurations, such as those of a solver. They speed up
/// queries. Results may differ by rounding, and by the choice among equally near points, so results of callers that
/// keep a memory depend on its history.
///
/// A hash table with open addressing from pair identifiers (collision_query.h) to hints. It holds kMaxPairs and is
/// cleared if there are more. Not thread-safe; allocates only on construction.
class WarmStartCache {
 public:
  static constexpr size_t kMaxPairs = 256;  ///< several times the number of pairs in a typical query of solids

  /// Returns the hint of a pair; empty if there is none. Valid until the next call.
  DistanceHint& At(int pair_id) {
    size_t at = Find(pair_id);
    if (slots_[at].pair_id == kFree) {
      if (count_ == kMaxPairs) {
        Clear();
        at = Find(pair_id);
      }
      slots_[at] = {pair_id, {}};
      ++count_;
    }
    return slots_[at].hint;
  }

  /// Removes all hints.
  void Clear() {
    for (Slot& slot : slots_) slot.pair_id = kFree;
    count_ = 0;
  }

  size_t size() const { return count_; }  ///< number of stored pairs

 private:
  static constexpr int kFree = -1;
  struct Slot {
    int pair_id = kFree;
    DistanceHint hint;
  };

  /// Returns the slot of the pair, or a free slot for it.
  size_t Find(int pair_id) const {
    constexpr std::uint32_t kGolden = 2654435769;  // 2^32 / golden ratio: spreads neighbouring pairs
    constexpr int kHigh = 16;
    const size_t mask = slots_.size() - 1;
    size_t at = ((static_cast<std::uint32_t>(pair_id) * kGolden) >> kHigh) & mask;
    while (slots_[at].pair_id != kFree && slots_[at].pair_id != pair_id) at = (at + 1) & mask;
    return at;
  }

  std::vector<Slot> slots_ = std::vector<Slot>(2 * kMaxPairs);  ///< a power of two, at most half of them used
  size_t count_ = 0;
};

/// Proximity queries of the robot against the scene and itself, on a CollisionModel.
///
/// Exact signed distances between convex shapes (GJK, EPA); the convention is in collision_query.h. For solids, the
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
