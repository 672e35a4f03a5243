#pragma once

#include <cstdint>
#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string_view>
#include <vector>

#include "legopt/generate/building.h"
#include "legopt/generate/collapse.h"
#include "legopt/generate/difficulty.h"
#include "legopt/generate/fracture.h"
#include "legopt/generate/picture.h"
#include "legopt/generate/pieces.h"
#include "legopt/read_guard.h"

namespace legopt::generate {

/// The paper's difficulty levels: snapshots of one collapse at increasing time.
enum class ScenarioLevel {
  kEasier,        ///< the first of CollapseOptions::snapshots_s
  kEasy,          ///< the second
  kIntermediate,  ///< the third
  kHard           ///< the last
};

/// "easier", "easy", "intermediate", "hard".
std::string_view ToString(ScenarioLevel level);
/// Inverse; throws InputError naming the nearest word.
ScenarioLevel ParseScenarioLevel(std::string_view text);

/// Everything that decides a scenario.
struct ScenarioOptions {
  BuildingKind kind = BuildingKind::kGarage;     ///< which building
  ScenarioLevel level = ScenarioLevel::kEasier;  ///< how far its collapse has come
  std::uint64_t seed = 1;                        ///< of all draws
  FractureOptions fracture;                      ///< how fine it breaks
  CollapseOptions collapse;                      ///< the simulation
};

/// A building after (part of) its collapse.
struct Scenario {
  ScenarioOptions options;    ///< what it was made from
  Building building;          ///< before the collapse
  std::vector<Piece> pieces;  ///< what stands and lies there now
  double time_s = 0.0;        ///< of the snapshot, since the collapse began
  int num_cells = 0;          ///< of the building
  int num_bonds = 0;          ///< joints between them
  int num_bonds_broken = 0;   ///< of them, at the snapshot
  Difficulty intact;          ///< of the building before the collapse
  Difficulty damaged;         ///< the same of the pieces
};

/// Builds, breaks and lets collapse up to the level's snapshot. Same options, same bits (see SimulateCollapse).
Scenario MakeScenario(const ScenarioOptions& options, const CollapseProgress& progress);

/// Kind, level, seed, every parameter, counts and difficulty; no hashes.
nlohmann::ordered_json DescribeScenario(const Scenario& scenario);

/// The scenario with the colours of its materials.
Drawing DrawScenario(const Scenario& scenario);
/// Four views: "outside", "back", "inside" (the upper storeys cut away), "ground" (from eye height).
std::vector<std::pair<std::string_view, Camera>> ScenarioCameras(const Building& building);

inline constexpr const char* kSceneMeshName = "scene.ply";         ///< all pieces as one mesh
inline constexpr const char* kScenarioFileName = "scenario.json";  ///< DescribeScenario, and hashes
inline constexpr const char* kMembersFileName = "building.csv";    ///< the members of the intact building

/// Writes scene.ply, building.csv (the members), scenario.json (DescribeScenario and the hashes of all other files)
/// and, when asked for, a PNG per camera into an existing folder. The scene is read back under `guard` and checked:
/// closed, wound outwards, one solid per piece. Throws InputError when something cannot be written.
void WriteScenario(const Scenario& scenario, const std::filesystem::path& folder, bool pictures,
                   const ReadGuard& guard = {});

}  // namespace legopt::generate
