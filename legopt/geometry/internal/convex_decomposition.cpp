#include "legopt/geometry/internal/convex_decomposition.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <limits>
#include <map>
#include <numbers>
#include <set>
#include <tuple>
#include <utility>

#include "legopt/geometry/internal/mesh_bodies.h"
#include "legopt/geometry/internal/triangle_bvh.h"
#include "legopt/math/parallel.h"

namespace legopt {
namespace {

using Triangle = std::array<Eigen::Vector3d, 3>;

constexpr int kSamples = 240;          // number of concavity samples on the hull of a piece
constexpr int kPositionsPerAxis = 7;   // number of candidate planes per axis
constexpr double kMinimumGain = 0.02;  // minimum gain of a cut, relative to the piece's volume

struct Piece {
  std::vector<Triangle> triangles;
  std::vector<Eigen::Vector3d> points;  ///< unique corners of the triangles
  std::vector<HalfSpace> cuts;
  ConvexHull hull;
  double concavity_m = 0.0;
  bool final = false;
};

void KeepDistinct(std::vector<Eigen::Vector3d>& points) {
  const auto less = [](const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
    return std::tuple(a.x(), a.y(), a.z()) < std::tuple(b.x(), b.y(), b.z());
  };
  std::sort(points.begin(), points.end(), less);
  points.erase(std::unique(points.begin(), points.end()), points.end());
}

std::vector<Eigen::Vector3d> DistinctCorners(const std::vector<Triangle>& triangles) {
  std::vector<Eigen::Vector3d> points;
  points.reserve(3 * triangles.size());
  for (const Triangle& t : triangles) points.insert(points.end(), t.begin(), t.end());
  KeepDistinct(points);
  return points;
}

/// Keeps the part on the inner side of the plane; a triangle across the plane is split into up to two.
void ClipTo(const HalfSpace& plane, const Triangle& t, std::vector<Triangle>& out) {
  std::array<Eigen::Vector3d, 4> polygon;
  size_t count = 0;
  for (size_t k = 0; k < 3; ++k) {
    const Eigen::Vector3d& a = t[k];
    const Eigen::Vector3d& b = t[(k + 1) % 3];
    const double da = plane.normal.dot(a) + plane.offset;
    const double db = plane.normal.dot(b) + plane.offset;
    if (da <= 0.0) polygon[count++] = a;
    if ((da < 0.0 && db > 0.0) || (da > 0.0 && db < 0.0)) polygon[count++] = a + (b - a) * (da / (da - db));
  }
  if (count >= 3) out.push_back({polygon[0], polygon[1], polygon[2]});
  if (count == 4) out.push_back({polygon[0], polygon[2], polygon[3]});
}

/// Returns the distance along the ray to a triangle, from either side; infinity if it is missed.
double RayTriangle(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction, const Triangle& t) {
  constexpr double kMissed = std::numeric_limits<double>::infinity();
  constexpr double kEdgeSlack = 1e-9;
  const Eigen::Vector3d e1 = t[1] - t[0];
  const Eigen::Vector3d e2 = t[2] - t[0];
  const Eigen::Vector3d p = direction.cross(e2);
  const double determinant = e1.dot(p);
  if (determinant == 0.0) return kMissed;
  const Eigen::Vector3d s = origin - t[0];
  const double u = s.dot(p) / determinant;
  if (u < -kEdgeSlack || u > 1.0 + kEdgeSlack) return kMissed;
  const Eigen::Vector3d q = s.cross(e1);
  const double v = direction.dot(q) / determinant;
  if (v < -kEdgeSlack || u + v > 1.0 + kEdgeSlack) return kMissed;
  const double distance = e2.dot(q) / determinant;
  constexpr double kBehind = -1e-7;
  return distance < kBehind ? kMissed : std::max(distance, 0.0);
}

bool OnCut(const Piece& piece, const Eigen::Vector3d& point, const Eigen::Vector3d& normal) {
  constexpr double kParallel = 1.0 - 1e-6;
  constexpr double kNear = 1e-6;
  return std::any_of(piece.cuts.begin(), piece.cuts.end(), [&](const HalfSpace& cut) {
    return cut.normal.dot(normal) > kParallel && std::abs(cut.normal.dot(point) + cut.offset) < kNear;
  });
}

/// Search tree over the triangles of a piece.
class PieceTriangles {
 public:
  explicit PieceTriangles(const std::vector<Triangle>& triangles) : triangles_(triangles), tree_(SoupOf(triangles)) {
    for (const Triangle& t : triangles) {
      for (const Eigen::Vector3d& corner : t) box_.extend(corner);
    }
  }

