#pragma once

#include <Eigen/Geometry>
#include <vector>

#include "legopt/geometry/internal/mesh.h"

namespace legopt {

/// Bounding-volume hierarchy of a fixed mesh's triangles. Immutable after construction.
class TriangleBvh {
 public:
  /// Copies the bounds of the triangles; `mesh` need not outlive the tree.
  explicit TriangleBvh(const TriangleMesh& mesh);

  /// Calls visit(triangle index) for triangles whose bounds overlap the box until it returns true. Returns true if it
  /// did.
  template <class Visitor>
  bool AnyOverlapping(const Eigen::AlignedBox3d& box, Visitor visit) const {
    int stack[kMaxDepth];
    int size = 0;
    if (!nodes_.empty()) stack[size++] = 0;
    while (size > 0) {
      const Node& node = nodes_[static_cast<size_t>(stack[--size])];
      if (!node.bounds.intersects(box)) continue;
      if (node.count == 0) {
        stack[size++] = node.first;
        stack[size++] = node.first + 1;
        continue;
      }
      for (int i = node.first; i < node.first + node.count; ++i) {
        if (bounds_[static_cast<size_t>(i)].intersects(box) && visit(order_[static_cast<size_t>(i)])) return true;
      }
    }
    return false;
  }

  /// Calls visit(triangle index) for the triangles of all leaves for which near(bounds) is true, and was for all boxes
  /// around them.
  template <class Near, class Visitor>
  void ForEachNear(Near near, Visitor visit) const {
    int stack[kMaxDepth];
    int size = 0;
    if (!nodes_.empty()) stack[size++] = 0;
    while (size > 0) {
      const Node& node = nodes_[static_cast<size_t>(stack[--size])];
      if (!near(node.bounds)) continue;
      if (node.count == 0) {
        stack[size++] = node.first;
        stack[size++] = node.first + 1;
      }
      for (int i = node.first; i < node.first + node.count; ++i) visit(order_[static_cast<size_t>(i)]);
    }
  }

 private:
  static constexpr int kMaxDepth = 64;  ///< sufficient for any mesh, since splits halve
  static constexpr int kLeafSize = 4;

  /// Leaf: triangles order_[first .. first + count). Inner: count 0, children first and first + 1.
  struct Node {
    Eigen::AlignedBox3d bounds;
    int first = 0;
    int count = 0;
  };

  void Split(size_t node, int begin, int end, const std::vector<Eigen::AlignedBox3d>& boxes);

  std::vector<Node> nodes_;
  std::vector<int> order_;
  std::vector<Eigen::AlignedBox3d> bounds_;  ///< parallel to order_
};

}  // namespace legopt
