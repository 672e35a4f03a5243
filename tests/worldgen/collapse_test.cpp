#include "legopt/worldgen/internal/collapse.h"

#include <gtest/gtest.h>

namespace legopt::worldgen {
namespace {

using Eigen::Vector3d;

/// Returns a plate on four columns, one of which may fail, with a block on the plate.
Building Table(bool fails) {
  Building building;
  BuildingParts parts(&building);
  parts.Box("ground", {-5, -5, -1}, {5, 5, 0}, Material::kGround, 0.0).fixed = true;
  for (int k = 0; k < 4; ++k) {
    const double x = k % 2 == 0 ? -1.5 : 1.2;
    const double y = k / 2 == 0 ? -1.5 : 1.2;
    parts.Box("column-" + std::to_string(k), {x, y, 0}, {x + 0.3, y + 0.3, 2}, Material::kConcrete, 0.7).fails =
        fails && k >= 2;
  }
  parts.Box("plate", {-1.5, -1.5, 2}, {1.5, 1.5, 2.2}, Material::kConcrete, 0.9);
  parts.Box("block", {-0.2, -0.2, 2.2}, {0.2, 0.2, 2.5}, Material::kTimber, 0.0).prop = 0;
  building.foci = {{0, 1.3, 1}};
  return building;
}

struct Played {
  std::vector<Cell> cells;
  std::vector<Snapshot> snapshots;
};

Played Simulate(const Building& building, const CollapseOptions& options) {
  Played run;
  std::mt19937_64 generator(5);
  run.cells = Fracture(building, {}, generator);
  run.snapshots = SimulateCollapse(building, run.cells, FindBonds(building, run.cells), options, 9, {});
  return run;
}

double Lowest(const Played& run, size_t snapshot, int member) {
  double lowest = 1e9;
  for (size_t i = 0; i < run.cells.size(); ++i) {
    if (run.cells[i].member != member) continue;
    const Vector3d centre = run.snapshots[snapshot].cells[i].motion * run.cells[i].centroid;
    lowest = std::min(lowest, centre.z());
  }
  return lowest;
}

TEST(Collapse, SoundBuildingStands) {
  CollapseOptions options;
  options.cracked_share = 0.0;
  options.tension_pa = 2e6;
  options.shear_pa = 3e6;
  options.bending_pa = 2e7;
  options.snapshots_s = {1.0};
  const Played run = Simulate(Table(false), options);
  EXPECT_EQ(run.snapshots[0].bonds_broken, 0);
  EXPECT_GT(Lowest(run, 0, 5), 2.05);
  EXPECT_GT(Lowest(run, 0, 6), 2.3);  // the loose block lies on the plate
}

TEST(Collapse, WithoutTwoColumnsThePlateComesDown) {
  CollapseOptions options;
  options.snapshots_s = {0.2, 2.0};
  const Played run = Simulate(Table(true), options);
  ASSERT_EQ(run.snapshots.size(), 2u);
  EXPECT_LT(run.snapshots[0].bonds_broken, run.snapshots[1].bonds_broken + 1);
  EXPECT_LT(Lowest(run, 1, 5), 1.0);
  EXPECT_LT(Lowest(run, 1, 5), Lowest(run, 0, 5));
  for (size_t i = 0; i < run.cells.size(); ++i) {
    const bool failed = run.cells[i].member == 3 || run.cells[i].member == 4;
    if (failed) {
      EXPECT_TRUE(run.snapshots[0].cells[i].gone);
    }
    if (run.cells[i].member == 0) {
      EXPECT_FALSE(run.snapshots[1].cells[i].moved);
    }
    // Nothing sinks into the ground.
    if (!run.snapshots[1].cells[i].gone && run.cells[i].member > 0) {
      EXPECT_GT((run.snapshots[1].cells[i].motion * run.cells[i].centroid).z(), 0.0);
    }
  }
}

TEST(Collapse, SameSeedSameBits) {
  CollapseOptions options;
  options.snapshots_s = {0.7};
  const Played first = Simulate(Table(true), options);
  const Played second = Simulate(Table(true), options);
  for (size_t i = 0; i < first.cells.size(); ++i) {
    EXPECT_EQ(first.snapshots[0].cells[i].motion.matrix(), second.snapshots[0].cells[i].motion.matrix());
  }
}

TEST(Collapse, FarFromTheFrontNothingMoves) {
  CollapseOptions options;
  options.front_m = 0.5;
  options.front_speed_m_s = 0.0;
  options.snapshots_s = {0.5};
  const Played run = Simulate(Table(true), options);
  for (size_t i = 0; i < run.cells.size(); ++i) {
    if ((run.cells[i].centroid - Vector3d(0, 1.3, 1)).norm() > 0.5) {
      EXPECT_FALSE(run.snapshots[0].cells[i].moved);
    }
  }
}

}  // namespace
}  // namespace legopt::worldgen
