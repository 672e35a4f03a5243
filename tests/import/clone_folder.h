#pragma once

#include <filesystem>

#include "tests/dataset/test_data.h"
#include "tests/folders.h"

namespace legopt::test {

/// Returns a folder of these tests in the source tree: "clone" has the layout of a clone of the original benchmark.
inline std::filesystem::path ImportTestFile(const std::string& name) {
  return std::filesystem::path(SourceFolder()) / "tests" / "import" / name;
}

/// A writable copy of the clone.
class CloneFolder {
 public:
  CloneFolder() { std::filesystem::copy(ImportTestFile("clone"), path(), std::filesystem::copy_options::recursive); }
  std::filesystem::path path() const { return folder_.path() / "clone"; }
  /// Creates a folder in which a dataset can be made.
  std::filesystem::path StagedFolder(const std::string& name) const {
    std::filesystem::create_directories(folder_.path() / name);
    return folder_.path() / name;
  }

 private:
  TemporaryFolder folder_;
};

}  // namespace legopt::test
