#include "legopt/geometry/collision_query.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <utility>
#include <vector>

#include "legopt/geometry/internal/model_data.h"
#include "legopt/geometry/internal/ode_world.h"

namespace legopt {
namespace {

/// Axis-aligned boxes as a structure of arrays, so that vector instructions compare one box with all of them.
class BoxArray {
 public:
  void Resize(size_t size) {
    for (auto& side : low_) side.resize(size);
    for (auto& side : high_) side.resize(size);
    hit_.resize(size);
  }
  /// Makes room for at least `size` boxes; growing discards the present ones.
  void Reserve(size_t size) {
    if (size > hit_.size()) Resize(size);
  }
  void Set(size_t i, const Eigen::AlignedBox3d& box) {
    for (size_t axis = 0; axis < 3; ++axis) {
      low_[axis][i] = box.min()[static_cast<Eigen::Index>(axis)];
      high_[axis][i] = box.max()[static_cast<Eigen::Index>(axis)];
    }
  }
  /// Calls visit(i) for i < count whose boxes come within `margin` of `box`, in order.
  template <class Visitor>
  void ForEachNear(const Eigen::AlignedBox3d& box, double margin, size_t count, Visitor visit) {
    const Eigen::Vector3d low = box.min().array() - margin;
    const Eigen::Vector3d high = box.max().array() + margin;
    const double* l[3] = {low_[0].data(), low_[1].data(), low_[2].data()};
    const double* h[3] = {high_[0].data(), high_[1].data(), high_[2].data()};
    for (size_t i = 0; i < count; ++i) {
      hit_[i] = static_cast<std::int64_t>((l[0][i] <= high[0]) & (h[0][i] >= low[0]) & (l[1][i] <= high[1]) &
                                          (h[1][i] >= low[1]) & (l[2][i] <= high[2]) & (h[2][i] >= low[2]));
    }
    for (size_t i = 0; i < count; ++i) {
      if (hit_[i] != 0) visit(i);
    }
  }

 private:
  std::vector<double> low_[3], high_[3];
  std::vector<std::int64_t> hit_;
};

bool Near(const Eigen::AlignedBox3d& a, const Eigen::AlignedBox3d& b, double margin) {
  return (a.min() - b.max()).maxCoeff() <= margin && (b.min() - a.max()).maxCoeff() <= margin;
}

/// The two shapes of a contact, parallel to the contacts.
struct Source {
  int a;      ///< shape of link_a
  int other;  ///< obstacle, or shape of link_b
};

}  // namespace

struct CollisionQuery::Impl {
  explicit Impl(std::shared_ptr<const CollisionModel> collision_model)
      : model(std::move(collision_model)),
        data(model->impl()),
        moving(data.shapes.size()),
        all_links(data.links.size()),
        moving_bounds(data.shapes.size()),
        link_bounds(data.links.size()),
        fresh(data.shapes.size()),
        ode(data.solids, data.solid_sets, moving) {
    placed.ResizeLike(data.link_points);
    for (size_t m = 0; m < moving.size(); ++m) placed.View(data.ranges[m], moving[m]);
    std::iota(all_links.begin(), all_links.end(), 0);
    link_boxes.Resize(data.links.size());
    obstacle_boxes.Reserve(data.solids.size());
    around_boxes.Reserve(data.solids.size());
    around.reserve(data.solids.size());
    near_obstacles.reserve(data.solids.size());
    near_a.reserve(data.shapes.size());
    near_b.reserve(data.shapes.size());
    constexpr size_t kContacts = 256;
    contacts.reserve(kContacts);
    sources.reserve(kContacts);
    nearest_first.reserve(kContacts);
  }

  const LinkShapes& Link(int link) const { return data.links[static_cast<size_t>(link)]; }
  const SupportSet& Set(int shape) const { return moving[static_cast<size_t>(shape)]; }
  const Eigen::AlignedBox3d& Bounds(int shape) const { return moving_bounds[static_cast<size_t>(shape)]; }
  int num_links() const { return static_cast<int>(data.links.size()); }

