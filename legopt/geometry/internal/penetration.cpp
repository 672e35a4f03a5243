#include <algorithm>
#include <limits>

#include "legopt/geometry/internal/signed_distance.h"

namespace legopt {
namespace {

using Eigen::Vector3d;

constexpr int kMaxVertices = 120;
constexpr int kMaxFaces = 4 * kMaxVertices;
constexpr double kThin = 1e-10;      // extent below which the difference is flat, m
constexpr double kVisible = 1e-11;   // a face is visible from points at least this high above it, m
constexpr double kConverged = 1e-9;  // maximum error of the depth for polytopes, m
constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// A triangle of the expanding polytope: outward unit normal and distance from the origin. Slivers without a usable
/// normal have an infinite distance: they close the surface, but are never selected or visible.
// NOLINTNEXTLINE(cppcoreguidelines-pro-type-member-init): a polytope makes hundreds and sets those that it uses
struct Face {
  int corner[3];
  Vector3d normal;
  double distance;
};

/// The expanding polytope inside A - B, around the origin.
class Polytope {
 public:
  Polytope(const SupportSet& a, const SupportSet& b) : a_(a), b_(b) {}

  /// Builds a tetrahedron from GJK's last simplex. Returns false if the difference is flat; `flat_normal` is then
  /// normal to it.
  bool Start(const Simplex& simplex, Vector3d& flat_normal) {
    for (int i = 0; i < simplex.size; ++i) vertices_[i] = simplex.points[i];
    num_vertices_ = simplex.size;
    if (num_vertices_ < 1) AddVertex(Support(Vector3d::UnitX()));
    while (num_vertices_ < 4) {
      if (!Grow(flat_normal)) return false;
    }
    const Vector3d& o = vertices_[0].w;
    if (std::abs(Volume()) < kThin * (vertices_[1].w - o).cross(vertices_[2].w - o).norm()) {
      num_vertices_ = 3;  // GJK's tetrahedron is flat: search for a better fourth corner
      if (!Grow(flat_normal)) return false;
    }
    if (Volume() > 0.0) std::swap(vertices_[0], vertices_[1]);
    AddFace(0, 1, 2);
    AddFace(0, 2, 3);
    AddFace(0, 3, 1);
    AddFace(1, 3, 2);
    return true;
  }

  int NearestFace() const {
    int best = 0;
    for (int i = 1; i < num_faces_; ++i) {
      if (faces_[i].distance < faces_[best].distance) best = i;
    }
    return best;
  }

  /// Replaces all faces visible from the new vertex by a cone. Returns false if the vertex limit is reached or no face
  /// is visible.
  bool Expand(const DifferencePoint& point) {
    if (num_vertices_ == kMaxVertices) return false;
    int num_edges = 0;
    int kept = 0;
    for (int i = 0; i < num_faces_; ++i) {
      const Face& face = faces_[i];
      if (face.normal.dot(point.w) - face.distance > kVisible) {
        for (int k = 0; k < 3; ++k) num_edges = ToggleEdge(face.corner[k], face.corner[(k + 1) % 3], num_edges);
      } else {
        faces_[kept++] = face;
      }
    }
    if (kept == num_faces_ || kept + num_edges > kMaxFaces) return false;
    num_faces_ = kept;
    const int apex = AddVertex(point);
    for (int e = 0; e < num_edges; ++e) AddFace(horizon_[e][0], horizon_[e][1], apex);
    return true;
  }

  int num_faces() const { return num_faces_; }
  const Face& face(int i) const { return faces_[i]; }
  const DifferencePoint& vertex(int i) const { return vertices_[i]; }
  DifferencePoint Support(const Vector3d& direction) const { return SupportOfDifference(a_, b_, direction); }

 private:
  int AddVertex(const DifferencePoint& point) {
    vertices_[num_vertices_] = point;
    return num_vertices_++;
  }

  /// Returns six times the volume; > 0 if the fourth corner is in front of face 0 1 2.
  double Volume() const {
    const Vector3d& o = vertices_[0].w;
    return (vertices_[1].w - o).cross(vertices_[2].w - o).dot(vertices_[3].w - o);
  }

  /// Adds the corner that extends the point, segment or triangle most.
  bool Grow(Vector3d& flat_normal) {
    const Vector3d& o = vertices_[0].w;
    Vector3d directions[3] = {Vector3d::UnitX(), Vector3d::UnitY(), Vector3d::UnitZ()};
    int count = 3;
    if (num_vertices_ == 2) {
      const Vector3d along = (vertices_[1].w - o).normalized();
      int smallest = 0;
      along.cwiseAbs().minCoeff(&smallest);
      directions[0] = along.cross(Vector3d::Unit(smallest)).normalized();
      directions[1] = along.cross(directions[0]);
      count = 2;
    } else if (num_vertices_ == 3) {
      directions[0] = (vertices_[1].w - o).cross(vertices_[2].w - o).normalized();
      count = 1;
    }
    DifferencePoint best = vertices_[0];
    double farthest = 0.0;
    for (int i = 0; i < count; ++i) {
      for (const double sign : {1.0, -1.0}) {
        const DifferencePoint point = Support(sign * directions[i]);
        const double reach = std::abs(directions[i].dot(point.w - o));
        if (reach > farthest) {
          farthest = reach;
          best = point;
        }
      }
    }
    flat_normal = directions[0];
    if (farthest < kThin) return false;
    AddVertex(best);
    return true;
  }

