#include "legopt/geometry/internal/convex_shape.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <limits>
#include <memory>

#include "legopt/geometry/internal/mesh.h"
#include "legopt/types/input_error.h"

extern "C" {
#include <libqhull_r/qhull_ra.h>
}

namespace legopt {
namespace {

using Points = std::span<const Eigen::Vector3d>;

struct FileCloser {
  void operator()(std::FILE* file) const { std::fclose(file); }
};

/// RAII wrapper of one Qhull run.
class QhullRun {
 public:
  QhullRun(std::vector<double>& coordinates, const char* options) : sink_(std::fopen("/dev/null", "w")) {
    qh_zero(&qh_, sink_.get());
    std::string command = std::string("qhull ") + options;
    exit_code_ = qh_new_qhull(&qh_, 3, static_cast<int>(coordinates.size() / 3), coordinates.data(), False,
                              command.data(), sink_.get(), sink_.get());
  }
  ~QhullRun() {
    qh_freeqhull(&qh_, !qh_ALL);
    int long_memory = 0;
    int long_count = 0;
    qh_memfreeshort(&qh_, &long_memory, &long_count);
  }
  QhullRun(const QhullRun&) = delete;
  QhullRun& operator=(const QhullRun&) = delete;

  bool ok() const { return exit_code_ == 0; }
  qhT* qh() { return &qh_; }

