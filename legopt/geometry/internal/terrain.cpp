#include "legopt/geometry/internal/terrain.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace legopt {

using Eigen::Vector3d;

namespace {

/// Limit for the memory of the bins: about 24 bytes per bin and 4 bytes per triangle in it.
constexpr double kMaxEntries = 8e6;
constexpr double kWall = 1e-9;  // minimum z of a unit normal; vertical rays miss steeper triangles

/// Returns the number of bins that cover a length.
double Squares(double length_m, double bin_m) { return std::max(1.0, std::ceil(length_m / bin_m)); }

}  // namespace

Terrain::Terrain(TriangleMesh mesh, double bin_m) : mesh_(std::move(mesh)), bin_m_(bin_m) {
  for (const Vector3d& vertex : mesh_.vertices) bounds_.extend(vertex);
  boxes_.reserve(mesh_.triangles.size());
  for (const auto& triangle : mesh_.triangles) {
    std::array<Vector3d, 3> p;
    Eigen::AlignedBox2d& box = boxes_.emplace_back();
    for (size_t k = 0; k < 3; ++k) {
      p[k] = mesh_.vertices[static_cast<size_t>(triangle[k])];
      box.extend(p[k].head<2>());
    }
    const Vector3d cross = (p[1] - p[0]).cross(p[2] - p[0]);
    areas_m2_.push_back(0.5 * cross.norm());
    normals_.push_back(cross.stableNormalized());
  }
  ChooseBins();
  FillBins();
  boxes_ = {};
}

/// Enlarges the bins of a wide scene, so that memory does not grow with its area.
void Terrain::ChooseBins() {
  const auto entries = [this] {
    double count = Squares(bounds_.sizes().x(), bin_m_) * Squares(bounds_.sizes().y(), bin_m_);
    for (size_t t = 0; t < boxes_.size(); ++t) {
      if (std::abs(normals_[t].z()) < kWall) continue;
      count += (1.0 + Squares(boxes_[t].sizes().x(), bin_m_)) * (1.0 + Squares(boxes_[t].sizes().y(), bin_m_));
    }
    return count;
  };
  const double most = std::max(kMaxEntries, 8.0 * static_cast<double>(mesh_.triangles.size()));
  while (entries() > most && bin_m_ < bounds_.sizes().head<2>().maxCoeff()) bin_m_ *= 2.0;
  bins_x_ = static_cast<int>(Squares(bounds_.sizes().x(), bin_m_));
  bins_y_ = static_cast<int>(Squares(bounds_.sizes().y(), bin_m_));
}

void Terrain::FillBins() {
  bins_.resize(static_cast<size_t>(bins_x_) * static_cast<size_t>(bins_y_));
  const auto index = [this](double value, double low, int bins) {
    return std::clamp(static_cast<int>(std::floor((value - low) / bin_m_)), 0, bins - 1);
  };
  for (size_t t = 0; t < boxes_.size(); ++t) {
    if (std::abs(normals_[t].z()) < kWall) continue;
    const Eigen::AlignedBox2d& box = boxes_[t];
    const int last_x = index(box.max().x(), bounds_.min().x(), bins_x_);
    const int last_y = index(box.max().y(), bounds_.min().y(), bins_y_);
    for (int j = index(box.min().y(), bounds_.min().y(), bins_y_); j <= last_y; ++j) {
      for (int i = index(box.min().x(), bounds_.min().x(), bins_x_); i <= last_x; ++i) {
        bins_[static_cast<size_t>(j) * static_cast<size_t>(bins_x_) + static_cast<size_t>(i)].push_back(
            static_cast<int>(t));
      }
    }
  }
}

const std::vector<int>* Terrain::Bin(double x, double y) const {
  const double i = std::floor((x - bounds_.min().x()) / bin_m_);
  const double j = std::floor((y - bounds_.min().y()) / bin_m_);
  if (!(i >= 0.0 && j >= 0.0 && i < bins_x_ && j < bins_y_)) return nullptr;
  return &bins_[static_cast<size_t>(j) * static_cast<size_t>(bins_x_) + static_cast<size_t>(i)];
}

bool Terrain::HeightAt(int triangle, double x, double y, double& z) const {
  const auto& corners = mesh_.triangles[static_cast<size_t>(triangle)];
  const Vector3d& a = mesh_.vertices[static_cast<size_t>(corners[0])];
  const Vector3d& b = mesh_.vertices[static_cast<size_t>(corners[1])];
  const Vector3d& c = mesh_.vertices[static_cast<size_t>(corners[2])];
  const double ab = (b.x() - a.x()) * (y - a.y()) - (b.y() - a.y()) * (x - a.x());
  const double bc = (c.x() - b.x()) * (y - b.y()) - (c.y() - b.y()) * (x - b.x());
  const double ca = (a.x() - c.x()) * (y - c.y()) - (a.y() - c.y()) * (x - c.x());
  const bool inside = (ab >= 0.0 && bc >= 0.0 && ca >= 0.0) || (ab <= 0.0 && bc <= 0.0 && ca <= 0.0);
  const double sum = ab + bc + ca;
  if (!inside || sum == 0.0) return false;
  z = (bc * a.z() + ca * b.z() + ab * c.z()) / sum;
  return true;
}

void Terrain::Ground(double x, double y, double low_m, double high_m, std::vector<Hit>& hits) const {
  hits.clear();
  const std::vector<int>* bin = Bin(x, y);
  if (bin == nullptr) return;
  for (const int t : *bin) {
    double z = 0.0;
    if (normal(t).z() <= 0.0 || !HeightAt(t, x, y, z) || z < low_m || z > high_m) continue;
    hits.push_back({z, t});
  }
  std::sort(hits.begin(), hits.end(),
            [](const Hit& a, const Hit& b) { return a.z_m != b.z_m ? a.z_m > b.z_m : a.triangle < b.triangle; });
}

Terrain::Hit Terrain::Highest(double x, double y, double low_m, double high_m) const {
  Hit best;
  const std::vector<int>* bin = Bin(x, y);
  if (bin == nullptr) return best;
  for (const int t : *bin) {
    double z = 0.0;
    if (normal(t).z() <= 0.0 || !HeightAt(t, x, y, z) || z < low_m || z > high_m) continue;
    if (best.triangle < 0 || z > best.z_m) best = {z, t};
  }
  return best;
}

double Terrain::CeilingHeight(double x, double y, double z_m) const {
  constexpr double kSkin = 1e-3;
  double nearest = std::numeric_limits<double>::infinity();
  const std::vector<int>* bin = Bin(x, y);
  if (bin == nullptr) return nearest;
  for (const int t : *bin) {
    double z = 0.0;
    if (HeightAt(t, x, y, z) && z > z_m + kSkin) nearest = std::min(nearest, z);
  }
  return nearest;
}

}  // namespace legopt
