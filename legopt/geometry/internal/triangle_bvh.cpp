#include "legopt/geometry/internal/triangle_bvh.h"

#include <algorithm>
#include <numeric>

namespace legopt {

TriangleBvh::TriangleBvh(const TriangleMesh& mesh) : order_(mesh.triangles.size()) {
  std::vector<Eigen::AlignedBox3d> boxes(mesh.triangles.size());
  for (size_t t = 0; t < boxes.size(); ++t) {
    for (int corner : mesh.triangles[t]) boxes[t].extend(mesh.vertices[static_cast<size_t>(corner)]);
  }
  std::iota(order_.begin(), order_.end(), 0);
  if (!boxes.empty()) {
    nodes_.emplace_back();
    Split(0, 0, static_cast<int>(boxes.size()), boxes);
  }
  for (int t : order_) bounds_.push_back(boxes[static_cast<size_t>(t)]);
}

void TriangleBvh::Split(size_t node, int begin, int end, const std::vector<Eigen::AlignedBox3d>& boxes) {
  Eigen::AlignedBox3d bounds;
  Eigen::AlignedBox3d centres;
  for (int i = begin; i < end; ++i) {
    const Eigen::AlignedBox3d& box = boxes[static_cast<size_t>(order_[static_cast<size_t>(i)])];
    bounds.extend(box);
    centres.extend(box.center());
  }
  nodes_[node].bounds = bounds;
  if (end - begin <= kLeafSize) {
    nodes_[node].first = begin;
    nodes_[node].count = end - begin;
    return;
  }
  int axis = 0;
  centres.sizes().maxCoeff(&axis);
  const int middle = begin + (end - begin) / 2;
  std::nth_element(order_.begin() + begin, order_.begin() + middle, order_.begin() + end, [&](int a, int b) {
    const double ca = boxes[static_cast<size_t>(a)].center()[axis];
    const double cb = boxes[static_cast<size_t>(b)].center()[axis];
    return ca < cb || (ca == cb && a < b);
  });
  const size_t left = nodes_.size();
  nodes_[node].first = static_cast<int>(left);
  nodes_.resize(left + 2);
  Split(left, begin, middle, boxes);
  Split(left + 1, middle, end, boxes);
}

}  // namespace legopt
