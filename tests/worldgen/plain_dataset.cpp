#include "tests/worldgen/plain_dataset.h"

#include "legopt/dataset/internal/dataset_content.h"
#include "legopt/dataset/internal/dataset_writer.h"
#include "tests/dataset/test_data.h"
#include "tests/folders.h"

namespace legopt::test {

const char kTwoLevels[] =
    "objects:\n"
    "  - {name: ground, shape: box, size: [8, 6, 0.4], position: [0, 0, -0.2]}\n"
    "  - {name: step-1, shape: box, size: [0.9, 3, 0.2], position: [0.4, 0, 0.1]}\n"
    "  - {name: step-2, shape: box, size: [0.9, 3, 0.4], position: [1.3, 0, 0.2]}\n"
    "  - {name: deck, shape: box, size: [2.2, 6, 0.6], position: [2.85, 0, 0.3]}\n";

void WritePlainDataset(const std::filesystem::path& folder, const std::string& scene) {
  const std::filesystem::path embedded = std::filesystem::path(SourceFolder()) / "data" / "garage-small";
  const auto source = Dataset::Load(embedded);
  DatasetDescription description = ReadDatasetFile(embedded);
  std::filesystem::create_directories(folder);
  CopyRobot(*source, description, folder);
  WriteText(folder / "scene.yaml", scene);
  description.scene_file = "scene.yaml";
  description.problem_files[Task::kMotion].clear();
  WriteText(folder / description.problem_files[Task::kPosture], FormatProblems({}, Task::kPosture, "atlas", "plain"));
  WriteText(folder / kDatasetFileName, FormatDatasetFile(description, "for tests"));
  WriteManifestHashes(folder);
}

}  // namespace legopt::test
