#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string_view>
#include <vector>

#include "legopt/geometry/internal/terrain.h"
#include "legopt/types/read_guard.h"
#include "legopt/worldgen/internal/building.h"
#include "legopt/worldgen/internal/collapse.h"
#include "legopt/worldgen/internal/fracture.h"
#include "legopt/worldgen/internal/picture.h"

namespace legopt::worldgen {

/// Options of a measure for how hard a scene is to walk through. Samples are taken on a square grid in plan, on every
/// storey.
///
/// A sample is an upward surface. It is walkable if it is no steeper than `slope_rad`, if nothing is within
/// `headroom_m` above it, and if at least six of its eight neighbours have ground within `step_m` of its height.
struct DifficultyOptions {
  double grid_m = 0.2;      ///< spacing of the samples
  double slope_rad = 0.45;  ///< maximum slope of a walkable surface
  double headroom_m = 1.7;  ///< required free height
  double step_m = 0.12;     ///< maximum height difference between neighbours
};

/// Difficulty of a scene.
struct Difficulty {
  double walkable_m2 = 0.0;         ///< area of the walkable samples
  double height_variance_m2 = 0.0;  ///< variance of the height over 3 x 3 samples, mean over walkable samples
  double clearance_m = 0.0;         ///< free height above walkable samples, at most 3 m each, mean
};

/// Measures the difficulty of a scene. `plan`: region to sample.
Difficulty MeasureDifficulty(const Terrain& terrain, const Eigen::AlignedBox2d& plan,
                             const DifficultyOptions& options = {});

/// The paper's difficulty levels: snapshots of one collapse at increasing time.
enum class ScenarioLevel {
  kEasier,        ///< the first of CollapseOptions::snapshots_s
  kEasy,          ///< the second
  kIntermediate,  ///< the third
  kHard           ///< the last
};

/// Returns "easier", "easy", "intermediate" or "hard".
std::string_view ToString(ScenarioLevel level);
/// Parses a level. Throws InputError with the nearest name.
ScenarioLevel ParseScenarioLevel(std::string_view text);

/// All options that affect a scenario.
struct ScenarioOptions {
  BuildingKind kind = BuildingKind::kGarage;
  ScenarioLevel level = ScenarioLevel::kEasier;  ///< progress of the collapse
  std::uint64_t seed = 1;                        ///< seed of all random numbers
  FractureOptions fracture;
  CollapseOptions collapse;
};

/// A building during or after its collapse.
struct Scenario {
  ScenarioOptions options;
  Building building;          ///< building before the collapse
  std::vector<Piece> pieces;  ///< solids at the snapshot
  double time_s = 0.0;        ///< time of the snapshot since the start of the collapse
  int num_cells = 0;          ///< number of cells of the building
  int num_bonds = 0;          ///< number of bonds between cells
  int num_bonds_broken = 0;   ///< number of bonds broken at the snapshot
  Difficulty intact;          ///< difficulty before the collapse
  Difficulty damaged;         ///< difficulty of `pieces`
};

/// Generates, fractures and simulates a building up to the level's snapshot. The same options give the same bits (see
/// SimulateCollapse).
Scenario MakeScenario(const ScenarioOptions& options, const CollapseProgress& progress);

/// Formats kind, level, seed, all parameters, counts and difficulty as JSON, without hashes.
nlohmann::ordered_json DescribeScenario(const Scenario& scenario);

/// Returns the scenario with the colours of its materials.
Drawing DrawScenario(const Scenario& scenario);
/// Returns four views: "outside", "back", "inside" (without the upper storeys), "ground" (from eye height).
std::vector<std::pair<std::string_view, Camera>> ScenarioCameras(const Building& building);

inline constexpr const char* kSceneMeshName = "scene.ply";         ///< all pieces as one mesh
inline constexpr const char* kScenarioFileName = "scenario.json";  ///< DescribeScenario with hashes
inline constexpr const char* kMembersFileName = "building.csv";    ///< the members of the intact building

/// Writes scene.ply, building.csv (the members), scenario.json (DescribeScenario and the hashes of all other files)
/// and, if requested, a PNG per camera into an existing folder. The scene is read back under `guard` and checked:
/// closed, outward winding, one solid per piece. Throws InputError if a file cannot be written.
void WriteScenario(const Scenario& scenario, const std::filesystem::path& folder, bool pictures,
                   const ReadGuard& guard = {});

}  // namespace legopt::worldgen