  void AddFace(int i, int j, int k) {
    Face& face = faces_[num_faces_++];
    face.corner[0] = i;
    face.corner[1] = j;
    face.corner[2] = k;
    const Vector3d& a = vertices_[i].w;
    const Vector3d ab = vertices_[j].w - a;
    const Vector3d ac = vertices_[k].w - a;
    const Vector3d cross = ab.cross(ac);
    const double norm = cross.norm();
    constexpr double kSliver = 1e-12;
    if (norm <= kSliver * ab.norm() * ac.norm() || norm == 0.0) {
      face.normal.setZero();
      face.distance = kInfinity;
      return;
    }
    face.normal = cross / norm;
    face.distance = face.normal.dot(a);
  }

  /// Keeps only the edges that belong to a single removed face.
  int ToggleEdge(int i, int j, int count) {
    for (int e = 0; e < count; ++e) {
      if (horizon_[e][0] == j && horizon_[e][1] == i) {
        horizon_[e][0] = horizon_[count - 1][0];
        horizon_[e][1] = horizon_[count - 1][1];
        return count - 1;
      }
    }
    horizon_[count][0] = i;
    horizon_[count][1] = j;
    return count + 1;
  }

  const SupportSet& a_;
  const SupportSet& b_;
  DifferencePoint vertices_[kMaxVertices];
  int num_vertices_ = 0;
  Face faces_[kMaxFaces];
  int num_faces_ = 0;
  int horizon_[3 * kMaxFaces][2];
};

/// Returns the unscaled barycentric weights of p in a triangle of its plane; one is negative if p is outside.
Vector3d Barycentric(const DifferencePoint& a, const DifferencePoint& b, const DifferencePoint& c, const Vector3d& p) {
  const Vector3d normal = (b.w - a.w).cross(c.w - a.w);
  return {normal.dot((b.w - p).cross(c.w - p)), normal.dot((c.w - p).cross(a.w - p)),
          normal.dot((a.w - p).cross(b.w - p))};
}

/// Returns B's point at the origin's projection onto the plane of `nearest`. If several triangles share that plane, the
/// one that contains the projection has the witness point.
Vector3d WitnessOnB(const Polytope& polytope, const Face& nearest) {
  const Vector3d p = nearest.normal * nearest.distance;
  Vector3d witness = polytope.vertex(nearest.corner[0]).b;
  double best = -kInfinity;
  for (int i = 0; i < polytope.num_faces(); ++i) {
    const Face& face = polytope.face(i);
    if (face.distance - nearest.distance > kConverged || (face.normal - nearest.normal).squaredNorm() > kConverged) {
      continue;
    }
    const DifferencePoint& a = polytope.vertex(face.corner[0]);
    const DifferencePoint& b = polytope.vertex(face.corner[1]);
    const DifferencePoint& c = polytope.vertex(face.corner[2]);
    Vector3d weight = Barycentric(a, b, c, p);
    const double smallest = weight.minCoeff() / weight.cwiseAbs().sum();
    if (!(smallest > best)) continue;
    best = smallest;
    weight = weight.cwiseMax(0.0);
    witness = (weight.x() * a.b + weight.y() * b.b + weight.z() * c.b) / weight.sum();
  }
  return witness;
}

PairDistance Flat(const Simplex& simplex, const Vector3d& normal) {
  PairDistance result;
  result.normal = normal;
  double sum = 0.0;
  for (int i = 0; i < simplex.size; ++i) sum += simplex.weights[i];
  for (int i = 0; i < simplex.size; ++i) {
    const double weight = sum > 0.0 ? simplex.weights[i] / sum : 1.0 / simplex.size;
    result.point_b += weight * simplex.points[i].b;
  }
  return result;
}

}  // namespace

PairDistance ComputePenetration(const SupportSet& a, const SupportSet& b, const Simplex& simplex) {
  Polytope polytope(a, b);
  Vector3d flat_normal;
  if (!polytope.Start(simplex, flat_normal)) return Flat(simplex, flat_normal);
  // The support in any direction is an upper bound of the depth and a valid separation: if the expansion ends early,
  // the best one is returned. Only a face on the surface of A - B has exact witness points.
  PairDistance best;
  double depth = kInfinity;
  for (;;) {
    const Face face = polytope.face(polytope.NearestFace());
    if (face.distance == kInfinity) break;
    const DifferencePoint point = polytope.Support(face.normal);
    const double reach = face.normal.dot(point.w);
    const bool on_surface = reach - face.distance <= kConverged;
    if (reach < depth || on_surface) {
      depth = reach;
      best.distance_m = -reach;
      best.normal = -face.normal;
      best.point_b = WitnessOnB(polytope, face);
    }
    if (on_surface || !polytope.Expand(point)) break;
  }
  return best;
}

}  // namespace legopt