 private:
  std::unique_ptr<std::FILE, FileCloser> sink_;
  qhT qh_{};
  int exit_code_ = 0;
};

double Cross2(const Eigen::Vector2d& o, const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  return (a - o).x() * (b - o).y() - (a - o).y() * (b - o).x();
}

/// Returns true if all points lie in one plane, line or point, within a billionth of their spread.
bool IsFlat(Points points) {
  constexpr double kThin = 1e-9;
  const Eigen::Vector3d origin = points.front();
  const auto farthest = [&](auto&& measure) {
    Eigen::Vector3d best = origin;
    for (const Eigen::Vector3d& p : points) {
      if (measure(p) > measure(best)) best = p;
    }
    return best;
  };
  const Eigen::Vector3d along = farthest([&](const auto& p) { return (p - origin).squaredNorm(); }) - origin;
  const double size = along.norm();
  const auto off_line = [&](const auto& p) { return along.cross(p - origin).squaredNorm(); };
  const Eigen::Vector3d normal = along.cross(farthest(off_line) - origin);
  if (!(normal.norm() > kThin * size * size)) return true;
  const Eigen::Vector3d unit = normal.normalized();
  const auto height = [&](const auto& p) { return std::abs(unit.dot(p - origin)); };
  return height(farthest(height)) <= kThin * size;
}

/// Returns the extreme points of a flat set: its hull in the plane (monotone chain), the two ends of a line, or one
/// point.
ConvexHull FlatHull(Points points) {
  const Eigen::Vector3d origin = points.front();
  const auto farthest = [&](auto&& measure) {
    return *std::max_element(points.begin(), points.end(),
                             [&](const auto& a, const auto& b) { return measure(a) < measure(b); });
  };
  const Eigen::Vector3d end = farthest([&](const auto& p) { return (p - origin).squaredNorm(); });
  ConvexHull hull;
  const Eigen::Vector3d u = (end - origin).normalized();
  if (!((end - origin).norm() > 0.0)) {
    hull.vertices = {origin};
    return hull;
  }
  const auto off_line = [&](const auto& p) { return (p - origin - u * u.dot(p - origin)).norm(); };
  const Eigen::Vector3d side = farthest(off_line);
  const double width = off_line(side);
  Eigen::Vector3d v = Eigen::Vector3d::Zero();
  if (width > 1e-9 * (end - origin).norm()) v = (side - origin - u * u.dot(side - origin)).normalized();

  std::vector<int> order(points.size());
  std::vector<Eigen::Vector2d> plane;
  for (size_t i = 0; i < points.size(); ++i) {
    order[i] = static_cast<int>(i);
    plane.emplace_back(u.dot(points[i] - origin), v.dot(points[i] - origin));
  }
  const auto at = [&](int i) -> const Eigen::Vector2d& { return plane[static_cast<size_t>(i)]; };
  std::sort(order.begin(), order.end(),
            [&](int a, int b) { return std::pair(at(a).x(), at(a).y()) < std::pair(at(b).x(), at(b).y()); });
  std::vector<int> chain;
  for (int pass = 0; pass < 2; ++pass) {
    const size_t start = chain.size();
    for (int i : order) {
      while (chain.size() >= start + 2 && Cross2(at(chain[chain.size() - 2]), at(chain.back()), at(i)) <= 0.0) {
        chain.pop_back();
      }
      chain.push_back(i);
    }
    chain.pop_back();
    std::reverse(order.begin(), order.end());
  }
  std::sort(chain.begin(), chain.end());
  chain.erase(std::unique(chain.begin(), chain.end()), chain.end());
  for (int i : chain) hull.vertices.push_back(points[static_cast<size_t>(i)]);
  return hull;
}

/// Adds the used points to the hull's vertices, in the order of the points; returns the vertex index of each point, or
/// -1.
std::vector<int> CollectVertices(qhT* qh, Points points, ConvexHull& hull) {
  std::vector<int> index(points.size(), -1);
  facetT* facet = nullptr;
  vertexT* vertex = nullptr;
  vertexT** vertexp = nullptr;
  FORALLfacets { FOREACHvertex_(facet->vertices) index[static_cast<size_t>(qh_pointid(qh, vertex->point))] = 0; }
  for (size_t i = 0; i < points.size(); ++i) {
    if (index[i] < 0) continue;
    index[i] = static_cast<int>(hull.vertices.size());
    hull.vertices.push_back(points[i]);
  }
  return index;
}

void CollectFacets(qhT* qh, const Eigen::Vector3d& origin, const std::vector<int>& index, ConvexHull& hull) {
  facetT* facet = nullptr;
  vertexT* vertex = nullptr;
  vertexT** vertexp = nullptr;
  FORALLfacets {
    const Eigen::Vector3d normal(facet->normal[0], facet->normal[1], facet->normal[2]);
    const HalfSpace plane{normal, facet->offset - normal.dot(origin)};
    const bool repeated =
        !hull.facets.empty() && hull.facets.back().normal == plane.normal && hull.facets.back().offset == plane.offset;
    if (!repeated) hull.facets.push_back(plane);
    std::array<int, 3> triangle{};
    int corner = 0;
    FOREACHvertex_(facet->vertices) {
      if (corner < 3) triangle[static_cast<size_t>(corner)] = index[static_cast<size_t>(qh_pointid(qh, vertex->point))];
      ++corner;
    }
    if (corner != 3) continue;
    const auto at = [&](int k) { return hull.vertices[static_cast<size_t>(triangle[static_cast<size_t>(k)])]; };
    if ((at(1) - at(0)).cross(at(2) - at(0)).dot(normal) < 0.0) std::swap(triangle[1], triangle[2]);
    hull.triangles.push_back(triangle);
  }
}

double Volume(const ConvexHull& hull) {
  double volume = 0.0;
  const Eigen::Vector3d& o = hull.vertices.front();
  for (const auto& t : hull.triangles) {
    const auto at = [&](int k) -> Eigen::Vector3d {
      return hull.vertices[static_cast<size_t>(t[static_cast<size_t>(k)])] - o;
    };
    volume += at(0).cross(at(1)).dot(at(2)) / 6.0;
  }
  return volume;
}

}  // namespace

double ConvexHull::PlaneDistance(const Eigen::Vector3d& point) const {
  double largest = -std::numeric_limits<double>::infinity();
  for (const HalfSpace& facet : facets) largest = std::max(largest, facet.normal.dot(point) + facet.offset);
  return facets.empty() ? std::numeric_limits<double>::infinity() : largest;
}

ConvexHull ComputeHull(std::span<const Eigen::Vector3d> points) {
  if (points.empty() || !std::all_of(points.begin(), points.end(), [](const auto& p) { return p.allFinite(); })) {
    std::fprintf(stderr, "ComputeHull: %zu points, empty or not finite\n", points.size());
    std::abort();
  }
  if (points.size() < 4 || IsFlat(points)) return FlatHull(points);
  const Eigen::Vector3d origin = points.front();  // reduces rounding errors far from the world's origin
  std::vector<double> coordinates;
  coordinates.reserve(3 * points.size());
  for (const Eigen::Vector3d& p : points) {
    for (int axis = 0; axis < 3; ++axis) coordinates.push_back(p[axis] - origin[axis]);
  }
  // Qt: triangles. Second attempt: joggled input, for sets too thin for facet merging.
  for (const char* options : {"Qt Pp", "QJ Pp"}) {
    QhullRun run(coordinates, options);
    if (!run.ok()) continue;
    ConvexHull hull;
    const std::vector<int> index = CollectVertices(run.qh(), points, hull);
    CollectFacets(run.qh(), origin, index, hull);
    hull.volume_m3 = Volume(hull);
    return hull;
  }
  return FlatHull(points);
}

namespace {

double BoxDistance(const Eigen::Vector3d& half, const Eigen::Vector3d& p) { return (p.cwiseAbs() - half).maxCoeff(); }

double CylinderDistance(double radius, double half_length, const Eigen::Vector3d& p) {
  return std::max(p.head<2>().norm() - radius, std::abs(p.z()) - half_length);
}

double CapsuleDistance(double radius, double half_length, const Eigen::Vector3d& p) {
  const double z = std::clamp(p.z(), -half_length, half_length);
  return (p - Eigen::Vector3d(0.0, 0.0, z)).norm() - radius;
}

ConvexShape::Kind KindOf(ShapeSpec::Kind kind) {
  switch (kind) {
    case ShapeSpec::Kind::kBox:
      return ConvexShape::Kind::kBox;
    case ShapeSpec::Kind::kSphere:
      return ConvexShape::Kind::kSphere;
    case ShapeSpec::Kind::kCylinder:
      return ConvexShape::Kind::kCylinder;
    case ShapeSpec::Kind::kCapsule:
      return ConvexShape::Kind::kCapsule;
    case ShapeSpec::Kind::kMesh:
      break;
  }
  return ConvexShape::Kind::kHull;
}

}  // namespace

ConvexShape ConvexShape::FromHull(ConvexHull hull) {
  ConvexShape shape;
  shape.points_ = hull.vertices;
  shape.hull_ = std::move(hull);
  for (const Eigen::Vector3d& p : shape.points_) shape.centre_ += p / static_cast<double>(shape.points_.size());
  shape.FinishBounds();
  return shape;
}

ConvexShape ConvexShape::FromPrimitive(const ShapeSpec& spec) {
  const TriangleMesh check = Tessellate(spec);  // validates sizes and pose
  ConvexShape shape;
  shape.kind_ = KindOf(spec.kind);
  shape.pose_ = spec.pose;
  shape.size_ = spec.size;
  shape.centre_ = spec.pose.translation();
  const Eigen::Vector3d half_axis = 0.5 * spec.size.z() * spec.pose.linear().col(2);
  switch (shape.kind_) {
    case Kind::kBox:
    case Kind::kHull:
      shape.points_ = check.vertices;
      break;
    case Kind::kSphere:
      shape.points_ = {shape.centre_};
      shape.radius_ = spec.size.x();
      break;
    case Kind::kCapsule:
      shape.points_ = {shape.centre_ - half_axis, shape.centre_ + half_axis};
      shape.radius_ = spec.size.x();
      break;
    case Kind::kCylinder:
      break;
  }
  shape.FinishBounds();
  return shape;
}

void ConvexShape::FinishBounds() {
  SupportSet set;
  PlaceSupportSet(*this, Eigen::Isometry3d::Identity(), set);
  PointArena arena;
  if (!points_.empty()) arena.View(arena.Add(points_), set);
  bounds_ = SupportBounds(set);
  for (const Eigen::Vector3d& p : points_) {
    bounding_radius_ = std::max(bounding_radius_, (p - centre_).norm() + radius_);
  }
  if (points_.empty()) bounding_radius_ = std::hypot(size_.x(), 0.5 * size_.z());
}

double ConvexShape::BoundaryDistance(const Eigen::Vector3d& point) const {
  const Eigen::Vector3d p = pose_.inverse(Eigen::Isometry) * point;
  switch (kind_) {
    case Kind::kHull:
      return hull_.PlaneDistance(point);
    case Kind::kBox:
      return BoxDistance(0.5 * size_, p);
    case Kind::kSphere:
      return p.norm() - size_.x();
    case Kind::kCapsule:
      return CapsuleDistance(size_.x(), 0.5 * size_.z(), p);
    case Kind::kCylinder:
      return CylinderDistance(size_.x(), 0.5 * size_.z(), p);
  }
  return std::numeric_limits<double>::infinity();
}

PointArena::Range PointArena::Add(const std::vector<Eigen::Vector3d>& points) {
  Range range{static_cast<int>(x_.size()), 0};
  for (const Eigen::Vector3d& p : points) {
    x_.push_back(p.x());
    y_.push_back(p.y());
    z_.push_back(p.z());
  }
  while (!points.empty() && x_.size() % SupportSet::kLanes != 0) {
    x_.push_back(points.back().x());
    y_.push_back(points.back().y());
    z_.push_back(points.back().z());
  }
  range.count = static_cast<int>(x_.size()) - range.begin;
  return range;
}

void PointArena::ResizeLike(const PointArena& other) {
  x_.resize(other.x_.size());
  y_.resize(other.y_.size());
  z_.resize(other.z_.size());
}

void PointArena::Transform(const PointArena& other, Range range, const Eigen::Isometry3d& pose, Eigen::Vector3d& lower,
                           Eigen::Vector3d& upper) {
  using Column = Eigen::Array<double, SupportSet::kLanes, 1>;
  const Eigen::Matrix3d r = pose.linear();
  const Eigen::Vector3d t = pose.translation();
  Column low[3];
  Column high[3];
  for (int axis = 0; axis < 3; ++axis) {
    low[axis].setConstant(std::numeric_limits<double>::infinity());
    high[axis].setConstant(-std::numeric_limits<double>::infinity());
  }
  double* const out[3] = {x_.data(), y_.data(), z_.data()};
  for (int i = range.begin; i < range.begin + range.count; i += SupportSet::kLanes) {
    const Column x = Eigen::Map<const Column>(other.x_.data() + i);
    const Column y = Eigen::Map<const Column>(other.y_.data() + i);
    const Column z = Eigen::Map<const Column>(other.z_.data() + i);
    for (int axis = 0; axis < 3; ++axis) {
      const Column value = r(axis, 0) * x + r(axis, 1) * y + r(axis, 2) * z + t[axis];
      Eigen::Map<Column>(out[axis] + i) = value;
      low[axis] = low[axis].min(value);
      high[axis] = high[axis].max(value);
    }
  }
  for (int axis = 0; axis < 3; ++axis) {
    lower[axis] = low[axis].minCoeff();
    upper[axis] = high[axis].maxCoeff();
  }
}

void PointArena::View(Range range, SupportSet& set) const {
  set.x = x_.data() + range.begin;
  set.y = y_.data() + range.begin;
  set.z = z_.data() + range.begin;
  set.count = range.count;
}

void PlaceSupportSet(const ConvexShape& shape, const Eigen::Isometry3d& pose, SupportSet& set) {
  set.radius = shape.radius();
  set.centre = pose * shape.centre();
  if (shape.kind() != ConvexShape::Kind::kCylinder) return;
  set.axis = pose.linear() * shape.pose().linear().col(2);
  set.cylinder_radius = shape.size().x();
  set.half_length = 0.5 * shape.size().z();
}

Eigen::AlignedBox3d SupportBounds(const SupportSet& set) {
  Eigen::Vector3d lower;
  Eigen::Vector3d upper;
  for (int axis = 0; axis < 3; ++axis) {
    upper[axis] = set.Farthest(Eigen::Vector3d::Unit(axis))[axis] + set.radius;
    lower[axis] = set.Farthest(-Eigen::Vector3d::Unit(axis))[axis] - set.radius;
  }
  return {lower, upper};
}

}  // namespace legopt