  /// Returns the distance along the ray to the nearest triangle; 0 if there is none: the ray then passed through a
  /// seam, which is not a gap. The segment in which triangles are searched is doubled until it has one.
  double Gap(const Eigen::Vector3d& point, const Eigen::Vector3d& direction) const {
    constexpr double kFirstShare = 1.0 / 64.0, kSlack = 1e-6;
    const double longest = box_.diagonal().norm();
    for (double length = kFirstShare * longest; longest > 0.0; length *= 2.0) {
      const Eigen::Vector3d end = point + length * direction;
      Eigen::AlignedBox3d box(point.cwiseMin(end), point.cwiseMax(end));
      const Eigen::Vector3d slack = Eigen::Vector3d::Constant(kSlack * (1.0 + longest));
      box.min() -= slack;
      box.max() += slack;
      double gap = std::numeric_limits<double>::infinity();
      tree_.AnyOverlapping(box, [&](int t) {
        gap = std::min(gap, RayTriangle(point, direction, triangles_[static_cast<size_t>(t)]));
        return false;
      });
      if (gap <= length) return gap;
      if (length > 2.0 * longest) break;
    }
    return 0.0;
  }

 private:
  static TriangleMesh SoupOf(const std::vector<Triangle>& triangles) {
    TriangleMesh mesh;
    for (const Triangle& t : triangles) {
      const int first = static_cast<int>(mesh.vertices.size());
      mesh.vertices.insert(mesh.vertices.end(), t.begin(), t.end());
      mesh.triangles.push_back({first, first + 1, first + 2});
    }
    return mesh;
  }

