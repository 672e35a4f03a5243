#include "legopt/judge/internal/touch.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include "legopt/geometry/internal/ball.h"
#include "legopt/robot/internal/smallest_rotation.h"
#include "legopt/robot/kinematics.h"
#include "legopt/types/check.h"

namespace legopt {
namespace {

constexpr std::size_t kGrid = 16;        // places per row of a patch's bounding rectangle
constexpr std::size_t kFineGrid = 64;    // places per row for a foot that touches with small parts
constexpr double kOverlap_m = 5e-3;      // a surface this far above the link's underside is below the link
constexpr double kCornerBand_m = 5e-3;   // corners of the surface are those this far above its lowest point
constexpr double kInset_m = 1e-6;        // corners are moved inwards, so that rounding does not put them outside
constexpr double kLeastRadius_m = 5e-3;  // least radius of the disc below a point contact
constexpr int kDiscCorners = 16;         // corners of this disc
constexpr int kHalvings =
    7;  // number of halvings of the distance between two places that find the edge of a touching part

bool Contains(const std::vector<HalfPlane>& edges, const Eigen::Vector2d& p) {
  return std::ranges::all_of(edges, [&](const HalfPlane& edge) { return edge.Distance(p) <= 0.0; });
}

}  // namespace

/// `X_CL`: the contact's link in the frame of the patch.
TouchProbe::Underside TouchProbe::MakeUnderside(const Contact& contact, const Eigen::Isometry3d& X_CL,
                                                const std::vector<Eigen::Vector2d>& patch) const {
  const RobotModel& robot = dataset_.robot();
  Kinematics kinematics(robot);
  kinematics.UpdatePoses(robot.NeutralConfiguration());
  const Eigen::Isometry3d X_CW = X_CL * kinematics.link_pose(contact.link_index).inverse(Eigen::Isometry);
  Eigen::AlignedBox2d rectangle;
  for (const Eigen::Vector2d& corner : patch) rectangle.extend(corner);
  Underside underside;
  for (int link = 0; link < std::ssize(robot.links()); ++link) {
    if (link != contact.link_index && robot.MovingJointsBetween(link, contact.link_index) > 0) continue;
    const Eigen::Isometry3d pose = X_CW * kinematics.link_pose(link);
    collision_.AddLinkTriangles(link, pose, rectangle, &underside.triangles);
    for (const ShapeSpec& shape : robot.links()[static_cast<std::size_t>(link)].collision) {
      for (const Ball& ball : BallsOf(shape, pose)) {
        underside.bottoms.emplace_back(ball.centre - ball.radius_m * Eigen::Vector3d::UnitZ());
      }
    }
  }
  underside.grid = MakeGrid(patch, kGrid, underside.triangles, TriangleColumns::kNone);
  AddCorners(patch, &underside);
  for (const auto* places : {&underside.grid.places, &underside.corners}) {
    for (const Place& place : *places) {
      if (!std::isfinite(place.height)) continue;
      underside.box.extend(Eigen::Vector3d(place.position.x(), place.position.y(), place.height));
    }
  }
  return underside;
}

/// Places with a surface above `ceiling` are omitted.
TouchProbe::Grid TouchProbe::MakeGrid(const std::vector<Eigen::Vector2d>& patch, std::size_t size,
                                      const TriangleColumns& triangles, double ceiling) {
  const std::vector<HalfPlane> edges = Edges(patch);
  Eigen::AlignedBox2d rectangle;
  for (const Eigen::Vector2d& corner : patch) rectangle.extend(corner);
  constexpr std::size_t kOutside = static_cast<std::size_t>(-1);
  std::vector<std::size_t> index(size * size, kOutside);
  Grid grid;
  for (std::size_t cell = 0; cell < index.size(); ++cell) {
    const std::size_t row = cell / size, column = cell % size;
    const Eigen::Vector2d share =
        (Eigen::Vector2d(static_cast<double>(column), static_cast<double>(row)) + Eigen::Vector2d::Constant(0.5)) /
        static_cast<double>(size);
    const Eigen::Vector2d p = rectangle.min() + rectangle.sizes().cwiseProduct(share);
    if (!Contains(edges, p)) continue;
    const double height = triangles.Lowest(p);
    if (height > ceiling) continue;
    index[cell] = grid.places.size();
    grid.places.push_back({p, height});
  }
  for (std::size_t cell = 0; cell < index.size(); ++cell) {
    if (index[cell] == kOutside) continue;
    const auto next = [&](bool exists, std::size_t step) {
      const std::size_t other = exists ? index[cell + step] : kOutside;
      return other == kOutside ? index[cell] : other;
    };
    grid.neighbour.push_back(next(cell % size + 1 < size, 1));
    grid.above.push_back(next(cell / size + 1 < size, size));
  }
  return grid;
}

TouchProbe::Grid TouchProbe::VerticesIn(const std::vector<Eigen::Vector2d>& patch, const TriangleColumns& triangles) {
  const std::vector<HalfPlane> edges = Edges(patch);
  std::vector<Eigen::Vector3d> corners = triangles.Corners();
  std::ranges::sort(corners, [](const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
    return std::lexicographical_compare(a.begin(), a.end(), b.begin(), b.end());
  });
  corners.erase(std::unique(corners.begin(), corners.end()), corners.end());
  Grid vertices;
  for (const Eigen::Vector3d& corner : corners) {
    const Eigen::Vector2d p = corner.head<2>();
    const auto within = [&](const HalfPlane& edge) { return edge.Distance(p) <= kInset_m; };
    if (!std::ranges::all_of(edges, within)) continue;
    vertices.neighbour.push_back(vertices.places.size());
    vertices.places.push_back({p, corner.z()});
  }
  vertices.above = vertices.neighbour;
  return vertices;
}

double TouchProbe::OutlineArea_m2(const std::vector<Place>& places) {
  std::vector<Eigen::Vector2d> outline;
  for (const Place& place : places) outline.push_back(place.position);
  return PolygonArea(ConvexHull2d(std::move(outline)));
}

void TouchProbe::KeepTouchingParts(const std::vector<Eigen::Vector2d>& patch, Underside* underside) {
  Grid vertices = VerticesIn(patch, underside->triangles);
  double lowest = TriangleColumns::kNone;
  for (const auto* places : {&vertices.places, &underside->grid.places}) {
    for (const Place& place : *places) lowest = std::min(lowest, place.height);
  }
  const auto level = static_cast<double>(std::ranges::count_if(
      underside->grid.places, [&](const Place& place) { return place.height <= lowest + kLevelHeight_m; }));
  if (!std::isfinite(lowest) || level >= kTouchShare * static_cast<double>(underside->grid.places.size())) return;
  const double ceiling = lowest + kPartHeight_m;
  const double least_m2 = kPartOutlineShare * PolygonArea(patch);
  Grid parts = MakeGrid(patch, kFineGrid, underside->triangles, ceiling);
  if (OutlineArea_m2(parts.places) < least_m2) {  // perhaps some parts are smaller than a cell
    std::erase_if(vertices.places, [&](const Place& place) { return place.height > ceiling; });
    vertices.neighbour.resize(vertices.places.size());
    vertices.above.resize(vertices.places.size());
    parts = std::move(vertices);
  }
  const double outline_m2 = OutlineArea_m2(parts.places);
  if (!(outline_m2 > 0.0) || outline_m2 < least_m2) return;
  for (const Place& place : parts.places) {
    underside->box.extend(Eigen::Vector3d(place.position.x(), place.position.y(), place.height));
  }
  underside->grid = std::move(parts);
  underside->outline_m2 = outline_m2;
}

void TouchProbe::AddCorners(const std::vector<Eigen::Vector2d>& patch, Underside* underside) {
  const std::vector<HalfPlane> edges = Edges(patch);
  double lowest = TriangleColumns::kNone;
  for (const Place& place : underside->grid.places) lowest = std::min(lowest, place.height);
  std::vector<Eigen::Vector2d> corners;
  for (const Eigen::Vector3d& corner : underside->triangles.Corners()) {
    const Eigen::Vector2d p = corner.head<2>();
    if (corner.z() <= lowest + kCornerBand_m && Contains(edges, p)) corners.push_back(p);
  }
  for (const auto& hull : {patch, ConvexHull2d(std::move(corners))}) {
    Eigen::Vector2d centre = Eigen::Vector2d::Zero();
    for (const Eigen::Vector2d& corner : hull) centre += corner / static_cast<double>(hull.size());
    for (const Eigen::Vector2d& corner : hull) {
      const Eigen::Vector2d inwards = centre - corner;
      const Eigen::Vector2d p = corner + inwards * (kInset_m / (inwards.norm() + kInset_m));
      underside->corners.push_back({p, underside->triangles.Lowest(p)});
    }
  }
}

const TouchProbe::Underside& TouchProbe::UndersideOf(const Contact& contact) {
  const auto known = undersides_.find(contact.name);
  if (known != undersides_.end()) return known->second;
  const Eigen::Isometry3d X_CL = contact.X_LC.inverse(Eigen::Isometry);
  std::vector<Eigen::Vector2d> points;
  for (const Eigen::Vector3d& point : contact.points_L) points.emplace_back((X_CL * point).head<2>());
  const std::vector<Eigen::Vector2d> patch = ConvexHull2d(std::move(points));
  Underside underside = MakeUnderside(contact, X_CL, patch);
  if (contact.declares_points) KeepTouchingParts(patch, &underside);
  return undersides_.emplace(contact.name, std::move(underside)).first->second;
}

double TouchProbe::GapAt(const Place& place) const {
  if (!std::isfinite(place.height)) return kFarGap_m;
  const double surface = scene_.HighestBelow(place.position, place.height + kOverlap_m);
  return std::clamp(place.height - surface, 0.0, kFarGap_m);
}

TouchProbe::Place TouchProbe::Boundary(const Underside& underside, const Place& touching, const Place& other) const {
  Place inside = touching;
  Eigen::Vector2d outside = other.position;
  for (int i = 0; i < kHalvings; ++i) {
    const Eigen::Vector2d p = 0.5 * (inside.position + outside);
    const Place middle{p, underside.triangles.Lowest(p)};
    if (GapAt(middle) <= kTouchTolerance_m) {
      inside = middle;
    } else {
      outside = p;
    }
  }
  return inside;
}

void TouchProbe::CollectScene(const Underside& underside, const Eigen::Isometry3d& X_WC) {
  Eigen::AlignedBox3d box = underside.box;
  box.min().z() -= kFarGap_m;
  box.max().z() += kOverlap_m;
  scene_.Clear();
  collision_.AddSceneTriangles(X_WC, box, &scene_);
}

ContactTouch TouchProbe::Measure(const Contact& contact, const Eigen::Vector3d& normal_W,
                                 const Eigen::Isometry3d& X_WL) {
  if (!X_WL.matrix().allFinite()) return {.gap_m = kFarGap_m, .places_W = {}};
  switch (contact.facts().shape) {
    case ContactShape::kBall:
      return MeasurePoint(contact, normal_W, X_WL);
    case ContactShape::kBar:
      return MeasureBar(contact, X_WL);
    case ContactShape::kPatch:
      break;
  }
  return MeasurePatch(contact, X_WL);
}

ContactTouch TouchProbe::MeasureBar(const Contact& contact, const Eigen::Isometry3d& X_WL) {
  constexpr int kDirections = 8;
  const Eigen::Isometry3d X_WC = X_WL * contact.X_LC, X_CL = contact.X_LC.inverse(Eigen::Isometry);
  ContactTouch touch;
  for (int direction = 0; direction < kDirections; ++direction) {
    const Eigen::Isometry3d X_WD =
        X_WC * Eigen::AngleAxisd(2.0 * std::numbers::pi * direction / kDirections, Eigen::Vector3d::UnitX());
    Eigen::AlignedBox3d box;
    for (const Eigen::Vector3d& point_L : contact.points_L) box.extend((X_CL * point_L).eval());
    box.min().array() -= kFarGap_m;
    box.max().array() += kOverlap_m;
    scene_.Clear();
    collision_.AddSceneTriangles(X_WD, box, &scene_);
    for (const Eigen::Vector3d& point_L : contact.points_L) {
      const double distance_m = -scene_.HighestBelow((X_CL * point_L).head<2>(), 0.0);
      const double gap_m = distance_m < kFarGap_m ? distance_m - contact.radius_m : kFarGap_m;
      touch.gap_m = std::max(touch.gap_m, gap_m);
    }
  }
  return touch;
}

ContactTouch TouchProbe::MeasurePoint(const Contact& contact, const Eigen::Vector3d& normal_W,
                                      const Eigen::Isometry3d& X_WL) {
  Eigen::Isometry3d X_WC = Eigen::Isometry3d::Identity();
  X_WC.linear() = SmallestRotation(Eigen::Vector3d::UnitZ(), normal_W).toRotationMatrix();
  X_WC.translation() = X_WL * contact.X_LC.translation() - contact.radius_m * normal_W;
  const double radius_m = std::max(contact.radius_m, kLeastRadius_m);
  std::vector<Eigen::Vector2d> disc;
  for (int corner = 0; corner < kDiscCorners; ++corner) {
    const double angle = 2.0 * std::numbers::pi * corner / kDiscCorners;
    disc.emplace_back(radius_m * std::cos(angle), radius_m * std::sin(angle));
  }
  const Underside underside = MakeUnderside(contact, X_WC.inverse(Eigen::Isometry) * X_WL, disc);
  ContactTouch touch{.gap_m = kFarGap_m, .places_W = {}};
  if (underside.box.isEmpty()) return touch;
  CollectScene(underside, X_WC);
  std::vector<Eigen::Vector2d> touching;
  const auto measure = [&](const Place& place) {
    const double gap_m = GapAt(place);
    touch.gap_m = std::min(touch.gap_m, gap_m);
    if (gap_m <= kPointTouchTolerance_m) touching.push_back(place.position);
  };
  for (const Place& place : underside.grid.places) measure(place);
  // The lowest point of a ball's mesh is a vertex. That of a sphere is below those of the sphere's own mesh.
  std::vector<Eigen::Vector3d> corners = underside.triangles.Corners();
  corners.insert(corners.end(), underside.bottoms.begin(), underside.bottoms.end());
  for (const Eigen::Vector3d& corner : corners) {
    const bool below = corner.head<2>().norm() <= radius_m && corner.z() <= underside.box.min().z() + kCornerBand_m;
    if (below) measure({corner.head<2>(), corner.z()});
  }
  if (touching.empty()) return touch;
  // The ball's lowest point, unless the link touches only beside it: then the nearest place that touches.
  Eigen::Vector2d support = Eigen::Vector2d::Zero();
  if (SignedDistanceToPolygon(ConvexHull2d(touching), support) > 0.0) {
    support = *std::ranges::min_element(touching, {}, [](const Eigen::Vector2d& p) { return p.squaredNorm(); });
  }
  touch.places_W.emplace_back((X_WC * Eigen::Vector3d(support.x(), support.y(), 0.0)).head<2>());
  return touch;
}

ContactTouch TouchProbe::MeasurePatch(const Contact& contact, const Eigen::Isometry3d& X_WL) {
  const Underside& underside = UndersideOf(contact);
  ContactTouch touch{.gap_m = kFarGap_m, .places_W = {}};
  if (underside.box.isEmpty() || underside.grid.places.empty()) return touch;
  const Grid& grid = underside.grid;
  const Eigen::Isometry3d X_WC = X_WL * contact.X_LC;
  CollectScene(underside, X_WC);

  const auto add = [&](const Place& place) {
    touch.places_W.emplace_back(
        (X_WC * Eigen::Vector3d(place.position.x(), place.position.y(), place.height)).head<2>());
  };
  gaps_.clear();
  for (const Place& place : grid.places) gaps_.push_back(GapAt(place));
  const auto touches = [&](std::size_t i) { return gaps_[i] <= kTouchTolerance_m; };
  for (std::size_t i = 0; i < grid.places.size(); ++i) {
    if (touches(i)) add(grid.places[i]);
    for (const std::size_t other : {grid.neighbour[i], grid.above[i]}) {
      if (touches(i) == touches(other)) continue;
      const auto [inside, outside] = touches(i) ? std::pair(i, other) : std::pair(other, i);
      add(Boundary(underside, grid.places[inside], grid.places[outside]));
    }
  }
  for (const Place& corner : underside.corners) {
    if (GapAt(corner) <= kTouchTolerance_m) add(corner);
  }
  touch.gap_m = GapOfShare(underside);
  return touch;
}

double TouchProbe::GapOfShare(const Underside& underside) {
  const auto share = static_cast<std::size_t>(std::ceil(kTouchShare * static_cast<double>(gaps_.size())));
  if (underside.outline_m2 == 0.0) {
    const auto quantile = gaps_.begin() + static_cast<std::ptrdiff_t>(share) - 1;
    std::ranges::nth_element(gaps_, quantile);
    return *quantile;
  }
  std::vector<std::size_t> order(gaps_.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::stable_sort(order, {}, [&](std::size_t i) { return gaps_[i]; });
  const auto covers = [&](std::size_t count) {
    std::vector<Place> nearest;
    for (std::size_t i = 0; i < count; ++i) nearest.push_back(underside.grid.places[order[i]]);
    return OutlineArea_m2(nearest) >= kTouchShare * underside.outline_m2;
  };
  std::size_t fewest = share, most = order.size();  // all places cover the hull
  while (fewest < most) {
    const std::size_t middle = fewest + (most - fewest) / 2;
    if (covers(middle)) {
      most = middle;
    } else {
      fewest = middle + 1;
    }
  }
  return gaps_[order[most - 1]];
}

}  // namespace legopt
