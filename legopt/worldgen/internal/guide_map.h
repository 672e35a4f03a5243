#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "legopt/worldgen/internal/stance_probe.h"

namespace legopt::worldgen {

/// Coarse map of possible foot positions for the planner. It gives a lower bound of the length of any walk, and a
/// weighted distance as a heuristic.
///
/// Nodes are (square of `cell_m`, height). A square has a node where one of its four samples hits a surface that is
/// flat enough and has room for a shin above it. Additional nodes, up to half a step's reach from these, bridge gaps
/// (no surface within the step height), which feet can step across, and ground that is too steep to stand on but no
/// higher than a step (rubble). Obstacles (walls, cars) are not bridged. Neighbours (of eight) within the step height
/// are connected. In the weighted distance, nodes that bridge a gap, are near an obstacle, or have too little room
/// above them for the trunk cost several times as much.
class GuideMap {
 public:
  /// `cell_m`: edge of a square, > 0. The model is used during construction only.
  explicit GuideMap(const ProbeModel& model, double cell_m = 0.2);

  /// Type of a distance.
  enum class Measure {
    kShortest,  ///< metres
    kWeighted   ///< metres times the cost factors of the nodes
  };
  /// Computes the distance of every node from the nearest goal by Dijkstra's algorithm [m]; infinity for nodes without
  /// a path.
  std::vector<float> DistancesTo(std::span<const Eigen::Vector3d> goals, Measure measure) const;
  /// Returns a lower bound of the length of a walk from `point`. `shortest`: result of DistancesTo. It is the grid
  /// distance reduced by the detour of eight directions (factor cos 22.5 deg) and by the squares at both ends.
  double LowerBound(const std::vector<float>& shortest, const Eigen::Vector3d& point) const;
  /// Returns the distance at the node nearest to `point`.
  double Distance(const std::vector<float>& distances, const Eigen::Vector3d& point) const;

 private:
  struct Node {
    int cell;
    float z;
    float price;  ///< cost factor for Measure::kWeighted
  };
  int CellOf(double x, double y) const;
  void AddSolid(const ProbeModel& model, std::vector<bool>& blocked, std::vector<std::vector<float>>& rubble);
  void BridgeGaps(const std::vector<bool>& blocked, const std::vector<std::vector<float>>& rubble, double reach_m);
  void PenalizeNarrowCells(const std::vector<bool>& blocked);
  void Index();
  int NearestNode(const Eigen::Vector3d& point) const;

  double cell_m_;
  double step_m_;
  Eigen::Vector2d origin_;
  int columns_ = 0, rows_ = 0;
  std::vector<Node> nodes_;  ///< ordered by cell, then descending height
  std::vector<int> first_;   ///< index of the first node per cell; one more at the end
};

}  // namespace legopt::worldgen
