#include "legopt/worldgen/internal/scenario.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>

#include "legopt/dataset/internal/dataset_content.h"
#include "legopt/dataset/internal/text_file.h"
#include "legopt/geometry/internal/mesh_bodies.h"
#include "legopt/geometry/internal/mesh_file.h"
#include "legopt/input/json.h"
#include "legopt/types/input_error.h"
#include "legopt/types/nearest_name.h"
#include "legopt/types/number_text.h"
#include "legopt/worldgen/internal/seeds.h"

namespace legopt::worldgen {
namespace {

/// Computes the variance of the ground height around a sample; returns the number of the eight neighbours that are
/// level with it.
int MeasureNeighbours(const Terrain& terrain, double x, double y, double z, const DifficultyOptions& options,
                      double& variance) {
  constexpr double kWindow_m = 0.6;  // includes rubble and steps, excludes other storeys
  double sum = 0.0;
  double squares = 0.0;
  int found = 0;
  int level = 0;
  for (int dx = -1; dx <= 1; ++dx) {
    for (int dy = -1; dy <= 1; ++dy) {
      const Terrain::Hit hit =
          terrain.Highest(x + dx * options.grid_m, y + dy * options.grid_m, z - kWindow_m, z + kWindow_m);
      if (hit.triangle < 0) continue;
      const double height = hit.z_m - z;
      sum += height;
      squares += height * height;
      ++found;
      level += std::abs(height) <= options.step_m && (dx != 0 || dy != 0) ? 1 : 0;
    }
  }
  variance = found > 0 ? std::max(0.0, squares / found - (sum / found) * (sum / found)) : 0.0;
  return level;
}

}  // namespace

Difficulty MeasureDifficulty(const Terrain& terrain, const Eigen::AlignedBox2d& plan,
                             const DifficultyOptions& options) {
  constexpr double kMaxClearance_m = 3.0;
  constexpr int kLevelNeighbours = 6;
  Difficulty result;
  int walkable = 0;
  std::vector<Terrain::Hit> hits;
  const double least_nz = std::cos(options.slope_rad);
  for (double y = plan.min().y() + 0.5 * options.grid_m; y < plan.max().y(); y += options.grid_m) {
    for (double x = plan.min().x() + 0.5 * options.grid_m; x < plan.max().x(); x += options.grid_m) {
      terrain.Ground(x, y, terrain.bounds().min().z(), terrain.bounds().max().z(), hits);
      for (const Terrain::Hit& hit : hits) {
        if (terrain.normal(hit.triangle).z() < least_nz) continue;
        const double clearance = terrain.CeilingHeight(x, y, hit.z_m) - hit.z_m;
        double variance = 0.0;
        if (clearance < options.headroom_m ||
            MeasureNeighbours(terrain, x, y, hit.z_m, options, variance) < kLevelNeighbours)
          continue;
        ++walkable;
        result.height_variance_m2 += variance;
        result.clearance_m += std::min(clearance, kMaxClearance_m);
      }
    }
  }
  result.walkable_m2 = walkable * options.grid_m * options.grid_m;
  if (walkable == 0) return result;
  result.height_variance_m2 /= walkable;
  result.clearance_m /= walkable;
  return result;
}

namespace {

using OrderedJson = nlohmann::ordered_json;

constexpr std::array<std::string_view, 4> kLevelNames = {"easier", "easy", "intermediate", "hard"};

Colour ColourOf(const Member& member) {
  switch (member.material) {
    case Material::kGround:
      return {150, 150, 147};
    case Material::kConcrete:
      return {200, 198, 192};
    case Material::kMasonry:
      return {196, 148, 122};
    case Material::kTimber:
      return {168, 124, 84};
    case Material::kCar: {
      constexpr std::array<Colour, 4> kPaints = {{{170, 50, 46}, {52, 92, 150}, {216, 216, 212}, {70, 74, 80}}};
      if (member.name.find("wheel") != std::string::npos) return {40, 40, 42};
      return kPaints[static_cast<size_t>(member.prop) % kPaints.size()];
    }
    case Material::kPerson:
      return {236, 178, 60};
  }
  return {200, 200, 200};
}

OrderedJson ToJson(const Difficulty& difficulty) {
  return {{"walkable_m2", difficulty.walkable_m2},
          {"height_variance_m2", difficulty.height_variance_m2},
          {"clearance_m", difficulty.clearance_m}};
}

/// Checks the mesh file as a user of the dataset will load it.
void CheckWritten(const std::filesystem::path& path, size_t pieces, const ReadGuard& guard) {
  const TriangleMesh mesh = LoadMesh(path.string(), Eigen::Vector3d::Ones(), guard);
  const MeshFaults faults = FindMeshFaults(mesh);
  if (faults.none()) return;
  throw InputError({path.string(), "mesh",
                    std::to_string(faults.open_edges) + " open edges, " + std::to_string(faults.inverted_components) +
                        " inverted of " + std::to_string(pieces) + " pieces",
                    "the generated mesh is not closed and wound outwards", "use another seed and report this one"});
}

}  // namespace

std::string_view ToString(ScenarioLevel level) { return kLevelNames.at(static_cast<size_t>(level)); }

ScenarioLevel ParseScenarioLevel(std::string_view text) {
  const auto found = std::find(kLevelNames.begin(), kLevelNames.end(), text);
  if (found != kLevelNames.end()) return static_cast<ScenarioLevel>(found - kLevelNames.begin());
  throw InputError({"--level", "", std::string(text), "unknown level of difficulty",
                    SuggestName(std::string(text), std::vector<std::string>{kLevelNames.begin(), kLevelNames.end()})});
}

Scenario MakeScenario(const ScenarioOptions& options, const CollapseProgress& progress) {
  Scenario scenario;
  scenario.options = options;
  scenario.building = MakeBuilding(options.kind, DeriveSeed(options.seed, "building"));
  std::mt19937_64 generator(DeriveSeed(options.seed, "fracture"));
  const std::vector<Cell> cells = Fracture(scenario.building, options.fracture, generator);
  const std::vector<Bond> bonds = FindBonds(scenario.building, cells);
  CollapseOptions collapse = options.collapse;
  collapse.snapshots_s.resize(std::min(collapse.snapshots_s.size(), static_cast<size_t>(options.level) + 1));
  const Snapshot snapshot =
      SimulateCollapse(scenario.building, cells, bonds, collapse, DeriveSeed(options.seed, "collapse"), progress)
          .back();
  scenario.pieces = PiecesOf(scenario.building, cells, snapshot);
  scenario.time_s = snapshot.time_s;
  scenario.num_cells = static_cast<int>(cells.size());
  scenario.num_bonds = static_cast<int>(bonds.size());
  scenario.num_bonds_broken = snapshot.bonds_broken;

  Snapshot before;
  before.cells.resize(cells.size());
  const auto measure = [&](const std::vector<Piece>& pieces) {
    return MeasureDifficulty(Terrain(MeshOf(pieces)), scenario.building.plan);
  };
  scenario.intact = measure(PiecesOf(scenario.building, cells, before));
  scenario.damaged = measure(scenario.pieces);
  return scenario;
}

namespace {

/// Lists the members of a building as CSV: one line per member, with its bounding box, m.
std::string ListMembers(const Building& building) {
  std::string text = "name,material,cell_m,corners,fixed,fails,x_low,y_low,z_low,x_high,y_high,z_high\n";
  for (const Member& member : building.members) {
    Eigen::AlignedBox3d box;
    for (const Eigen::Vector3d& corner : member.corners) box.extend(corner);
    text += member.name + "," + std::string(FactsOf(member.material).name) + "," + FormatGeneral(member.cell_m) + "," +
            std::to_string(member.corners.size()) + (member.fixed ? ",1" : ",0") + (member.fails ? ",1" : ",0");
    for (const Eigen::Vector3d& corner : {box.min(), box.max()}) {
      for (const double coordinate : corner) text += "," + FormatGeneral(coordinate);
    }
    text += "\n";
  }
  return text;
}

OrderedJson DescribeMaterials() {
  OrderedJson materials;
  for (const Material material : {Material::kGround, Material::kConcrete, Material::kMasonry, Material::kTimber,
                                  Material::kCar, Material::kPerson}) {
    const MaterialProperties facts = FactsOf(material);
    materials[std::string(facts.name)] = {{"density_kg_m3", facts.density_kg_m3}, {"strength", facts.strength}};
  }
  return materials;
}

}  // namespace

nlohmann::ordered_json DescribeScenario(const Scenario& scenario) {
  const ScenarioOptions& options = scenario.options;
  const FractureOptions& fracture = options.fracture;
  const CollapseOptions& collapse = options.collapse;
  OrderedJson building;
  for (const auto& [name, value] : scenario.building.parameters) building[name] = value;
  building["storeys_m"] = scenario.building.storeys_m;
  OrderedJson root;
  root["format"] = "legopt-scenario/1";
  root["kind"] = ToString(options.kind);
  root["level"] = ToString(options.level);
  root["seed"] = options.seed;
  root["building"] = building;
  root["fracture"] = {{"fine_radius_m", fracture.fine_radius_m}, {"jitter", fracture.jitter}};
  root["collapse"] = {{"step_s", collapse.step_s},
                      {"iterations", collapse.iterations},
                      {"front_m", collapse.front_m},
                      {"front_speed_m_s", collapse.front_speed_m_s},
                      {"tension_pa", collapse.tension_pa},
                      {"shear_pa", collapse.shear_pa},
                      {"bending_pa", collapse.bending_pa},
                      {"strength_spread", collapse.strength_spread},
                      {"cracked_share", collapse.cracked_share},
                      {"cracked_radius_m", collapse.cracked_radius_m},
                      {"friction", collapse.friction},
                      {"snapshots_s", collapse.snapshots_s}};
  root["materials"] = DescribeMaterials();
  root["time_s"] = scenario.time_s;
  root["cells"] = scenario.num_cells;
  root["bonds"] = scenario.num_bonds;
  root["bonds_broken"] = scenario.num_bonds_broken;
  root["pieces"] = scenario.pieces.size();
  root["triangles"] = MeshOf(scenario.pieces).triangles.size();
  root["difficulty"] = {
      {"walkable_share",
       scenario.intact.walkable_m2 > 0 ? scenario.damaged.walkable_m2 / scenario.intact.walkable_m2 : 0},
      {"damaged", ToJson(scenario.damaged)},
      {"intact", ToJson(scenario.intact)}};
  const DifficultyOptions measure;
  root["difficulty"]["measure"] = {{"grid_m", measure.grid_m},
                                   {"slope_rad", measure.slope_rad},
                                   {"headroom_m", measure.headroom_m},
                                   {"step_m", measure.step_m}};
  return root;
}

Drawing DrawScenario(const Scenario& scenario) {
  Drawing drawing;
  drawing.mesh = MeshOf(scenario.pieces, &drawing.parts);
  for (const int piece : drawing.parts) {
    const int member = scenario.pieces[static_cast<size_t>(piece)].member;
    drawing.colours.push_back(ColourOf(scenario.building.members[static_cast<size_t>(member)]));
  }
  return drawing;
}

std::vector<std::pair<std::string_view, Camera>> ScenarioCameras(const Building& building) {
  const Eigen::Vector2d centre = building.plan.center();
  const Eigen::Vector2d size = building.plan.sizes();
  const double reach = 0.9 * Eigen::Vector3d(size.x(), size.y(), 2.0 * building.height_m).norm();
  const double storey = building.storeys_m.size() > 1 ? building.storeys_m[1] : 3.0;
  const Eigen::Vector3d middle(centre.x(), centre.y(), storey);
  constexpr double kEyeHeight_m = 1.65;
  Camera outside{.eye = middle + reach * Eigen::Vector3d(-0.55, -0.75, 0.5), .target = middle};
  Camera back{.eye = middle + reach * Eigen::Vector3d(0.62, 0.68, 0.42), .target = middle};
  Camera inside{.eye = middle + reach * Eigen::Vector3d(0.2, -0.75, 0.72),
                .target = {centre.x(), centre.y(), 0.0},
                .cut_m = storey - 0.35};
  Camera ground{.eye = {building.plan.min().x() - 2.0, building.plan.min().y() - 1.5, kEyeHeight_m},
                .target = {building.foci.front().x(), building.foci.front().y(), kEyeHeight_m + 0.6},
                .field_of_view_rad = 0.9};
  return {{"outside", outside}, {"back", back}, {"inside", inside}, {"ground", ground}};
}

void WriteScenario(const Scenario& scenario, const std::filesystem::path& folder, bool pictures,
                   const ReadGuard& guard) {
  const TriangleMesh mesh = MeshOf(scenario.pieces);
  WritePly(folder / kSceneMeshName, mesh);
  CheckWritten(folder / kSceneMeshName, scenario.pieces.size(), guard);
  OrderedJson root = DescribeScenario(scenario);
  WriteTextFile(folder / kMembersFileName, ListMembers(scenario.building));
  root["files"][kMembersFileName] = HashFile(folder / kMembersFileName);
  root["files"][kSceneMeshName] = HashFile(folder / kSceneMeshName);
  if (pictures) {
    const Drawing drawing = DrawScenario(scenario);
    for (const auto& [name, camera] : ScenarioCameras(scenario.building)) {
      const std::string file = "picture-" + std::string(name) + ".png";
      WritePng(folder / file, Render(drawing, camera));
      root["files"][file] = HashFile(folder / file);
    }
  }
  WriteTextFile(folder / kScenarioFileName, Dump(root, 2) + "\n");
}

}  // namespace legopt::worldgen
