#include "legopt/dataset/contact.h"

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <limits>

#include "legopt/dataset/dataset.h"
#include "legopt/dataset/problem_definition.h"

namespace legopt {
namespace {

Eigen::Isometry3d FrameOf(const ContactDescription& description) {
  Eigen::Isometry3d frame = Eigen::Isometry3d::Identity();
  frame.translation() = description.position;
  const Eigen::Vector3d& rpy = description.rpy_rad;
  if (!rpy.isZero(0.0)) {  // a product of unit quaternions is not exactly the identity
    frame.linear() =
        (Eigen::AngleAxisd(rpy.z(), Eigen::Vector3d::UnitZ()) * Eigen::AngleAxisd(rpy.y(), Eigen::Vector3d::UnitY()) *
         Eigen::AngleAxisd(rpy.x(), Eigen::Vector3d::UnitX()))
            .toRotationMatrix();
  }
  return frame;
}

std::vector<Eigen::Vector3d> LowerCorners(const Eigen::AlignedBox3d& box) {
  std::vector<Eigen::Vector3d> corners;
  for (const double x : {box.min().x(), box.max().x()}) {
    for (const double y : {box.min().y(), box.max().y()}) corners.emplace_back(x, y, box.min().z());
  }
  return corners;
}

}  // namespace

Eigen::AlignedBox2d Contact::Patch() const {
  const Eigen::Isometry3d X_CL = X_LC.inverse();
  Eigen::AlignedBox2d patch;
  for (const Eigen::Vector3d& point : points_L) patch.extend((X_CL * point).head<2>().eval());
  return patch;
}

Eigen::Vector3d NormalOf(const ContactTarget& target) { return target.rotation.normalized().toRotationMatrix().col(2); }

Eigen::Vector3d Contact::OriginTarget(const ContactTarget& target) const {
  if (facts().shape != ContactShape::kBall) return target.position;
  return target.position + (radius_m + kPointClearance_m) * NormalOf(target);
}

double Contact::SlideOf(const ContactTarget& target) const {
  return facts().slides ? target.slide_m.value_or(slide_m) : 0.0;
}

Eigen::Isometry3d Contact::LinkTarget(const ContactTarget& target) const {
  const Eigen::Matrix3d R_WC = target.rotation.normalized().toRotationMatrix();
  const Eigen::Isometry3d X_CL = X_LC.inverse();
  Eigen::Isometry3d X_WL = Eigen::Isometry3d::Identity();
  X_WL.linear() = R_WC * X_CL.linear();
  X_WL.translation() = OriginTarget(target) + R_WC * X_CL.translation();
  return X_WL;
}

std::vector<ContactDescription> DescribeSoles(const std::vector<std::string>& links, double sole_offset_m) {
  std::vector<ContactDescription> contacts;
  for (const std::string& link : links) {
    ContactDescription& contact = contacts.emplace_back();
    contact.name = contact.link = link;
    contact.position.z() = -sole_offset_m;
  }
  return contacts;
}

std::optional<double> CommonSoleOffset_m(const std::vector<ContactDescription>& contacts) {
  if (contacts.empty()) return {};
  const double offset_m = 0.0 - contacts.front().position.z();  // never -0
  std::vector<std::string> links;
  for (const ContactDescription& contact : contacts) links.push_back(contact.link);
  if (!(offset_m >= 0.0) || contacts != DescribeSoles(links, offset_m)) return {};
  return offset_m;
}

Contact ResolveContact(const ContactDescription& description, int link_index, const Eigen::AlignedBox3d& link_box) {
  const bool contact_is_ball = DescriptionOf(description.kind).shape == ContactShape::kBall;
  Contact contact{.name = description.name,
                  .link = description.link,
                  .link_index = link_index,
                  .kind = description.kind,
                  .X_LC = FrameOf(description),
                  .points_L = {},
                  .radius_m = description.radius_m,
                  .box_L = link_box,
                  .friction = description.friction,
                  .max_normal_N = description.max_normal_N,
                  .max_force_N = description.max_force_N,
                  .slide_m = description.slide_m,
                  .nominal_position_B = Eigen::Vector3d::Zero(),
                  .com_reach_m = 0.0,
                  .declares_points = description.points.has_value() || contact_is_ball};
  if (contact_is_ball) {
    contact.points_L.emplace_back(description.position);
  } else if (!description.points) {
    contact.points_L = LowerCorners(link_box);
  } else {
    for (const Eigen::Vector3d& point : *description.points) contact.points_L.push_back(contact.X_LC * point);
  }
  return contact;
}

namespace {

/// Corners closer than this (metres) are merged, since a very short edge has no reliable direction.
constexpr double kMergeDistance_m = 1e-9;

double Cross(const Eigen::Vector2d& o, const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  const Eigen::Vector2d u = a - o;
  const Eigen::Vector2d v = b - o;
  return u.x() * v.y() - u.y() * v.x();
}

/// Appends `point` to the chain `hull[begin..]` and removes points that are not left turns.
void ExtendChain(const Eigen::Vector2d& point, size_t begin, std::vector<Eigen::Vector2d>* hull) {
  while (hull->size() >= begin + 2 && Cross((*hull)[hull->size() - 2], hull->back(), point) <= 0) hull->pop_back();
  hull->push_back(point);
}

void MergeShortEdges(std::vector<Eigen::Vector2d>* hull) {
  std::vector<Eigen::Vector2d> kept;
  for (const Eigen::Vector2d& corner : *hull) {
    const bool repeats_last = !kept.empty() && (corner - kept.back()).norm() < kMergeDistance_m;
    const bool repeats_first = !kept.empty() && (corner - kept.front()).norm() < kMergeDistance_m;
    if (!repeats_last && !repeats_first) kept.push_back(corner);
  }
  *hull = std::move(kept);
}

HalfPlane Through(const Eigen::Vector2d& point, const Eigen::Vector2d& outward) {
  return {.normal = outward, .offset = -outward.dot(point)};
}

}  // namespace

std::vector<Eigen::Vector2d> ConvexHull2d(std::vector<Eigen::Vector2d> points) {
  std::sort(points.begin(), points.end(), [](const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
    return a.x() != b.x() ? a.x() < b.x() : a.y() < b.y();
  });
  std::vector<Eigen::Vector2d> hull;
  for (const Eigen::Vector2d& point : points) ExtendChain(point, 0, &hull);
  const size_t lower = hull.empty() ? 0 : hull.size() - 1;
  for (size_t i = points.size(); i-- > 1;) ExtendChain(points[i - 1], lower, &hull);
  MergeShortEdges(&hull);
  return hull;
}

double PolygonArea(std::span<const Eigen::Vector2d> polygon) {
  double twice = 0.0;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Eigen::Vector2d &a = polygon[i], &b = polygon[(i + 1) % polygon.size()];
    twice += a.x() * b.y() - a.y() * b.x();
  }
  return 0.5 * twice;
}

