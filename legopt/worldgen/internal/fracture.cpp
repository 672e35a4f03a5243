#include "legopt/worldgen/internal/fracture.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numeric>
#include <optional>
#include <voro++/voro++.hh>

#include "legopt/geometry/internal/convex_shape.h"
#include "legopt/geometry/internal/signed_distance.h"
#include "legopt/math/random_numbers.h"

namespace legopt::worldgen {
namespace {

using Eigen::Vector3d;

Eigen::AlignedBox3d BoundsOf(const std::vector<Vector3d>& points) {
  Eigen::AlignedBox3d box;
  for (const Vector3d& p : points) box.extend(p);
  return box;
}

/// Computes volume and centroid by tetrahedra from the first vertex.
void Measure(Cell& cell) {
  const Vector3d origin = cell.vertices.front();
  Vector3d moment = Vector3d::Zero();
  cell.volume_m3 = 0.0;
  for (const std::vector<int>& face : cell.faces) {
    for (size_t k = 1; k + 1 < face.size(); ++k) {
      const Vector3d a = cell.vertices[static_cast<size_t>(face[0])] - origin;
      const Vector3d b = cell.vertices[static_cast<size_t>(face[k])] - origin;
      const Vector3d c = cell.vertices[static_cast<size_t>(face[k + 1])] - origin;
      const double volume = a.dot(b.cross(c)) / 6.0;
      cell.volume_m3 += volume;
      moment += 0.25 * volume * (a + b + c);
    }
  }
  cell.centroid = origin + moment / cell.volume_m3;
}

/// Computes the Voronoi cell of seed `index` within the half spaces and the box; empty if the cell is empty.
std::optional<Cell> VoronoiCell(const std::vector<Vector3d>& seeds, size_t index, const Eigen::AlignedBox3d& box,
                                const std::vector<HalfSpace>& facets, int member) {
  const Vector3d& seed = seeds[index];
  voro::voronoicell region;
  const Vector3d low = box.min() - seed;
  const Vector3d high = box.max() - seed;
  region.init(low.x(), high.x(), low.y(), high.y(), low.z(), high.z());
  const auto cut = [&](const Vector3d& mirror) { return region.plane(mirror.x(), mirror.y(), mirror.z()); };
  for (const HalfSpace& facet : facets) {
    if (facet.normal.cwiseAbs().maxCoeff() > 1.0 - 1e-9) continue;  // coincides with a side of the box
    if (!cut(-2.0 * (facet.normal.dot(seed) + facet.offset) * facet.normal)) return std::nullopt;
  }
  for (size_t other = 0; other < seeds.size(); ++other) {
    if (other != index && !cut(seeds[other] - seed)) return std::nullopt;
  }
  Cell cell;
  cell.member = member;
  std::vector<double> coordinates;
  region.vertices(seed.x(), seed.y(), seed.z(), coordinates);
  for (size_t i = 0; i + 2 < coordinates.size(); i += 3) {
    cell.vertices.emplace_back(coordinates[i], coordinates[i + 1], coordinates[i + 2]);
  }
  std::vector<int> list;
  region.face_vertices(list);
  for (size_t i = 0; i < list.size(); i += static_cast<size_t>(list[i]) + 1) {
    const auto first = list.begin() + static_cast<std::ptrdiff_t>(i) + 1;
    cell.faces.emplace_back(first, first + list[i]);
  }
  Measure(cell);
  if (cell.volume_m3 >= 0.0) return cell;
  for (std::vector<int>& face : cell.faces) std::reverse(face.begin(), face.end());
  Measure(cell);
  return cell;
}

bool Inside(const std::vector<HalfSpace>& facets, const Vector3d& p, double depth_m) {
  return std::all_of(facets.begin(), facets.end(),
                     [&](const HalfSpace& f) { return f.normal.dot(p) + f.offset <= -depth_m; });
}

/// Returns a jittered grid of seeds inside the member.
std::vector<Vector3d> SampleSeeds(const Member& member, const Eigen::AlignedBox3d& box,
                                  const std::vector<HalfSpace>& facets, double cell_m, double jitter,
                                  std::mt19937_64& generator) {
  std::array<int, 3> counts{};
  for (int axis = 0; axis < 3; ++axis) {
    counts[static_cast<size_t>(axis)] = std::max(1, static_cast<int>(std::lround(box.sizes()[axis] / cell_m)));
  }
  std::vector<Vector3d> seeds;
  for (int i = 0; i < counts[0]; ++i) {
    for (int j = 0; j < counts[1]; ++j) {
      for (int k = 0; k < counts[2]; ++k) {
        Vector3d seed;
        const std::array<int, 3> at = {i, j, k};
        for (int axis = 0; axis < 3; ++axis) {
          const auto a = static_cast<size_t>(axis);
          const double draw = UniformRandom(generator) - 0.5;
          const double share = (at[a] + 0.5 + (counts[a] > 1 ? jitter * draw : 0.0)) / counts[a];
          seed[axis] = box.min()[axis] + share * box.sizes()[axis];
        }
        constexpr double kInset = 0.02;
        if (Inside(facets, seed, kInset)) seeds.push_back(seed);
      }
    }
  }
  if (seeds.empty()) {
    Vector3d centre = Vector3d::Zero();
    for (const Vector3d& corner : member.corners) centre += corner / static_cast<double>(member.corners.size());
    seeds.push_back(centre);
  }
  return seeds;
}

/// Adds area and centre of the overlap of two touching faces, by clipping one polygon with the sides of the other.
void AddContact(const Cell& a, const std::vector<int>& face_a, const Cell& b, const std::vector<int>& face_b,
                Bond& bond) {
  constexpr double kGap = 3e-3;
  constexpr double kParallel = 0.9995;
  const auto corner = [](const Cell& cell, const std::vector<int>& face, size_t k) -> const Vector3d& {
    return cell.vertices[static_cast<size_t>(face[k % face.size()])];
  };
  const auto normal_of = [&](const Cell& cell, const std::vector<int>& face) {
    Vector3d sum = Vector3d::Zero();
    for (size_t k = 1; k + 1 < face.size(); ++k) {
      sum += (corner(cell, face, k) - corner(cell, face, 0)).cross(corner(cell, face, k + 1) - corner(cell, face, 0));
    }
    return Vector3d(sum.stableNormalized());
  };
  const Vector3d normal = normal_of(a, face_a);
  if (normal.dot(normal_of(b, face_b)) > -kParallel) return;
  if (std::abs(normal.dot(corner(b, face_b, 0) - corner(a, face_a, 0))) > kGap) return;
  std::vector<Vector3d> polygon;
  for (size_t k = 0; k < face_a.size(); ++k) polygon.push_back(corner(a, face_a, k));
  for (size_t k = 0; k < face_b.size() && !polygon.empty(); ++k) {
    // Seen from outside b the face is counter-clockwise: its inside is left of each side.
    const Vector3d& origin = corner(b, face_b, k);
    const Vector3d inward = (corner(b, face_b, k + 1) - origin).cross(normal);
    std::vector<Vector3d> clipped;
    for (size_t i = 0; i < polygon.size(); ++i) {
      const Vector3d& p = polygon[i];
      const Vector3d& q = polygon[(i + 1) % polygon.size()];
      const double dp = inward.dot(p - origin);
      const double dq = inward.dot(q - origin);
      if (dp >= 0.0) clipped.push_back(p);
      if ((dp >= 0.0) != (dq >= 0.0)) clipped.emplace_back(p + (q - p) * (dp / (dp - dq)));
    }
    polygon = std::move(clipped);
  }
  for (size_t k = 1; k + 1 < polygon.size(); ++k) {
    const double area = 0.5 * normal.dot((polygon[k] - polygon[0]).cross(polygon[k + 1] - polygon[0]));
    bond.centre += area * (polygon[0] + polygon[k] + polygon[k + 1]) / 3.0;
    bond.normal += area * normal;
    bond.area_m2 += area;
  }
}

}  // namespace

Cell WholeCell(const Member& member, int index) {
  const Eigen::AlignedBox3d box = BoundsOf(member.corners);
  const ConvexHull hull = ComputeHull(member.corners);
  Vector3d centre = Vector3d::Zero();
  for (const Vector3d& corner : member.corners) centre += corner / static_cast<double>(member.corners.size());
  return *VoronoiCell({centre}, 0, box, hull.facets, index);
}

std::vector<Cell> Fracture(const Building& building, const FractureOptions& options, std::mt19937_64& generator) {
  std::vector<Cell> cells;
  for (size_t m = 0; m < building.members.size(); ++m) {
    const Member& member = building.members[m];
    const int index = static_cast<int>(m);
    if (member.cell_m <= 0.0) {
      cells.push_back(WholeCell(member, index));
      continue;
    }
    const Eigen::AlignedBox3d box = BoundsOf(member.corners);
    const std::vector<HalfSpace> facets = ComputeHull(member.corners).facets;
    const bool fine = std::any_of(building.foci.begin(), building.foci.end(), [&](const Vector3d& focus) {
      return box.exteriorDistance(focus) < options.fine_radius_m;
    });
    constexpr double kFiner = 0.7;
    const double cell_m = fine ? kFiner * member.cell_m : member.cell_m;
    const std::vector<Vector3d> seeds = SampleSeeds(member, box, facets, cell_m, options.jitter, generator);
    for (size_t s = 0; s < seeds.size(); ++s) {
      constexpr double kNothing = 1e-5;  // m^3
      std::optional<Cell> cell = VoronoiCell(seeds, s, box, facets, index);
      if (cell && cell->volume_m3 > kNothing) cells.push_back(std::move(*cell));
    }
  }
  return cells;
}

std::vector<Bond> FindBonds(const Building& building, const std::vector<Cell>& cells) {
  constexpr double kReach = 4e-3;
  constexpr double kMinArea_m2 = 2e-3;
  std::vector<Eigen::AlignedBox3d> boxes;
  for (const Cell& cell : cells) {
    Eigen::AlignedBox3d box = BoundsOf(cell.vertices);
    boxes.emplace_back(box.min().array() - kReach, box.max().array() + kReach);
  }
  const auto loose = [&](size_t cell) { return building.members[static_cast<size_t>(cells[cell].member)].prop >= 0; };
  std::vector<Bond> bonds;
  for (size_t a = 0; a < cells.size(); ++a) {
    if (loose(a)) continue;
    for (size_t b = a + 1; b < cells.size(); ++b) {
      if (loose(b) || !boxes[a].intersects(boxes[b])) continue;
      Bond bond;
      bond.a = static_cast<int>(a);
      bond.b = static_cast<int>(b);
      bond.normal.setZero();
      for (const auto& face_a : cells[a].faces) {
        for (const auto& face_b : cells[b].faces) AddContact(cells[a], face_a, cells[b], face_b, bond);
      }
      if (bond.area_m2 < kMinArea_m2) continue;
      bond.centre /= bond.area_m2;
      bond.normal.normalize();
      bonds.push_back(bond);
    }
  }
  return bonds;
}

CellContacts::CellContacts(const std::vector<Cell>& cells)
    : motions_(cells.size(), Eigen::Isometry3d::Identity()), present_(cells.size(), true), bounds_(cells.size()) {
  for (const Cell& cell : cells) {
    shapes_.push_back(ConvexShape::FromHull(ComputeHull(cell.vertices)));
    ranges_.push_back(rest_.Add(shapes_.back().points()));
  }
  placed_.ResizeLike(rest_);
  for (size_t i = 0; i < cells.size(); ++i) Place(static_cast<int>(i), Eigen::Isometry3d::Identity());
}

void CellContacts::Place(int cell, const Eigen::Isometry3d& motion) {
  const auto i = static_cast<size_t>(cell);
  motions_[i] = motion;
  placed_.Transform(rest_, ranges_[i], motion, bounds_[i].min(), bounds_[i].max());
}

void CellContacts::Remove(int cell) { present_[static_cast<size_t>(cell)] = false; }

std::vector<std::pair<int, int>> CellContacts::Pairs(const std::vector<bool>& active) const {
  std::vector<int> order;
  for (size_t i = 0; i < present_.size(); ++i) {
    if (present_[i]) order.push_back(static_cast<int>(i));
  }
  const auto low = [&](int i) { return bounds(i).min().x(); };
  std::sort(order.begin(), order.end(), [&](int a, int b) { return low(a) != low(b) ? low(a) < low(b) : a < b; });
  std::vector<std::pair<int, int>> pairs;
  for (size_t i = 0; i < order.size(); ++i) {
    const int a = order[i];
    const double end = bounds(a).max().x();
    for (size_t j = i + 1; j < order.size() && low(order[j]) <= end; ++j) {
      const int b = order[j];
      if (!active[static_cast<size_t>(a)] && !active[static_cast<size_t>(b)]) continue;
      if (bounds(a).intersects(bounds(b))) pairs.emplace_back(std::min(a, b), std::max(a, b));
    }
  }
  std::sort(pairs.begin(), pairs.end());
  return pairs;
}

SupportSet CellContacts::SetOf(int cell) const {
  const auto i = static_cast<size_t>(cell);
  SupportSet set;
  placed_.View(ranges_[i], set);
  PlaceSupportSet(shapes_[i], motions_[i], set);
  set.lower = bounds_[i].min();
  set.upper = bounds_[i].max();
  return set;
}

double CellContacts::PlaneDistance(int cell, const Vector3d& point) const {
  const auto i = static_cast<size_t>(cell);
  return shapes_[i].hull().PlaneDistance(motions_[i].inverse(Eigen::Isometry) * point);
}

std::vector<CellContacts::Point> CellContacts::Touch(int a, int b) const {
  PairDistance distance;
  if (!SignedDistance(SetOf(a), SetOf(b), 0.0, distance)) return {};
  const Vector3d& normal = distance.normal;
  std::vector<Point> points;
  const auto add_vertices = [&](int of, int in, double sign) {
    const auto i = static_cast<size_t>(of);
    const SupportSet other = SetOf(in);
    const double support = normal.dot(other.Farthest(sign * normal));
    for (const Vector3d& vertex : shapes_[i].points()) {
      const Vector3d p = motions_[i] * vertex;
      constexpr double kSlack = 1e-3;
      if (!bounds(in).contains(p) || PlaneDistance(in, p) > kSlack) continue;
      const double depth = sign * (support - normal.dot(p));
      if (depth > 0.0) points.push_back({p, normal, std::min(depth, -distance.distance_m)});
    }
  };
  add_vertices(a, b, 1.0);
  add_vertices(b, a, -1.0);
  points.push_back({0.5 * (distance.point_a + distance.point_b), normal, -distance.distance_m});
  std::stable_sort(points.begin(), points.end(), [](const Point& p, const Point& q) { return p.depth_m > q.depth_m; });
  if (points.size() > kMaxPoints) {
    // Keeps the deepest point, then repeatedly the one farthest from all kept points: a few spread-out points carry the
    // load.
    std::vector<Point> kept = {points.front()};
    std::vector<double> gap(points.size());
    for (size_t k = 0; k < points.size(); ++k) gap[k] = (points[k].position - kept[0].position).squaredNorm();
    while (kept.size() < kMaxPoints) {
      const auto best = static_cast<size_t>(std::max_element(gap.begin(), gap.end()) - gap.begin());
      kept.push_back(points[best]);
      for (size_t k = 0; k < points.size(); ++k) {
        gap[k] = std::min(gap[k], (points[k].position - kept.back().position).squaredNorm());
      }
    }
    points = std::move(kept);
  }
  return points;
}

}  // namespace legopt::worldgen