  const std::vector<Triangle>& triangles_;
  TriangleBvh tree_;
  Eigen::AlignedBox3d box_;
};

/// Returns the maximum gap between hull and mesh over samples spread evenly over the hull's own facets, not over cuts.
double MeasureConcavity(const Piece& piece) {
  const ConvexHull& hull = piece.hull;
  if (hull.flat()) return 0.0;
  const auto corner = [&](const std::array<int, 3>& t, size_t k) { return hull.vertices[static_cast<size_t>(t[k])]; };
  double area = 0.0;
  for (const auto& t : hull.triangles) area += (corner(t, 1) - corner(t, 0)).cross(corner(t, 2) - corner(t, 0)).norm();
  double largest = 0.0;
  const PieceTriangles triangles(piece.triangles);
  for (const auto& t : hull.triangles) {
    const Eigen::Vector3d a = corner(t, 0);
    const Eigen::Vector3d cross = (corner(t, 1) - a).cross(corner(t, 2) - a);
    if (!(cross.norm() > 1e-12)) continue;
    const Eigen::Vector3d normal = cross.normalized();
    if (OnCut(piece, a, normal)) continue;
    // n (n + 1) / 2 samples in a triangular grid
    const int n = std::clamp(static_cast<int>(std::sqrt(2.0 * kSamples * cross.norm() / area)), 1, 2 * kSamples);
    for (int i = 0; i < n; ++i) {
      for (int j = 0; i + j < n; ++j) {
        const double u = (i + 1.0 / 3.0) / n;
        const double v = (j + 1.0 / 3.0) / n;
        const Eigen::Vector3d point = a + u * (corner(t, 1) - a) + v * (corner(t, 2) - a);
        largest = std::max(largest, triangles.Gap(point, -normal));
      }
    }
  }
  return largest;
}

/// Directions for a cheap inner approximation of a hull: a cube's faces, edges and corners, and directions between
/// them.
const std::vector<Eigen::Vector3d>& SampleDirections() {
  static const std::vector<Eigen::Vector3d> directions = [] {
    std::vector<Eigen::Vector3d> result;
    for (int x = -2; x <= 2; ++x) {
      for (int y = -2; y <= 2; ++y) {
        for (int z = -2; z <= 2; ++z) {
          if (std::max({std::abs(x), std::abs(y), std::abs(z)}) == 2) {
            result.push_back(Eigen::Vector3d(x, y, z).normalized());
          }
        }
      }
    }
    return result;
  }();
  return directions;
}

/// Estimates the volume of the hull of the part inside the plane, slightly too low: uses extreme points in scout
/// directions only.
double EstimateVolume(const Piece& piece, const HalfSpace& plane) {
  std::vector<Eigen::Vector3d> points;
  points.reserve(piece.points.size());
  for (const Eigen::Vector3d& p : piece.points) {
    if (plane.normal.dot(p) + plane.offset <= 0.0) points.push_back(p);
  }
  for (const Triangle& t : piece.triangles) {
    for (size_t k = 0; k < 3; ++k) {
      const Eigen::Vector3d& a = t[k];
      const Eigen::Vector3d& b = t[(k + 1) % 3];
      const double da = plane.normal.dot(a) + plane.offset;
      const double db = plane.normal.dot(b) + plane.offset;
      if (da < 0.0 && db > 0.0) points.push_back(a + (b - a) * (da / (da - db)));
    }
  }
  if (points.empty()) return 0.0;
  Eigen::Map<const Eigen::Matrix3Xd> matrix(points.front().data(), 3, static_cast<Eigen::Index>(points.size()));
  std::vector<Eigen::Vector3d> extreme;
  for (const Eigen::Vector3d& d : SampleDirections()) {
    Eigen::Index best = 0;
    (d.transpose() * matrix).maxCoeff(&best);
    extreme.push_back(points[static_cast<size_t>(best)]);
  }
  KeepDistinct(extreme);
  return ComputeHull(extreme).volume_m3;
}

HalfSpace Opposite(const HalfSpace& plane) { return {-plane.normal, -plane.offset}; }

/// Returns the cut with the smallest sum of volumes, which is stored in `sum`.
HalfSpace BestCut(const Piece& piece, double& sum) {
  HalfSpace best{Eigen::Vector3d::UnitX(), 0.0};
  sum = std::numeric_limits<double>::infinity();
  for (int axis = 0; axis < 3; ++axis) {
    double low = std::numeric_limits<double>::infinity();
    double high = -low;
    for (const Eigen::Vector3d& p : piece.points) {
      low = std::min(low, p[axis]);
      high = std::max(high, p[axis]);
    }
    for (int i = 1; i <= kPositionsPerAxis; ++i) {
      const HalfSpace plane{Eigen::Vector3d::Unit(axis), -(low + (high - low) * i / (kPositionsPerAxis + 1))};
      const double volume = EstimateVolume(piece, plane) + EstimateVolume(piece, Opposite(plane));
      if (volume < sum) {
        sum = volume;
        best = plane;
      }
    }
  }
  return best;
}

Piece Half(const Piece& whole, const HalfSpace& plane) {
  Piece half;
  half.cuts = whole.cuts;
  half.cuts.push_back(plane);
  for (const Triangle& t : whole.triangles) ClipTo(plane, t, half.triangles);
  if (half.triangles.empty()) return half;
  half.points = DistinctCorners(half.triangles);
  half.hull = ComputeHull(half.points);
  half.concavity_m = MeasureConcavity(half);
  return half;
}

std::vector<Triangle> Triangles(const TriangleMesh& mesh) {
  std::vector<Triangle> triangles;
  triangles.reserve(mesh.triangles.size());
  for (const auto& t : mesh.triangles) {
    const auto at = [&](size_t k) { return mesh.vertices[static_cast<size_t>(t[k])]; };
    triangles.push_back({at(0), at(1), at(2)});
  }
  return triangles;
}

}  // namespace

bool IsConvex(const TriangleMesh& mesh, const ConvexHull& hull, double tolerance_m) {
  if (hull.flat()) return true;
  for (const Triangle& t : Triangles(mesh)) {
    const Eigen::Vector3d centre = (t[0] + t[1] + t[2]) / 3.0;
    for (const Eigen::Vector3d& p : {t[0], t[1], t[2], centre}) {
      if (hull.PlaneDistance(p) < -tolerance_m) return false;
    }
  }
  return true;
}

namespace {

std::vector<Piece> CutIntoPieces(const TriangleMesh& mesh, const DecompositionLimits& limits) {
  std::vector<Piece> pieces(1);
  pieces[0].triangles = Triangles(mesh);
  pieces[0].points = mesh.vertices;
  pieces[0].hull = ComputeHull(mesh.vertices);
  pieces[0].concavity_m = limits.max_pieces > 1 ? MeasureConcavity(pieces[0]) : 0.0;
  while (static_cast<int>(pieces.size()) < limits.max_pieces) {
    Piece* worst = nullptr;
    for (Piece& piece : pieces) {
      if (piece.final || piece.concavity_m <= limits.concavity_m) continue;
      if (worst == nullptr || piece.concavity_m > worst->concavity_m) worst = &piece;
    }
    if (worst == nullptr) break;
    double sum = 0.0;
    const HalfSpace plane = BestCut(*worst, sum);
    Piece low = Half(*worst, plane);
    Piece high = Half(*worst, Opposite(plane));
    if (low.triangles.empty() || high.triangles.empty() ||
        low.hull.volume_m3 + high.hull.volume_m3 > (1.0 - kMinimumGain) * worst->hull.volume_m3) {
      worst->final = true;
      continue;
    }
    *worst = std::move(low);
    pieces.push_back(std::move(high));
  }
  return pieces;
}

/// Merges the vertices in each cell of a grid into its first vertex, and omits triangles that lose their area.
TriangleMesh MergedInCells(const TriangleMesh& mesh, const Eigen::Vector3d& low, double cell_m) {
  std::map<std::array<std::int64_t, 3>, int> cells;
  TriangleMesh merged;
  std::vector<int> index;
  index.reserve(mesh.vertices.size());
  for (const Eigen::Vector3d& vertex : mesh.vertices) {
    const Eigen::Array3d place = ((vertex - low) / cell_m).array().floor();
    const std::array<std::int64_t, 3> cell = {static_cast<std::int64_t>(place[0]), static_cast<std::int64_t>(place[1]),
                                              static_cast<std::int64_t>(place[2])};
    const auto [found, fresh] = cells.try_emplace(cell, static_cast<int>(merged.vertices.size()));
    if (fresh) merged.vertices.push_back(vertex);
    index.push_back(found->second);
  }
  std::set<std::array<int, 3>> distinct;
  for (const auto& t : mesh.triangles) {
    std::array<int, 3> corners = {index[static_cast<size_t>(t[0])], index[static_cast<size_t>(t[1])],
                                  index[static_cast<size_t>(t[2])]};
    std::array<int, 3> sorted = corners;
    std::ranges::sort(sorted);
    if (sorted[0] == sorted[1] || sorted[1] == sorted[2] || !distinct.insert(sorted).second) continue;
    merged.triangles.push_back(corners);
  }
  return merged;
}

/// Returns a mesh of at most `max_triangles` triangles with nearly the shape of `mesh`.
TriangleMesh Sampled(const TriangleMesh& mesh, int max_triangles) {
  constexpr double kFirstCell = 1.0 / 256.0;  // relative to the diagonal
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3d& vertex : mesh.vertices) box.extend(vertex);
  TriangleMesh sample = mesh;
  for (double cell_m = kFirstCell * box.diagonal().norm(); std::ssize(sample.triangles) > max_triangles;
       cell_m *= std::numbers::sqrt2) {
    sample = MergedInCells(mesh, box.min(), cell_m);
  }
  return sample;
}

}  // namespace

