#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "legopt/generate/stance_probe.h"

namespace legopt::generate {

/// Coarse map of where feet can be, for the planner: a lower bound of the length of any walk, and a guess of the way
/// that a walker would choose.
///
/// Nodes are (square of `cell_m`, height). A square has a node where one of its four samples meets a surface that is
/// flat enough and has room for a shin above it. Gaps (no surface within the step height) are bridged by nodes up to
/// half a step's reach from solid ones, because feet may stride over them, and so are squares whose ground is too steep
/// to stand on but no higher than a step (rubble); blocked squares (walls, cars) are not.
/// Neighbours (of eight) within the step height are joined. The guess counts nodes several times that bridge a gap, lie
/// beside something blocked, or have too little room above them for the trunk.
class GuideMap {
 public:
  /// `cell_m`: edge of a square, > 0. The model is not needed afterwards.
  explicit GuideMap(const ProbeModel& model, double cell_m = 0.2);

  /// What a distance counts.
  enum class Measure {
    kShortest,  ///< metres
    kCautious   ///< metres times their price: the guess
  };
  /// Distances from any of the goals by Dijkstra over the grid [m]; by node; infinity where there is no way.
  std::vector<float> DistancesTo(std::span<const Eigen::Vector3d> goals, Measure measure) const;
  /// Lower bound of the length of a walk from `point`, given the result of DistancesTo: the grid distance without the
  /// detour of eight directions (factor cos 22.5 deg) and without the squares at both ends.
  double LowerBound(const std::vector<float>& shortest, const Eigen::Vector3d& point) const;
  /// Distance as it stands in the table.
  double Distance(const std::vector<float>& distances, const Eigen::Vector3d& point) const;

 private:
  struct Node {
    int cell;
    float z;
    float price;  ///< of a metre, for the guess
  };
  int CellOf(double x, double y) const;
  void AddSolid(const ProbeModel& model, std::vector<bool>& blocked, std::vector<std::vector<float>>& rubble);
  void BridgeGaps(const std::vector<bool>& blocked, const std::vector<std::vector<float>>& rubble, double reach_m);
  void PriceNarrowPlaces(const std::vector<bool>& blocked);
  void Index();
  int NearestNode(const Eigen::Vector3d& point) const;

  double cell_m_;
  double step_m_;
  Eigen::Vector2d origin_;
  int columns_ = 0, rows_ = 0;
  std::vector<Node> nodes_;  ///< by cell, then descending height
  std::vector<int> first_;   ///< by cell: index of its first node; one more at the end
};

}  // namespace legopt::generate