std::vector<Eigen::Vector2d> SupportPolygon(std::span<const ContactPlacement> contacts) {
  std::vector<Eigen::Vector2d> corners;
  corners.reserve(4 * contacts.size());
  for (const ContactPlacement& placement : contacts) {
    const ContactKindDescription& facts = placement.contact->facts();
    if (!facts.supports || !placement.carries) continue;
    const bool ball = facts.shape == ContactShape::kBall;
    for (const Eigen::Vector3d& point : placement.contact->points_L) {
      corners.emplace_back((placement.X_WL * point).head<2>());
      if (ball) corners.back() -= placement.contact->radius_m * placement.normal_W.head<2>();
    }
  }
  return ConvexHull2d(std::move(corners));
}

Stance PlantedContacts(const Dataset& dataset, const Stance& from, const Stance& to) {
  Stance planted;
  for (const ContactTarget& target : from.contacts) {
    const auto same = std::ranges::find_if(to.contacts, [&](const auto& other) { return HaveSamePose(target, other); });
    if (same == to.contacts.end()) continue;
    ContactTarget& kept = planted.contacts.emplace_back(target);
    kept.carries = target.carries && same->carries;
    if (target == *same) continue;
    const Contact& contact = dataset.contact(target.contact);
    if (target.friction || same->friction) {
      kept.friction = std::min(target.friction.value_or(contact.friction), same->friction.value_or(contact.friction));
    }
    if (target.slide_m || same->slide_m) kept.slide_m = std::min(contact.SlideOf(target), contact.SlideOf(*same));
  }
  return planted;
}

bool StandsOnFeet(const Dataset& dataset, const Stance& stance) {
  return std::ranges::all_of(stance.contacts, [&](const ContactTarget& target) {
    return !target.carries || dataset.contact(target.contact).facts().supports;
  });
}

std::vector<Eigen::Vector2d> TargetSupportPolygon(const Dataset& dataset, const Stance& stance) {
  std::vector<ContactPlacement> placements;
  placements.reserve(stance.contacts.size());
  for (const ContactTarget& target : stance.contacts) {
    const Contact& contact = dataset.contact(target.contact);
    placements.push_back({.contact = &contact,
                          .X_WL = contact.LinkTarget(target),
                          .normal_W = NormalOf(target),
                          .carries = target.carries});
  }
  return SupportPolygon(placements);
}

std::vector<HalfPlane> Edges(std::span<const Eigen::Vector2d> polygon) {
  if (polygon.empty()) {
    std::fprintf(stderr, "Edges: the polygon is empty\n");
    std::abort();
  }
  if (polygon.size() <= 2) {
    const Eigen::Vector2d& a = polygon.front();
    const Eigen::Vector2d& b = polygon.back();
    const Eigen::Vector2d along = polygon.size() == 2 ? Eigen::Vector2d((b - a).normalized()) : Eigen::Vector2d(1, 0);
    const Eigen::Vector2d across(along.y(), -along.x());
    return {Through(a, across), Through(b, along), Through(a, -across), Through(a, -along)};
  }
  std::vector<HalfPlane> edges;
  edges.reserve(polygon.size());
  for (size_t i = 0; i < polygon.size(); ++i) {
    const Eigen::Vector2d along = (polygon[(i + 1) % polygon.size()] - polygon[i]).normalized();
    edges.push_back(Through(polygon[i], {along.y(), -along.x()}));
  }
  return edges;
}

double SignedDistanceToPolygon(std::span<const Eigen::Vector2d> polygon, const Eigen::Vector2d& c) {
  double largest = -std::numeric_limits<double>::infinity();
  for (const HalfPlane& edge : Edges(polygon)) largest = std::max(largest, edge.Distance(c));
  return largest;
}

}  // namespace legopt