std::vector<ConvexHull> DecomposeApproximately(const TriangleMesh& mesh, const DecompositionLimits& limits) {
  std::vector<ConvexHull> hulls;
  for (Piece& piece : CutIntoPieces(mesh, limits)) hulls.push_back(std::move(piece.hull));
  return hulls;
}

std::vector<ConvexHull> DecomposeBySample(const TriangleMesh& mesh, const DecompositionLimits& limits,
                                          int max_triangles) {
  if (std::ssize(mesh.triangles) <= max_triangles) return DecomposeApproximately(mesh, limits);
  const TriangleMesh sample = Sampled(mesh, max_triangles);
  if (sample.triangles.empty()) return {ComputeHull(mesh.vertices)};
  const std::vector<Triangle> all = Triangles(mesh);
  std::vector<ConvexHull> hulls;
  for (const Piece& piece : CutIntoPieces(sample, limits)) {
    std::vector<Triangle> inside = all, clipped;
    for (const HalfSpace& cut : piece.cuts) {
      clipped.clear();
      for (const Triangle& t : inside) ClipTo(cut, t, clipped);
      inside.swap(clipped);
    }
    if (!inside.empty()) hulls.push_back(ComputeHull(DistinctCorners(inside)));
  }
  return hulls;
}

std::vector<ConvexHull> DecomposeBodies(const TriangleMesh& mesh, const DecompositionLimits& limits) {
  const std::vector<TriangleMesh> bodies = SplitIntoComponents(mesh);
  std::vector<std::vector<ConvexHull>> pieces(bodies.size());
  ForEachIndex(NumProcessors(), bodies.size(),
               [&](int, size_t i) { pieces[i] = DecomposeApproximately(bodies[i], limits); });
  std::vector<ConvexHull> hulls;
  for (std::vector<ConvexHull>& some : pieces) std::ranges::move(some, std::back_inserter(hulls));
  return hulls;
}

