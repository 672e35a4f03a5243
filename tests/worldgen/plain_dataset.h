#pragma once

#include <filesystem>
#include <string>

namespace legopt::test {

/// Writes a dataset folder with the embedded robot, the given scene.yaml text and no problems.
void WritePlainDataset(const std::filesystem::path& folder, const std::string& scene);

/// Flat ground of 8 x 6 m with its top at z = 0, and a deck 0.9 m higher, reached by a flight of low steps.
extern const char kTwoLevels[];

}  // namespace legopt::test
