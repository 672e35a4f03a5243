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
enum class ScenarioLevel { kEasier, kEasy, kIntermediate, kHard };

/// "easier", "easy", "intermediate", "hard".
std::string_view ToString(ScenarioLevel level);
/// Inverse; throws InputError naming the nearest word.
ScenarioLevel ParseScenarioLevel(std::string_view text);

/// Everything that decides a scenario.
struct ScenarioOptions {
  BuildingKind kind = BuildingKind::kGarage;
  ScenarioLevel level = ScenarioLevel::kEasier;
  std::uint64_t seed = 1;
  FractureOptions fracture;
  CollapseOptions collapse;
};

/// A building after (part of) its collapse.
struct Scenario {
  ScenarioOptions options;
  Building building;
  std::vector<Piece> pieces;
  double time_s = 0.0;
  int num_cells = 0;
  int num_bonds = 0;
  int num_bonds_broken = 0;
  Difficulty intact;  ///< of the building before the collapse
  Difficulty damaged;
};

/// Builds, breaks and lets collapse up to the level's snapshot. Same options, same bits (see SimulateCollapse).
Scenario MakeScenario(const ScenarioOptions& options, const CollapseProgress& progress);

/// Kind, level, seed, every parameter, counts and difficulty; no hashes.
nlohmann::ordered_json DescribeScenario(const Scenario& scenario);

/// The scenario with the colours of its materials.
Drawing DrawScenario(const Scenario& scenario);
/// Four views: "outside", "back", "inside" (the upper storeys cut away), "ground" (from eye height).
std::vector<std::pair<std::string_view, Camera>> ScenarioCameras(const Building& building);

inline constexpr const char* kSceneMeshName = "scene.ply";
inline constexpr const char* kScenarioFileName = "scenario.json";
inline constexpr const char* kMembersFileName = "building.csv";

/// Writes scene.ply, scenario.json (DescribeScenario and the hashes of all other files) and, when asked for, a PNG per
/// camera into an existing folder. The scene is read back under `guard` and checked: closed, wound outwards, one solid
/// per piece. Throws InputError when something cannot be written.
void WriteScenario(const Scenario& scenario, const std::filesystem::path& folder, bool pictures,
                   const ReadGuard& guard = {});

}  // namespace legopt::generate