namespace {

/// The geometry of a link, with meshes read.
struct LinkGeometry {
  explicit LinkGeometry(const RobotModel& robot, int link)
      : shapes(robot.links()[static_cast<size_t>(link)].collision) {
    for (const ShapeSpec& shape : shapes) {
      meshes.push_back(shape.kind == ShapeSpec::Kind::kMesh ? Tessellate(shape, robot.read_guard()) : TriangleMesh());
    }
  }

  const std::vector<ShapeSpec>& shapes;
  std::vector<TriangleMesh> meshes;  ///< one per shape; empty for primitives
};

/// `decompose`: from a mesh to its hulls.
template <class Decomposition>
std::vector<ConvexShape> Decompose(const LinkGeometry& link, Decomposition decompose) {
  std::vector<ConvexShape> shapes;
  for (size_t i = 0; i < link.shapes.size(); ++i) {
    if (link.shapes[i].kind != ShapeSpec::Kind::kMesh) {
      shapes.push_back(ConvexShape::FromPrimitive(link.shapes[i]));
      continue;
    }
    for (ConvexHull& hull : decompose(link.meshes[i])) shapes.push_back(ConvexShape::FromHull(std::move(hull)));
  }
  return shapes;
}

}  // namespace

std::vector<ConvexHull> LinkPieces::DecomposeWhole(const TriangleMesh& mesh) const {
  return method_ == DecompositionMethod::kSample ? DecomposeBySample(mesh, limits_)
                                                 : DecomposeApproximately(mesh, limits_);
}

void LinkPieces::PreparePieces(const std::set<int>& links) {
  struct Work {
    LinkGeometry geometry;
    std::vector<ConvexShape>* pieces;
  };
  std::vector<Work> work;
  for (const int link : links) {
    const auto [it, inserted] = pieces_.try_emplace(link);
    if (inserted) work.push_back({LinkGeometry(robot_, link), &it->second});
  }
  ForEachIndex(NumProcessors(), work.size(), [&](int, size_t i) {
    *work[i].pieces = Decompose(work[i].geometry, [this](const TriangleMesh& mesh) { return DecomposeWhole(mesh); });
  });
}

const std::vector<ConvexShape>& LinkPieces::Pieces(int link) {
  PreparePieces({link});
  return pieces_.at(link);
}

const std::vector<ConvexShape>& LinkPieces::Bodies(int link) {
  const auto [it, inserted] = bodies_.try_emplace(link);
  if (inserted) {
    it->second = Decompose(LinkGeometry(robot_, link),
                           [this](const TriangleMesh& mesh) { return DecomposeBodies(mesh, limits_); });
  }
  return it->second;
}

}  // namespace legopt