  /// Transforms a shape to the pose of its link, at most once per query.
  void Place(int shape, const Eigen::Isometry3d& pose) {
    const auto m = static_cast<size_t>(shape);
    if (fresh[m] != 0) return;
    fresh[m] = 1;
    SupportSet& set = moving[m];
    Eigen::AlignedBox3d& bounds = moving_bounds[m];
    PlaceSupportSet(data.shapes[m], pose, set);
    if (set.count == 0) {
      bounds = SupportBounds(set);
    } else {
      placed.Transform(data.link_points, data.ranges[m], pose, bounds.min(), bounds.max());
      bounds.min().array() -= set.radius;
      bounds.max().array() += set.radius;
    }
    set.lower = bounds.min();
    set.upper = bounds.max();
  }

  void Place(const ShapeRun& shapes, const Eigen::Isometry3d& pose) {
    for (int shape = shapes.first; shape < shapes.end(); ++shape) Place(shape, pose);
  }

  /// Transforms the bounding shapes of each link (its whole hull, or its pieces); other shapes are transformed on
  /// demand.
  Eigen::AlignedBox3d PlaceLinks(const Kinematics& kinematics, std::span<const int> links) {
    std::fill(fresh.begin(), fresh.end(), std::uint8_t{0});
    Eigen::AlignedBox3d robot;
    for (const int link : links) {
      const int whole = Link(link).whole;
      const ShapeRun shapes = whole >= 0 ? ShapeRun{whole, 1} : Link(link).hulls;
      Place(shapes, kinematics.link_pose(link));
      Eigen::AlignedBox3d& bounds = link_bounds[static_cast<size_t>(link)];
      bounds.setEmpty();
      for (int shape = shapes.first; shape < shapes.end(); ++shape) bounds.extend(Bounds(shape));
      link_boxes.Set(static_cast<size_t>(link), bounds);
      robot.extend(bounds);
    }
    return robot;
  }

  /// Returns true if a triangle's plane is out of reach of the ball around a shape. The bounding box of an inclined
  /// triangle is too loose for this.
  bool IsPlaneOutOfReach(int shape, int obstacle, double margin) const {
    if (!data.surface()) return false;
    const HalfSpace& plane = data.triangle_planes[static_cast<size_t>(obstacle)];
    const double reach = data.shapes[static_cast<size_t>(shape)].bounding_radius() + margin;
    return std::abs(plane.normal.dot(Set(shape).centre) + plane.offset) > reach;
  }

  bool BallMisses(int shape, const Eigen::AlignedBox3d& box, double margin) const {
    const double reach = data.shapes[static_cast<size_t>(shape)].bounding_radius() + margin;
    return box.squaredExteriorDistance(Set(shape).centre) > reach * reach;
  }

  int ObstaclePair(int shape, int obstacle) const {
    return shape * static_cast<int>(data.solid_sets.size()) + obstacle;
  }
  int MovingPair(int a, int b) const {
    const auto num_shapes = static_cast<int>(data.shapes.size());
    return ObstaclePair(num_shapes, 0) + a * num_shapes + b;
  }
  DistanceHint* Hint(int pair_id) const { return memory == nullptr ? nullptr : &memory->At(pair_id); }

  void Report(int link_a, int link_b, const Source& source, const PairDistance& d) {
    const int pair_id = link_b == kScene ? ObstaclePair(source.a, source.other) : MovingPair(source.a, source.other);
    contacts.push_back({link_a, link_b, d.point_a, d.point_b, d.normal, d.distance_m, pair_id});
    sources.push_back(source);
  }

  bool CollideMoving(int a, int b, double margin, PairDistance& distance) {
    return ode.CollideMoving(a, b, margin, distance, Hint(MovingPair(a, b)));
  }

  /// Computes the signed distance between a shape and an obstacle of the scene.
  bool CollideWithObstacle(int shape, int obstacle, double margin, PairDistance& distance) {
    if (!data.surface()) {
      return ode.CollideWithSolid(shape, obstacle, margin, distance, Hint(ObstaclePair(shape, obstacle)));
    }
    // No hint: it saves little for three points, and there are many triangles.
    if (!SignedDistance(Set(shape), data.solid_sets[static_cast<size_t>(obstacle)], margin, distance)) return false;
    if (data.scene == SceneRepresentation::kOrientedSurface) UseFrontNormal(shape, obstacle, distance);
    return true;
  }

