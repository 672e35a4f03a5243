#include "legopt/planning/certify/internal/balance_prover.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "legopt/statics/equilibrium_polygon.h"
#include "legopt/statics/stance_forces.h"
#include "legopt/types/number_text.h"

namespace legopt::certify {
namespace {

/// Distance of a point from a convex polygon, counter-clockwise with one corner or more; 0 inside.
double DistanceFrom(std::span<const Eigen::Vector2d> polygon, const Eigen::Vector2d& p) {
  if (polygon.size() > 2 && SignedDistanceToPolygon(polygon, p) <= 0.0) return 0.0;
  double least = (polygon.front() - p).norm();
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Eigen::Vector2d& a = polygon[i];
    const Eigen::Vector2d edge = polygon[(i + 1) % polygon.size()] - a;
    const double share = edge.squaredNorm() > 0.0 ? std::clamp(edge.dot(p - a) / edge.squaredNorm(), 0.0, 1.0) : 0.0;
    least = std::min(least, (a + share * edge - p).norm());
  }
  return least;
}

}  // namespace

std::optional<std::string> RefuteBalance(const Dataset& dataset, const Stance& stance) {
  constexpr double kTolerances_m = 5e-3;  // more than the judge's for contacts and centre of mass together
  constexpr int kDigits = 4;
  const bool on_feet = StandsOnFeet(dataset, stance);
  std::vector<Eigen::Vector2d> polygon = TargetSupportPolygon(dataset, stance);
  if (!on_feet) {
    if (SlidesUnderLoad(dataset, stance)) return std::nullopt;  // the polygon depends on where the bars are gripped
    const EquilibriumPolygon equilibrium = ComputeEquilibriumPolygon(StanceForces(SurfacesOf(dataset, stance)));
    if (equilibrium.slide) return "no forces within friction and bounds hold the contacts in any posture";
    polygon = equilibrium.corners;
  }
  if (polygon.empty()) return std::nullopt;
  for (const ContactTarget& target : stance.contacts) {
    const Contact& contact = dataset.contact(target.contact);
    if (contact.SlideOf(target) > 0.0) continue;
    const double distance_m = DistanceFrom(polygon, contact.OriginTarget(target).head<2>());
    const double reach_m = contact.com_reach_m;
    if (distance_m <= reach_m + kTolerances_m) continue;
    return "the centre of mass must be " + FormatGeneral(distance_m, kDigits) + " m or more from " + target.contact +
           ", and reaches " + FormatGeneral(reach_m, kDigits) + " m";
  }
  return std::nullopt;
}

}  // namespace legopt::certify
