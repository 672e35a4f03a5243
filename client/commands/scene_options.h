#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <span>
#include <string>

#include "app/command_line.h"
#include "legopt/import/scene_repair.h"

namespace legopt::client {

/// Flags of commands that repair a scene.
struct SceneFlags {
  std::optional<double> weld_m;       ///< --weld
  std::optional<double> thickness_m;  ///< --thickness
  std::optional<double> scale;        ///< --scale
  std::string up;                     ///< --up

  SceneRepairOptions Options() const;  ///< returns the options without `repair` and guard
};

/// Adds --weld, --thickness, --scale and --up. `flags` must outlive parsing.
void AddSceneOptions(const app::Command& command, SceneFlags* flags);

/// Returns one object per mesh: its name, the count of each repair and its volume.
nlohmann::ordered_json RepairsToJson(std::span<const RebuiltObject> objects);

/// Returns a volume with its unit.
std::string FormatVolume(double volume_m3);

/// Writes a PNG of the scene from above and from below: red triangles were added, orange ones changed. Throws
/// InputError if it cannot be written.
void WriteRepairPicture(std::span<const RebuiltObject> objects, const std::string& file);

}  // namespace legopt::client
