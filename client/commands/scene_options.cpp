#include "client/commands/scene_options.h"

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>

#include "legopt/types/number_text.h"
#include "legopt/worldgen/internal/picture.h"

namespace legopt::client {
namespace {

constexpr worldgen::Colour kKept = {190, 190, 186}, kChanged = {240, 160, 60}, kAdded = {215, 40, 40};

worldgen::Colour ColourOf(TriangleOrigin origin) {
  switch (origin) {
    case TriangleOrigin::kKept:
      return kKept;
    case TriangleOrigin::kChanged:
      return kChanged;
    case TriangleOrigin::kAdded:
      return kAdded;
  }
  return kKept;
}

worldgen::Drawing DrawingOf(std::span<const RebuiltObject> objects) {
  worldgen::Drawing drawing;
  int part = 0;
  for (const RebuiltObject& object : objects) {
    const TriangleMesh mesh = object.mesh ? object.mesh->mesh : Tessellate(object.object.shape);
    const int first = static_cast<int>(drawing.mesh.vertices.size());
    drawing.mesh.vertices.insert(drawing.mesh.vertices.end(), mesh.vertices.begin(), mesh.vertices.end());
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
      const auto& [a, b, c] = mesh.triangles[t];
      const TriangleOrigin origin = object.mesh ? object.mesh->origins[t] : TriangleOrigin::kKept;
      drawing.mesh.triangles.push_back({first + a, first + b, first + c});
      drawing.colours.push_back(ColourOf(origin));
      drawing.parts.push_back(3 * part + static_cast<int>(origin));
    }
    ++part;
  }
  return drawing;
}

}  // namespace

SceneRepairOptions SceneFlags::Options() const {
  SceneRepairOptions options;
  if (weld_m) options.mesh.weld_m = *weld_m;
  if (thickness_m) options.mesh.ground_thickness_m = options.mesh.wall_thickness_m = *thickness_m;
  options.scale = scale;
  options.up = up;
  options.Validate();
  return options;
}

void AddSceneOptions(const app::Command& command, SceneFlags* flags) {
  command.AddOption("--weld", flags->weld_m, "Merge vertices closer than this in m (default: 1e-5)");
  command.AddOption("--thickness", flags->thickness_m,
                    "Thickness of sheets in m (default: 0.1 for ground, 0.01 for others)");
  command.AddOption("--scale", flags->scale, "Multiply all lengths of the scene, e.g. 0.001 for millimetres");
  command.AddOption("--up", flags->up,
                    "Axis of the mesh that points up, y or z (default: that of the file; z if it names none)");
}

nlohmann::ordered_json RepairsToJson(std::span<const RebuiltObject> objects) {
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  for (const RebuiltObject& object : objects) {
    if (!object.mesh) continue;
    nlohmann::ordered_json entry = {{"object", object.object.name}};
    for (const MeshRepairEntry& kind : MeshRepairEntries()) entry[kind.name] = object.mesh->counts.*kind.count;
    entry["volume_m3"] = object.mesh->volume_m3;
    list.push_back(std::move(entry));
  }
  return list;
}

std::string FormatVolume(double volume_m3) { return FormatGeneral(volume_m3, 6) + " m3"; }

void WriteRepairPicture(std::span<const RebuiltObject> objects, const std::string& file) {
  const worldgen::Drawing drawing = DrawingOf(objects);
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3d& vertex : drawing.mesh.vertices) box.extend(vertex);
  if (box.isEmpty()) return;
  constexpr int kWidth = 800, kHeight = 800;
  constexpr double kDistance = 1.6;  // in diagonals: the scene fills the picture
  std::array<worldgen::Picture, 2> sides;
  for (std::size_t side = 0; side < sides.size(); ++side) {
    const Eigen::Vector3d direction = Eigen::Vector3d(-0.7, -1.0, side == 0 ? 0.9 : -0.9).normalized();
    worldgen::Camera camera;
    camera.target = box.center();
    camera.eye = box.center() + kDistance * std::max(box.diagonal().norm(), 1e-3) * direction;
    camera.width = kWidth;
    camera.height = kHeight;
    sides[side] = worldgen::Render(drawing, camera);
  }
  worldgen::WritePng(file, worldgen::Beside(sides[0], sides[1]));
}

}  // namespace legopt::client
