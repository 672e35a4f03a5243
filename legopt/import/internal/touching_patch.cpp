#include "legopt/import/internal/touching_patch.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>

#include "legopt/dataset/contact.h"
#include "legopt/types/check.h"

namespace legopt {
namespace {

constexpr double kBand_m = 7e-4;  // with the clearance of 1 mm, still within the judge's 2 mm
constexpr double kShare = 0.85;   // the judge requires 0.75
constexpr int kCells = 32;        // per side

/// Numbers of cells, summed over all rows and columns before.
using Sums = std::array<std::array<int, kCells + 1>, kCells + 1>;

int Count(const Sums& sums, int x0, int y0, int x1, int y1) {
  const auto at = [&](int x, int y) { return sums.at(static_cast<std::size_t>(y)).at(static_cast<std::size_t>(x)); };
  return at(x1, y1) - at(x0, y1) - at(x1, y0) + at(x0, y0);
}

/// Returns the hull of all corners of triangles in the polygon that touch the plane, as of a foot on studs.
std::vector<Eigen::Vector2d> OutlineOfParts(const std::vector<Eigen::Vector2d>& polygon,
                                            const TriangleColumns& underside, double plane) {
  constexpr double kInside_m = 1e-6;
  std::vector<Eigen::Vector2d> outline;
  for (const Eigen::Vector3d& corner : underside.Corners()) {
    if (corner.z() > plane + kPartHeight_m) continue;
    if (SignedDistanceToPolygon(polygon, corner.head<2>()) <= kInside_m) outline.emplace_back(corner.head<2>());
  }
  return ConvexHull2d(std::move(outline));
}

}  // namespace

std::optional<std::vector<Eigen::Vector2d>> TouchingPatch(const std::vector<Eigen::Vector2d>& polygon,
                                                          const TriangleColumns& underside, double plane,
                                                          bool on_parts) {
  Eigen::AlignedBox2d box;
  for (const Eigen::Vector2d& corner : polygon) box.extend(corner);
  const std::vector<HalfPlane> edges = Edges(polygon);
  const Eigen::Vector2d cell = box.sizes() / kCells;
  Sums inside{}, touching{};
  for (std::size_t y = 0; y < kCells; ++y) {
    for (std::size_t x = 0; x < kCells; ++x) {
      const Eigen::Vector2d p =
          box.min() + cell.cwiseProduct(Eigen::Vector2d(static_cast<double>(x) + 0.5, static_cast<double>(y) + 0.5));
      const bool in = std::ranges::all_of(edges, [&](const HalfPlane& edge) { return edge.Distance(p) <= 0.0; });
      const auto add = [&](Sums& sums, bool counts) {
        sums[y + 1][x + 1] = sums[y][x + 1] + sums[y + 1][x] - sums[y][x] + (counts ? 1 : 0);
      };
      add(inside, in);
      add(touching, in && underside.Lowest(p) <= plane + kBand_m);
    }
  }
  const auto touches = [&](int x0, int y0, int x1, int y1, int cells) {
    return Count(touching, x0, y0, x1, y1) >= kShare * cells;
  };
  if (touches(0, 0, kCells, kCells, Count(inside, 0, 0, kCells, kCells))) return polygon;
  const std::vector<Eigen::Vector2d> outline =
      on_parts ? OutlineOfParts(polygon, underside, plane) : std::vector<Eigen::Vector2d>();
  if (PolygonArea(outline) >= kPartOutlineShare * PolygonArea(polygon)) return polygon;
  const auto at = [&](int x, int y) { return Count(touching, x, y, x + 1, y + 1) > 0; };
  std::array<int, 4> best{};
  int largest = 0;
  for (int x0 = 0; x0 < kCells; ++x0) {
    for (int x1 = x0 + 2; x1 <= kCells; ++x1) {
      for (int y0 = 0; y0 < kCells; ++y0) {
        for (int y1 = y0 + 2; y1 <= kCells; ++y1) {
          const int cells = (x1 - x0) * (y1 - y0);
          if (cells <= largest || !touches(x0, y0, x1, y1, cells)) continue;
          if (!at(x0, y0) || !at(x1 - 1, y0) || !at(x0, y1 - 1) || !at(x1 - 1, y1 - 1)) continue;
          largest = cells;
          best = {x0, y0, x1, y1};
        }
      }
    }
  }
  const auto corner = [&](int x, int y) {
    return Eigen::Vector2d(box.min() + cell.cwiseProduct(Eigen::Vector2d(x + 0.5, y + 0.5)));
  };
  const auto [x0, y0, x1, y1] = best;
  const std::vector<Eigen::Vector2d> rectangle = {corner(x0, y0), corner(x1 - 1, y0), corner(x1 - 1, y1 - 1),
                                                  corner(x0, y1 - 1)};
  if (largest > 0 && PolygonArea(rectangle) >= kFlatArea_m2) return rectangle;
  if (PolygonArea(outline) >= kFlatArea_m2) return outline;
  return largest > 0 ? std::optional(rectangle) : std::nullopt;
}

}  // namespace legopt
