// legopt scene: works on scenes without a robot.

#include <filesystem>
#include <iostream>
#include <memory>
#include <optional>
#include <string>

#include "app/command_line.h"
#include "app/isolated_call.h"
#include "app/printable.h"
#include "client/client_error.h"
#include "client/commands/commands.h"
#include "client/commands/options.h"
#include "client/commands/scene_options.h"
#include "client/report/escaped_text.h"
#include "client/report/finding_report.h"
#include "client/report/output.h"
#include "legopt/import/scene_repair.h"
#include "legopt/types/input_error.h"

namespace legopt::client {
namespace {

namespace fs = std::filesystem;

struct SceneRepairFlags {
  SceneFlags scene;
  std::string in;
  std::string out;
  std::optional<std::string> picture;
  bool json = false;
};

void PrintSceneReport(const RebuiltScene& scene, const std::vector<DatasetDiagnostic>& findings,
                      const SceneRepairFlags& flags, const std::string& picture) {
  if (flags.json) {
    nlohmann::ordered_json document = {{"scene", flags.out}, {"written", !AnyError(findings)}};
    document["repairs"] = RepairsToJson(scene.objects);
    document["volume_m3"] = scene.Volume_m3();
    document["picture"] = picture;
    document["findings"] = DatasetFindingsToJson(findings);
    std::cout << JsonText(document) << "\n";
    return;
  }
  std::cout << RenderTable(TableOf(findings), TableFormat::kText, LayoutOf({}));
  if (AnyError(findings)) return;
  std::cout << app::Printable(flags.out) << "\n";
  if (!picture.empty()) std::cout << app::Printable(picture) << "\n";
}

std::vector<DatasetDiagnostic> FindingsOf(const RebuiltScene& scene) {
  std::vector<DatasetDiagnostic> findings = scene.notes;
  for (const RebuiltObject& object : scene.objects) {
    if (!object.mesh) continue;
    const bool changed = !object.mesh->counts.none();
    DatasetDiagnostic& finding = findings.emplace_back();
    finding.severity = changed ? DatasetDiagnostic::Severity::kRepaired : DatasetDiagnostic::Severity::kInfo;
    finding.check = "repair";
    finding.field = object.object.name;
    finding.value = ToString(object.mesh->counts);
    finding.message = FormatVolume(object.mesh->volume_m3) + " enclosed";
  }
  for (DatasetDiagnostic& fault : FaultsOf(scene)) findings.push_back(std::move(fault));
  return findings;
}

ExitCode RepairScene(const SceneRepairFlags& flags) {
  SceneRepairOptions options = flags.scene.Options();
  options.repair = true;
  options.read_guard = CallIsolated;
  const fs::path out = flags.out;
  const std::string suffix = out.extension().string();
  if (suffix != ".ply" && suffix != ".yaml") {
    throw InputError({"", "--out", flags.out, "has no suffix of a scene that can be written",
                      "give NAME.ply for one mesh, or NAME.yaml to keep the objects"});
  }
  if (!fs::is_regular_file(flags.in)) {
    throw InputError({flags.in, "", "", "there is no such file", "name a mesh or a scene.yaml"});
  }
  std::error_code ignored;
  if (fs::exists(out, ignored)) {
    throw InputError({"", "--out", flags.out, "exists already", "name another file, or remove it"});
  }
  const RebuiltScene scene = RebuildScene(flags.in, options);
  const std::vector<DatasetDiagnostic> findings = FindingsOf(scene);
  std::string picture;
  if (!AnyError(findings)) {
    if (suffix == ".ply") {
      WriteSceneMesh(scene, out);
    } else {
      WriteSceneYaml(scene, out, out.stem().string() + "-meshes");
    }
    picture = flags.picture.value_or((out.parent_path() / (out.stem().string() + "-repairs.png")).string());
    WriteRepairPicture(scene.objects, picture);
  }
  PrintSceneReport(scene, findings, flags, picture);
  if (!AnyError(findings)) return ExitCode::kOk;
  throw ClientError(ExitCode::kUsage, flags.in + ": holes remain (marked FAIL); nothing was written");
}

}  // namespace

void AddSceneCommand(const app::Command& program, Invocation* invocation) {
  const auto scene = program.AddCommand("scene", "Repair scenes");
  scene.RequireCommand();
  scene.LetOptionsFollowCommands();
  const auto repair = scene.AddCommand(
      "repair", "Weld, orient, stitch, cap and thicken the meshes of a scene, so that they bound solids");
  const auto flags = std::make_shared<SceneRepairFlags>();
  repair
      .AddOption("FILE", flags->in,
                 "Mesh (.stl .obj .dae .ply .gltf .glb .off), scene.yaml or Gazebo world (.sdf .world)")
      .Required();
  repair.AddOption("--out", flags->out, "File to make: NAME.ply for one mesh, NAME.yaml to keep the objects")
      .Required();
  AddSceneOptions(repair, &flags->scene);
  repair.AddOption("--picture", flags->picture,
                   "PNG of the result from above and below: red is added, orange changed (default: NAME-repairs.png)");
  AddTextOrJsonOption(repair, &flags->json);
  repair.SetFooter(
      "Planar holes get a cap. Sheets get a thickness: ground downwards, walls on both sides. Every repair is "
      "counted.\n"
      "The result is in metres with z up. Exit code 2 if holes remain.");
  repair.WhenChosen([=] { invocation->body = [flags] { return RepairScene(*flags); }; });
}

}  // namespace legopt::client