  /// If a shape overlaps a triangle and its shortest way out is the back, uses the way out at the front instead. A
  /// shape that would leave across an edge is unchanged, for example a foot on the edge of a step.
  void UseFrontNormal(int shape, int obstacle, PairDistance& distance) const {
    constexpr double kBack = -0.5;  // cosine
    const HalfSpace& plane = data.triangle_planes[static_cast<size_t>(obstacle)];
    if (distance.distance_m >= 0.0 || plane.normal.dot(distance.normal) > kBack) return;
    const SupportSet& set = Set(shape);
    const Eigen::Vector3d deepest = set.Farthest(-plane.normal) - set.radius * plane.normal;
    distance.distance_m = plane.normal.dot(deepest) + plane.offset;
    distance.normal = plane.normal;
    distance.point_a = deepest;
    distance.point_b = deepest - distance.distance_m * plane.normal;
  }

  /// Selects and transforms the link's shapes that may come within the margin of `other`, a box in the world: most
  /// pieces of a large link are far away from it.
  void PlaceShapesNear(const ShapeRun& shapes, const Eigen::Isometry3d& pose, const Eigen::AlignedBox3d& other,
                       double margin, std::vector<int>& near) {
    constexpr double kRounding = 1e-9;  // m; rounding of the transformed box
    const Eigen::Vector3d half = pose.linear().transpose().cwiseAbs() * (0.5 * other.sizes());
    const Eigen::Vector3d centre = pose.linear().transpose() * (other.center() - pose.translation());
    const Eigen::AlignedBox3d turned(centre - half, centre + half);
    near.clear();
    for (int shape = shapes.first; shape < shapes.end(); ++shape) {
      if (!Near(data.shapes[static_cast<size_t>(shape)].bounds(), turned, margin + kRounding)) continue;
      Place(shape, pose);
      near.push_back(shape);
    }
  }

  void CollideWithScene(const Kinematics& kinematics, double margin, std::span<const int> links);
  void CollideWithItself(const Kinematics& kinematics, double margin);
  void CollectObstacles(Eigen::AlignedBox3d robot, double margin);
  void CollectRegion(const Eigen::AlignedBox3d& robot);
  void CollideLinkWithScene(int link, const Kinematics& kinematics, double margin);
  void CollideLinkWithObstacle(int link, int obstacle, const Kinematics& kinematics, double margin);
  void CollideLinks(int a, int b, const Kinematics& kinematics, double margin);
  bool SharesSeparatingPlane(const ProximityPair& contact, const Source& source, const ProximityPair& nearer,
                             const Source& nearer_source) const;
  bool Repeats(const ProximityPair& contact, const Source& source, const ProximityPair& nearer,
               const Source& nearer_source) const;
  void RemoveRedundantContacts(size_t begin);
  void SubtractFalseDepth(size_t begin, double depth_m, double margin);

