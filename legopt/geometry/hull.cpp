#include "legopt/geometry/hull.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <limits>
#include <memory>

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

}  // namespace legopt
