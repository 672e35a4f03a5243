#include "legopt/geometry/internal/placed_shapes.h"

#include <algorithm>
#include <utility>

#include "legopt/geometry/internal/signed_distance.h"

namespace legopt {
namespace {

/// Returns false if two boxes prove that their contents do not overlap by more than `depth_m`.
bool MayOverlap(const Eigen::AlignedBox3d& a, const Eigen::AlignedBox3d& b, double depth_m) {
  return std::max((a.min() - b.max()).maxCoeff(), (b.min() - a.max()).maxCoeff()) < -depth_m;
}

}  // namespace

PlacedShapes::PlacedShapes(std::vector<ConvexShape> shapes)
    : shapes_(std::move(shapes)), sets_(shapes_.size()), boxes_(shapes_.size()) {
  for (const ConvexShape& shape : shapes_) ranges_.push_back(local_.Add(shape.points()));
  world_.ResizeLike(local_);
  for (size_t i = 0; i < shapes_.size(); ++i) world_.View(ranges_[i], sets_[i]);
}

void PlacedShapes::Place(const Eigen::Isometry3d& pose) {
  box_.setEmpty();
  for (size_t i = 0; i < shapes_.size(); ++i) {
    SupportSet& set = sets_[i];
    PlaceSupportSet(shapes_[i], pose, set);
    Eigen::AlignedBox3d& box = boxes_[i];
    if (set.count == 0) {
      box = SupportBounds(set);
    } else {
      world_.Transform(local_, ranges_[i], pose, set.lower, set.upper);
      box = Eigen::AlignedBox3d(set.lower.array() - set.radius, set.upper.array() + set.radius);
    }
    box_.extend(box);
  }
}

bool PlacedShapes::Overlap(const PlacedShapes& other, double depth_m) const {
  if (!MayOverlap(box_, other.box_, depth_m)) return false;
  PairDistance distance;
  for (size_t i = 0; i < sets_.size(); ++i) {
    if (!MayOverlap(boxes_[i], other.box_, depth_m)) continue;
    for (size_t j = 0; j < other.sets_.size(); ++j) {
      if (MayOverlap(boxes_[i], other.boxes_[j], depth_m) &&
          SignedDistance(sets_[i], other.sets_[j], -depth_m, distance)) {
        return true;
      }
    }
  }
  return false;
}

double PlacedShapes::Depth(const PlacedShapes& other, double least_m) const {
  double depth_m = least_m;
  PairDistance distance;
  for (size_t i = 0; i < sets_.size(); ++i) {
    if (!MayOverlap(boxes_[i], other.box_, depth_m)) continue;
    for (size_t j = 0; j < other.sets_.size(); ++j) {
      if (MayOverlap(boxes_[i], other.boxes_[j], depth_m) &&
          SignedDistance(sets_[i], other.sets_[j], -depth_m, distance)) {
        depth_m = std::max(depth_m, -distance.distance_m);
      }
    }
  }
  return depth_m;
}

}  // namespace legopt