  std::shared_ptr<const CollisionModel> model;
  const CollisionModel::Impl& data;
  std::vector<SupportSet> moving;  ///< parallel to data.shapes
  std::vector<int> all_links;
  std::vector<Eigen::AlignedBox3d> moving_bounds;
  std::vector<Eigen::AlignedBox3d> link_bounds;
  std::vector<std::uint8_t> fresh;
  PointArena placed;
  OdeConvexWorld ode;
  BoxArray link_boxes;
  Eigen::AlignedBox3d region;       ///< the obstacles in `around` overlap it; initially empty
  std::vector<int> around;          ///< ascending
  BoxArray around_boxes;            ///< parallel to around
  std::vector<int> near_a, near_b;  ///< shapes of the current link pair
  std::vector<int> near_obstacles;
  BoxArray obstacle_boxes;           ///< parallel to near_obstacles
  std::int64_t queries = 0;          ///< number of queries so far
  WarmStartCache* memory = nullptr;  ///< memory of the current query
  std::vector<ProximityPair> contacts;
  std::vector<Source> sources;
  std::vector<int> nearest_first;
};

void CollisionQuery::Impl::CollideLinkWithObstacle(int link, int obstacle, const Kinematics& kinematics,
                                                   double margin) {
  const SupportSet& set = data.solid_sets[static_cast<size_t>(obstacle)];
  const Eigen::AlignedBox3d box(set.lower, set.upper);
  const LinkShapes& shapes = Link(link);
  PairDistance distance;
  if (shapes.whole >= 0) {
    if (BallMisses(shapes.whole, box, margin) || IsPlaneOutOfReach(shapes.whole, obstacle, margin)) return;
    if (!CollideWithObstacle(shapes.whole, obstacle, margin, distance)) return;
    if (shapes.AgainstScene().count == 1) {
      Report(link, kScene, {shapes.whole, obstacle}, distance);
      return;
    }
  }
  const ShapeRun& pieces = shapes.AgainstScene();
  Place(pieces, kinematics.link_pose(link));
  for (int piece = pieces.first; piece < pieces.end(); ++piece) {
    if (!Near(Bounds(piece), box, margin) || BallMisses(piece, box, margin)) continue;
    if (CollideWithObstacle(piece, obstacle, margin, distance)) Report(link, kScene, {piece, obstacle}, distance);
  }
}

void CollisionQuery::Impl::CollideLinkWithScene(int link, const Kinematics& kinematics, double margin) {
  const size_t begin = contacts.size();
  obstacle_boxes.ForEachNear(link_bounds[static_cast<size_t>(link)], margin, near_obstacles.size(),
                             [&](size_t i) { CollideLinkWithObstacle(link, near_obstacles[i], kinematics, margin); });
  RemoveRedundantContacts(begin);
}

/// Selects the nearby obstacles from `around`, which is updated only if the robot leaves its region: consecutive
/// queries of a motion are close to each other.
void CollisionQuery::Impl::CollectObstacles(Eigen::AlignedBox3d robot, double margin) {
  robot.min().array() -= margin;
  robot.max().array() += margin;
  if (!region.contains(robot)) CollectRegion(robot);
  near_obstacles.clear();
  obstacle_boxes.Reserve(around.size());
  around_boxes.ForEachNear(robot, 0.0, around.size(), [&](size_t i) {
    const SupportSet& set = data.solid_sets[static_cast<size_t>(around[i])];
    obstacle_boxes.Set(near_obstacles.size(), {set.lower, set.upper});
    near_obstacles.push_back(around[i]);
  });
}

void CollisionQuery::Impl::CollectRegion(const Eigen::AlignedBox3d& robot) {
  // Waypoints of a window are metres apart. Surfaces have so many triangles that a large region costs more.
  const double spare_m = data.surface() ? 0.5 : 2.0;
  region = robot;
  region.min().array() -= spare_m;
  region.max().array() += spare_m;
  around.clear();
  if (data.surface()) {
    data.triangle_tree->AnyOverlapping(region, [&](int triangle) {
      around.push_back(triangle);
      return false;
    });
    std::sort(around.begin(), around.end());
  } else {
    ode.CollectSolids(region, around);
  }
  around_boxes.Reserve(around.size());
  for (size_t i = 0; i < around.size(); ++i) {
    const SupportSet& set = data.solid_sets[static_cast<size_t>(around[i])];
    around_boxes.Set(i, {set.lower, set.upper});
  }
}

void CollisionQuery::Impl::CollideWithScene(const Kinematics& kinematics, double margin, std::span<const int> links) {
  contacts.clear();
  sources.clear();
  const Eigen::AlignedBox3d robot = PlaceLinks(kinematics, links);
  if (robot.isEmpty()) return;
  CollectObstacles(robot, margin);
  for (const int link : links) {
    if (Link(link).hulls.count > 0) CollideLinkWithScene(link, kinematics, margin);
  }
}

void CollisionQuery::Impl::CollideWithItself(const Kinematics& kinematics, double margin) {
  for (int b = 0; b < num_links(); ++b) {
    if (Link(b).hulls.count == 0) continue;
    link_boxes.ForEachNear(link_bounds[static_cast<size_t>(b)], margin, static_cast<size_t>(b), [&](size_t i) {
      const int a = static_cast<int>(i);
      if (data.pairs.status[data.PairIndex(a, b)] == CollisionModel::PairStatus::kChecked)
        CollideLinks(a, b, kinematics, margin);
    });
  }
}

void CollisionQuery::Impl::CollideLinks(int a, int b, const Kinematics& kinematics, double margin) {
  const size_t begin = contacts.size();
  const PairResolution detail = data.pairs.detail[data.PairIndex(a, b)];
  const int whole_a = Link(a).whole;
  const int whole_b = Link(b).whole;
  PairDistance distance;
  if (whole_a >= 0 && whole_b >= 0) {
    if (BallMisses(whole_a, link_bounds[static_cast<size_t>(b)], margin)) return;
    if (BallMisses(whole_b, link_bounds[static_cast<size_t>(a)], margin)) return;
    if (detail == PairResolution::kHulls) {
      if (!CollideMoving(whole_a, whole_b, margin, distance)) return;
      if (Link(a).hulls.count == 1 && Link(b).hulls.count == 1) {
        Report(a, b, {whole_a, whole_b}, distance);
        return;
      }
    }
  }
  PlaceShapesNear(Link(a).Of(detail), kinematics.link_pose(a), link_bounds[static_cast<size_t>(b)], margin, near_a);
  PlaceShapesNear(Link(b).Of(detail), kinematics.link_pose(b), link_bounds[static_cast<size_t>(a)], margin, near_b);
  for (const int pa : near_a) {
    if (!Near(Bounds(pa), link_bounds[static_cast<size_t>(b)], margin)) continue;
    for (const int pb : near_b) {
      if (!Near(Bounds(pa), Bounds(pb), margin)) continue;
      if (CollideMoving(pa, pb, margin, distance)) Report(a, b, {pa, pb}, distance);
    }
  }
  RemoveRedundantContacts(begin);
  if (detail != PairResolution::kHulls) SubtractFalseDepth(begin, data.pairs.FalseDepth_m({a, b}), margin);
}

/// Shrinks B along the normals of the contacts from `begin` on, all of one pair of links, and drops those that are
/// beyond the margin then.
void CollisionQuery::Impl::SubtractFalseDepth(size_t begin, double depth_m, double margin) {
  if (depth_m == 0.0) return;
  size_t kept = begin;
  for (size_t i = begin; i < contacts.size(); ++i) {
    ProximityPair contact = contacts[i];
    contact.distance_m += depth_m;
    contact.point_b_W -= depth_m * contact.normal_W;
    if (contact.distance_m >= margin) continue;
    contacts[kept] = contact;
    sources[kept++] = sources[i];
  }
  contacts.resize(kept);
  sources.resize(kept);
}

/// Returns true if the separating plane of the nearer contact also separates this contact's shapes.
bool CollisionQuery::Impl::SharesSeparatingPlane(const ProximityPair& contact, const Source& source,
                                                 const ProximityPair& nearer, const Source& nearer_source) const {
  constexpr double kSamePlane = 1e-4;  // m
  const bool scene = contact.link_b == kScene;
  const SupportSet& other = scene ? data.solid_sets[static_cast<size_t>(source.other)] : Set(source.other);
  const Eigen::Vector3d& n = nearer.normal_W;
  if (n.dot(other.Farthest(n) - nearer.point_b_W) + other.radius > kSamePlane) return false;
  if (source.a == nearer_source.a) return true;
  const SupportSet& own = Set(source.a);
  return n.dot(own.Farthest(-n) - nearer.point_a_W) - own.radius >= -kSamePlane;
}

/// Returns true if, in a linear model, satisfying `nearer` also satisfies `contact`. A penetrated triangle makes no
/// other contact redundant: it may push in a wrong direction, so that the other contacts must keep the link in place.
bool CollisionQuery::Impl::Repeats(const ProximityPair& contact, const Source& source, const ProximityPair& nearer,
                                   const Source& nearer_source) const {
  constexpr double kSamePoint = 5e-3;    // m
  constexpr double kSameNormal = 0.999;  // cosine
  if (contact.normal_W.dot(nearer.normal_W) >= kSameNormal &&
      (contact.point_a_W - nearer.point_a_W).squaredNorm() <= kSamePoint * kSamePoint &&
      (contact.point_b_W - nearer.point_b_W).squaredNorm() <= kSamePoint * kSamePoint) {
    return true;
  }
  if (data.surface() && contact.link_b == kScene && nearer.distance_m <= 0.0) return false;
  return SharesSeparatingPlane(contact, source, nearer, nearer_source);
}

/// Removes redundant contacts from `begin` on (all of one link with the scene, or of two links). Penetrating contacts
/// are all kept, so that a sum of violations is continuous.
void CollisionQuery::Impl::RemoveRedundantContacts(size_t begin) {
  if (contacts.size() - begin < 2) return;
  nearest_first.clear();
  for (size_t i = begin; i < contacts.size(); ++i) nearest_first.push_back(static_cast<int>(i));
  std::sort(nearest_first.begin(), nearest_first.end(), [&](int i, int j) {
    const double di = contacts[static_cast<size_t>(i)].distance_m;
    const double dj = contacts[static_cast<size_t>(j)].distance_m;
    return di < dj || (di == dj && i < j);
  });
  size_t num_kept = 0;
  for (int i : nearest_first) {
    const ProximityPair& contact = contacts[static_cast<size_t>(i)];
    bool repeats = false;
    for (size_t k = 0; k < num_kept && !repeats && contact.distance_m > 0.0; ++k) {
      const auto j = static_cast<size_t>(nearest_first[k]);
      repeats = Repeats(contact, sources[static_cast<size_t>(i)], contacts[j], sources[j]);
    }
    if (!repeats) nearest_first[num_kept++] = i;
  }
  std::sort(nearest_first.begin(), nearest_first.begin() + static_cast<std::ptrdiff_t>(num_kept));
  for (size_t k = 0; k < num_kept; ++k) {  // indices ascend, so that no element is overwritten before it is moved
    contacts[begin + k] = contacts[static_cast<size_t>(nearest_first[k])];
    sources[begin + k] = sources[static_cast<size_t>(nearest_first[k])];
  }
  contacts.resize(begin + num_kept);
  sources.resize(begin + num_kept);
}

CollisionQuery::CollisionQuery(std::shared_ptr<const CollisionModel> model)
    : impl_(std::make_unique<Impl>(std::move(model))) {}
CollisionQuery::~CollisionQuery() = default;
CollisionQuery::CollisionQuery(CollisionQuery&&) noexcept = default;
CollisionQuery& CollisionQuery::operator=(CollisionQuery&&) noexcept = default;

const CollisionModel& CollisionQuery::model() const { return *impl_->model; }

std::int64_t CollisionQuery::queries() const { return impl_->queries; }

std::span<const ProximityPair> CollisionQuery::Contacts(const Kinematics& kinematics, double margin_m,
                                                        WarmStartCache* memory) {
  ++impl_->queries;
  impl_->memory = memory;
  impl_->CollideWithScene(kinematics, margin_m, impl_->all_links);
  impl_->CollideWithItself(kinematics, margin_m);
  return impl_->contacts;
}

std::span<const ProximityPair> CollisionQuery::SceneContacts(const Kinematics& kinematics, double margin_m,
                                                             std::span<const int> links, WarmStartCache* memory) {
  ++impl_->queries;
  impl_->memory = memory;
  impl_->CollideWithScene(kinematics, margin_m, links);
  return impl_->contacts;
}

std::span<const ProximityPair> CollisionQuery::SceneContacts(const Kinematics& kinematics, double margin_m) {
  return SceneContacts(kinematics, margin_m, impl_->all_links);
}

}  // namespace legopt
