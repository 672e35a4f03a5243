// The reader of COLLADA robots: it reads, or throws InputError. Zip archives are .zae files, all other inputs .dae
// files.
#include "legopt/import/internal/collada_robot.h"
#include "legopt/types/input_error.h"
#include "tests/fuzz/fuzz_input.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  const legopt::fuzz::InputFile file(text, text.starts_with("PK") ? ".zae" : ".dae");
  try {
    const legopt::ColladaRobot robot = legopt::ReadColladaRobot(file.path());
    legopt::fuzz::Require(robot.links.size() == robot.joints.size() + 1, "joints lead to links");
    for (const legopt::ColladaLink& link : robot.links) {
      for (const legopt::ColladaGeometry& geometry : link.geometries) {
        for (const auto& triangle : geometry.mesh.triangles) {
          for (const int vertex : triangle) {
            legopt::fuzz::Require(vertex >= 0 && static_cast<std::size_t>(vertex) < geometry.mesh.vertices.size(),
                                  "vertex index");
          }
        }
      }
    }
  } catch (const legopt::InputError&) {
  }
  return 0;
}
