// The reader of meshes: it reads, or throws InputError. The first byte chooses the suffix.
#include "legopt/geometry/internal/mesh.h"

#include <array>
#include <cmath>

#include "app/isolated_call.h"
#include "legopt/types/input_error.h"
#include "tests/fuzz/fuzz_input.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static constexpr std::array kSuffixes = {".stl", ".obj", ".ply", ".dae"};
  legopt::fuzz::FuzzInput input(data, size);
  const char* suffix = kSuffixes[input.Number(1) % kSuffixes.size()];
  const legopt::fuzz::InputFile file(input.Text(), suffix);
  try {
    const legopt::TriangleMesh mesh = legopt::LoadMesh(file.path(), Eigen::Vector3d::Ones(), legopt::CallIsolated);
    for (const auto& triangle : mesh.triangles) {
      for (const int vertex : triangle) {
        legopt::fuzz::Require(vertex >= 0 && static_cast<std::size_t>(vertex) < mesh.vertices.size(), "vertex index");
      }
    }
  } catch (const legopt::InputError&) {
  }
  return 0;
}
