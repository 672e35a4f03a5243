#include "legopt/worldgen/internal/guide_map.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <queue>

namespace legopt::worldgen {
namespace {

constexpr float kUnreached = std::numeric_limits<float>::infinity();
constexpr float kNarrow = 4.0F;  // cost factor of cells that are hard to walk on

}  // namespace

GuideMap::GuideMap(const ProbeModel& model, double cell_m)
    : cell_m_(cell_m), step_m_(model.options.step_m), origin_(model.terrain.bounds().min().head<2>()) {
  const Eigen::Vector3d size = model.terrain.bounds().sizes();
  columns_ = 1 + static_cast<int>(size.x() / cell_m_);
  rows_ = 1 + static_cast<int>(size.y() / cell_m_);
  std::vector<bool> blocked(static_cast<size_t>(columns_) * static_cast<size_t>(rows_), false);
  std::vector<std::vector<float>> rubble(blocked.size());
  AddSolid(model, blocked, rubble);
  Index();
  PenalizeNarrowCells(blocked);
  BridgeGaps(blocked, rubble, 0.5 * model.options.reach_m);
  Index();
}

int GuideMap::CellOf(double x, double y) const {
  const int i = std::clamp(static_cast<int>((x - origin_.x()) / cell_m_), 0, columns_ - 1);
  const int j = std::clamp(static_cast<int>((y - origin_.y()) / cell_m_), 0, rows_ - 1);
  return j * columns_ + i;
}

/// Adds the nodes where feet can stand. `blocked`: cells that have surfaces; `rubble`: heights, per cell, of surfaces
/// that are too steep but have room above them, so that they can be stepped over.
void GuideMap::AddSolid(const ProbeModel& model, std::vector<bool>& blocked, std::vector<std::vector<float>>& rubble) {
  const Terrain& terrain = model.terrain;
  const double least_nz = std::cos(model.options.slope_rad);
  const double shin_m = 0.5 * model.options.trunk_low_m;
  const double trunk_top_m = model.options.trunk_low_m + model.options.trunk_m.z();
  std::vector<Terrain::Hit> hits;
  for (int cell = 0; cell < columns_ * rows_; ++cell) {
    std::vector<std::pair<float, float>> heights;  // pairs of height and cost factor
    bool any = false;
    for (int sample = 0; sample < 4; ++sample) {
      const int column = cell % columns_, row = cell / columns_, right = sample % 2, up = sample / 2;
      const double x = origin_.x() + (column + 0.25 + 0.5 * right) * cell_m_;
      const double y = origin_.y() + (row + 0.25 + 0.5 * up) * cell_m_;
      terrain.Ground(x, y, terrain.bounds().min().z(), terrain.bounds().max().z(), hits);
      for (const Terrain::Hit& hit : hits) {
        any = true;
        const double room = terrain.CeilingHeight(x, y, hit.z_m) - hit.z_m;
        if (room < shin_m) continue;
        const auto z = static_cast<float>(hit.z_m);
        if (terrain.normal(hit.triangle).z() < least_nz) {
          rubble[static_cast<size_t>(cell)].push_back(z);
        } else {
          heights.emplace_back(z, room < trunk_top_m ? kNarrow : 1.0F);
        }
      }
    }
    blocked[static_cast<size_t>(cell)] = any;
    std::sort(heights.begin(), heights.end(), std::greater<>());
    float last = kUnreached;
    for (const auto& [z, price] : heights) {
      if (last - z < 0.5F * static_cast<float>(step_m_)) continue;
      nodes_.push_back({cell, z, price});
      last = z;
    }
  }
}

void GuideMap::Index() {
  std::stable_sort(nodes_.begin(), nodes_.end(),
                   [](const Node& a, const Node& b) { return a.cell != b.cell ? a.cell < b.cell : a.z > b.z; });
  first_.assign(static_cast<size_t>(columns_ * rows_) + 1, 0);
  for (const Node& node : nodes_) ++first_[static_cast<size_t>(node.cell) + 1];
  for (size_t i = 1; i < first_.size(); ++i) first_[i] += first_[i - 1];
}

/// Raises the cost of nodes with a nearby cell that contains surfaces, but no node at a similar height.
void GuideMap::PenalizeNarrowCells(const std::vector<bool>& blocked) {
  constexpr int kSpan = 2;
  for (Node& node : nodes_) {
    for (int k = 0; k < (2 * kSpan + 1) * (2 * kSpan + 1); ++k) {
      const int i = node.cell % columns_ + k % (2 * kSpan + 1) - kSpan;
      const int j = node.cell / columns_ + k / (2 * kSpan + 1) - kSpan;
      if (i < 0 || j < 0 || i >= columns_ || j >= rows_) continue;
      const auto cell = static_cast<size_t>(j * columns_ + i);
      bool level = false;
      for (int n = first_[cell]; n < first_[cell + 1]; ++n) {
        level = level || std::abs(nodes_[static_cast<size_t>(n)].z - node.z) <= static_cast<float>(step_m_);
      }
      if (!level && blocked[cell]) node.price = kNarrow;
    }
  }
}

/// Adds nodes to cells within reach of an existing node that have no node near its height and are not obstacles. A cell
/// is an obstacle if it has surfaces, but no nodes and no rubble within a step's height.
void GuideMap::BridgeGaps(const std::vector<bool>& blocked, const std::vector<std::vector<float>>& rubble,
                          double reach_m) {
  const int span = static_cast<int>(std::floor(reach_m / cell_m_));
  const size_t solid = nodes_.size();
  std::vector<std::vector<float>> added(blocked.size());
  for (size_t n = 0; n < solid; ++n) {
    const Node node = nodes_[n];
    for (int dj = -span; dj <= span; ++dj) {
      for (int di = -span; di <= span; ++di) {
        const int i = node.cell % columns_ + di;
        const int j = node.cell / columns_ + dj;
        if (i < 0 || j < 0 || i >= columns_ || j >= rows_ || di * di + dj * dj > span * span) continue;
        const auto cell = static_cast<size_t>(j * columns_ + i);
        bool taken = false;
        for (int k = first_[cell]; k < first_[cell + 1]; ++k) {
          taken = taken || std::abs(nodes_[static_cast<size_t>(k)].z - node.z) < static_cast<float>(step_m_);
        }
        const bool low = std::any_of(rubble[cell].begin(), rubble[cell].end(),
                                     [&](float z) { return std::abs(z - node.z) <= static_cast<float>(step_m_); });
        const bool wall = blocked[cell] && first_[cell] == first_[cell + 1] && !low;
        for (const float z : added[cell]) taken = taken || std::abs(z - node.z) < static_cast<float>(step_m_);
        if (!taken && !wall) added[cell].push_back(node.z);
      }
    }
  }
  for (size_t cell = 0; cell < added.size(); ++cell) {
    for (const float z : added[cell]) nodes_.push_back({static_cast<int>(cell), z, kNarrow});
  }
}

int GuideMap::NearestNode(const Eigen::Vector3d& point) const {
  const int cell = CellOf(point.x(), point.y());
  int best = -1;
  double nearest = std::numeric_limits<double>::infinity();
  for (int dj = -1; dj <= 1; ++dj) {
    for (int di = -1; di <= 1; ++di) {
      const int i = cell % columns_ + di;
      const int j = cell / columns_ + dj;
      if (i < 0 || j < 0 || i >= columns_ || j >= rows_) continue;
      const auto at = static_cast<size_t>(j * columns_ + i);
      for (int k = first_[at]; k < first_[at + 1]; ++k) {
        const double dz = std::abs(nodes_[static_cast<size_t>(k)].z - point.z());
        const double distance = dz + (di != 0 || dj != 0 ? cell_m_ : 0.0);
        if (dz > step_m_ || distance >= nearest) continue;
        nearest = distance;
        best = k;
      }
    }
  }
  return best;
}

std::vector<float> GuideMap::DistancesTo(std::span<const Eigen::Vector3d> goals, Measure measure) const {
  std::vector<float> distances(nodes_.size(), kUnreached);
  using Entry = std::pair<float, int>;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> open;
  for (const Eigen::Vector3d& goal : goals) {
    const int node = NearestNode(goal);
    if (node < 0) continue;
    distances[static_cast<size_t>(node)] = 0.0F;
    open.emplace(0.0F, node);
  }
  const auto edge = static_cast<float>(cell_m_);
  while (!open.empty()) {
    const auto [distance, index] = open.top();
    open.pop();
    if (distance > distances[static_cast<size_t>(index)]) continue;
    const Node node = nodes_[static_cast<size_t>(index)];
    const float price = measure == Measure::kWeighted ? node.price : 1.0F;
    for (int dj = -1; dj <= 1; ++dj) {
      for (int di = -1; di <= 1; ++di) {
        const int i = node.cell % columns_ + di;
        const int j = node.cell / columns_ + dj;
        if (i < 0 || j < 0 || i >= columns_ || j >= rows_) continue;
        const float length = edge * (di != 0 && dj != 0 ? std::sqrt(2.0F) : 1.0F) * price;
        const auto cell = static_cast<size_t>(j * columns_ + i);
        for (int k = first_[cell]; k < first_[cell + 1]; ++k) {
          const auto other = static_cast<size_t>(k);
          if (std::abs(nodes_[other].z - node.z) > static_cast<float>(step_m_)) continue;
          if (distance + length >= distances[other]) continue;
          distances[other] = distance + length;
          open.emplace(distances[other], k);
        }
      }
    }
  }
  return distances;
}

double GuideMap::Distance(const std::vector<float>& distances, const Eigen::Vector3d& point) const {
  const int node = NearestNode(point);
  return node < 0 ? std::numeric_limits<double>::infinity() : distances[static_cast<size_t>(node)];
}

double GuideMap::LowerBound(const std::vector<float>& shortest, const Eigen::Vector3d& point) const {
  const double detour = std::cos(M_PI / 8.0);
  const double ends = 2.0 * std::sqrt(2.0) * cell_m_;
  return std::max(0.0, detour * Distance(shortest, point) - ends);
}

}  // namespace legopt::worldgen
