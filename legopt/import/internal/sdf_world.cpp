#include "legopt/import/internal/sdf_world.h"

#include <dlfcn.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cctype>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <system_error>

#include "legopt/geometry/internal/height_map.h"
#include "legopt/import/internal/model_uri.h"
#include "legopt/import/internal/sdf_module.h"
#include "legopt/input/json.h"
#include "legopt/input/text.h"
#include "legopt/types/input_error.h"

namespace legopt {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr std::size_t kMaxSdfBytes = std::size_t{64} << 20;

[[noreturn]] void RefuseSdf(const fs::path& path, const std::string& field, const std::string& value,
                            const std::string& message, const std::string& fix) {
  throw InputError({path.string(), field, value, message, fix});
}

/// Hides the home folder while libsdformat runs: it would write a log there.
class NoHome {
 public:
  NoHome() {
    if (const char* home = std::getenv("HOME")) home_ = home;
    unsetenv("HOME");
  }
  ~NoHome() {
    if (home_) setenv("HOME", home_->c_str(), 1);
  }
  NoHome(const NoHome&) = delete;
  NoHome& operator=(const NoHome&) = delete;

 private:
  std::optional<std::string> home_;
};

/// Loads the module: from ../lib/legopt of an installed program, beside a built program, or above a built test. It is
/// never unloaded.
ReadSdfFunction LoadModule(const fs::path& world) {
  std::error_code ignored;
  const fs::path folder = fs::read_symlink("/proc/self/exe", ignored).parent_path();
  std::string cause = "not found in ../lib/legopt or beside " + folder.string();
  for (const char* place : {"../lib/legopt", "", ".."}) {
    const fs::path file = folder / place / kSdfModule;
    if (!fs::exists(file, ignored)) continue;
    if (void* module = dlopen(file.c_str(), RTLD_NOW | RTLD_LOCAL)) {
      if (void* function = dlsym(module, kReadSdf)) return reinterpret_cast<ReadSdfFunction>(function);
    }
    cause = dlerror();
    break;
  }
  RefuseSdf(world, "", "", std::string("cannot be read: the module ") + kSdfModule + " cannot be loaded: " + cause,
            "install legopt again, with libsdformat12");
}

SceneObject ObjectFrom(const json& source, const fs::path& path) {
  using Kind = ShapeSpec::Kind;
  SceneObject object;
  object.name = source.at("name").get<std::string>();
  const auto size = source.at("size").get<std::array<double, 3>>();
  const auto pose = source.at("pose").get<std::array<double, 16>>();
  ShapeSpec& shape = object.shape;
  shape.pose.matrix() = Eigen::Map<const Eigen::Matrix4d>(pose.data());
  const std::string kind = source.at("kind").get<std::string>();
  const Eigen::Vector3d extents(size[0], size[1], size[2]);
  if (kind == "box" || kind == "sphere" || kind == "cylinder" || kind == "capsule") {
    shape.kind = kind == "box"        ? Kind::kBox
                 : kind == "sphere"   ? Kind::kSphere
                 : kind == "cylinder" ? Kind::kCylinder
                                      : Kind::kCapsule;
    shape.size = extents;
    return object;
  }
  const std::string uri = source.at("uri").get<std::string>();
  const fs::path own = source.at("folder").get<std::string>();
  fs::path file = own.is_absolute() ? FindByUri(own, uri) : fs::path();
  if (file.empty()) file = FindByUri(path.parent_path(), uri);
  if (file.empty()) {
    RefuseSdf(path, object.name, uri, "there is no such file", "put it beside the world or into a folder 'models'");
  }
  if (kind == "heightmap" && !IsHeightMapFile(file)) {
    RefuseSdf(path, object.name, uri, "is not a height map that can be read", "convert it to PNG or PGM");
  }
  shape.kind = Kind::kMesh;
  shape.mesh_file = file.string();
  shape.scale = extents;
  return object;
}

}  // namespace

bool IsSdfFile(const fs::path& path) {
  std::string suffix = path.extension().string();
  std::transform(suffix.begin(), suffix.end(), suffix.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return suffix == ".sdf" || suffix == ".world";
}

Scene ReadSdfWorld(const fs::path& path, const ReadGuard& guard) {
  const auto read = [&path] {
    const NoHome hidden;
    json world;
    LoadModule(path)(ReadFileText(path, kMaxSdfBytes), path.parent_path().string(), &world);
    return Dump(world);
  };
  std::string answer;
  try {
    answer = guard ? guard(read, {.cpu_s = 30}) : read();
  } catch (const GuardedReadError& failure) {
    RefuseSdf(path, "", "", std::string("cannot be read: the reader failed: ") + failure.what(),
              "export the world again");
  }
  const json world = ParseJson(answer, path.string());
  if (!world.contains("objects")) {
    RefuseSdf(path, world.at("field").get<std::string>(), world.at("value").get<std::string>(),
              world.at("message").get<std::string>(), world.at("fix").get<std::string>());
  }
  Scene scene{.objects = {}, .read_guard = guard};
  for (const json& object : world.at("objects")) scene.objects.push_back(ObjectFrom(object, path));
  if (scene.objects.empty()) {
    RefuseSdf(path, "", "", "has no collision shape", "add <collision> elements to its models");
  }
  return scene;
}

}  // namespace legopt
