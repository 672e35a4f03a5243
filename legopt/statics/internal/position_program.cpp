#include "legopt/statics/internal/position_program.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace legopt {
namespace {

constexpr int kReachRows = 2;
constexpr double kClosed_m = 1e-7;  // between the first corner and the one after a full turn, along the first direction
constexpr std::size_t kMostCorners = 10'000;

}  // namespace

PositionProgram::PositionProgram(const StanceForces& forces, const Eigen::Vector3d& total)
    : forces_(forces), rows_x_(forces.moments().row(1)), rows_y_(-forces.moments().row(0)) {
  const int num_generators = forces.num_generators();
  const auto num_bounds = static_cast<Eigen::Index>(forces.bounds().size());
  const Eigen::Index rows = kFixedRows + kReachRows + num_bounds;
  program_.A.setZero(rows, num_generators);
  program_.b.setZero(rows);
  program_.range.setZero(rows);
  program_.upper = forces.upper();
  program_.A.topRows(3) = forces.directions();
  program_.A.row(3) = total.transpose() * forces.moments();
  program_.b.head<3>() = total;
  const double reach_m = std::max(kPolygonReach_m, forces.com_reach_m());
  program_.A.row(4) = -forces.moments().row(1);
  program_.A.row(5) = forces.moments().row(0);
  program_.b.segment<kReachRows>(kFixedRows).setConstant(reach_m);
  program_.range.segment<kReachRows>(kFixedRows).setConstant(2.0 * reach_m);
  for (Eigen::Index i = 0; i < num_bounds; ++i) AddBound(i);
  status_ = solver_.Constrain(program_);
}

void PositionProgram::AddBound(Eigen::Index index) {
  const StanceForces::NormalBound& bound = forces_.bounds()[static_cast<size_t>(index)];
  const Eigen::Index row = kFixedRows + kReachRows + index;
  for (int l = 0; l < forces_.num_generators(); ++l) {
    if (forces_.surface_of(l) == bound.surface) program_.A(row, l) = 1.0;
  }
  program_.b[row] = bound.maximum;
  program_.range[row] = LinearProgramSolver::kInfinity;
}

std::vector<Eigen::Vector2d> PositionProgram::TurnedCorners() {
  std::vector<Eigen::Vector2d> corners;
  const auto visit = [&](const TurnedOptimum& optimum) {
    corners.push_back(PositionOf(optimum.x));
    return true;
  };
  if (solver_.Minimize(rows_x_) != LinearProgramStatus::kOptimal) return {};
  if (solver_.Turn(rows_x_, rows_y_, visit) != LinearProgramStatus::kOptimal) return {};
  const bool is_closed = std::abs(corners.back().x() - corners.front().x()) <= kClosed_m;
  return is_closed ? corners : std::vector<Eigen::Vector2d>();
}

std::optional<Eigen::Vector2d> PositionProgram::FurthestAlong(const Eigen::Vector2d& direction) {
  const Eigen::VectorXd cost = direction.x() * rows_x_ + direction.y() * rows_y_;
  if (solver_.Minimize(cost) != LinearProgramStatus::kOptimal) return std::nullopt;
  return PositionOf(solver_.x());
}

std::vector<Eigen::Vector2d> PositionProgram::SearchedCorners(double accuracy_m) {
  std::vector<Eigen::Vector2d> extremes;
  for (const Eigen::Vector2d& direction :
       {Eigen::Vector2d(1, 0), Eigen::Vector2d(0, 1), Eigen::Vector2d(-1, 0), Eigen::Vector2d(0, -1)}) {
    const std::optional<Eigen::Vector2d> furthest = FurthestAlong(direction);
    if (!furthest) return {};
    extremes.push_back(*furthest);
  }
  std::vector<Eigen::Vector2d> corners;
  for (std::size_t i = 0; i < extremes.size(); ++i) {
    if (!AppendCorners(extremes[i], extremes[(i + 1) % extremes.size()], accuracy_m, &corners)) return {};
  }
  return corners;
}

bool PositionProgram::AppendCorners(const Eigen::Vector2d& begin, const Eigen::Vector2d& end, double accuracy_m,
                                    std::vector<Eigen::Vector2d>* corners) {
  const Eigen::Vector2d edge = end - begin;
  const double length = edge.norm();
  if (length > accuracy_m) {
    const Eigen::Vector2d outward = Eigen::Vector2d(edge.y(), -edge.x()) / length;
    const std::optional<Eigen::Vector2d> furthest = FurthestAlong(outward);
    if (!furthest || corners->size() > kMostCorners) return false;
    if (outward.dot(*furthest - begin) > accuracy_m) {
      return AppendCorners(begin, *furthest, accuracy_m, corners) && AppendCorners(*furthest, end, accuracy_m, corners);
    }
  }
  corners->push_back(end);
  return true;
}

}  // namespace legopt
