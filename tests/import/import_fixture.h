// Imports of robots given as text.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <iterator>
#include <memory>
#include <string>
#include <vector>

#include "legopt/dataset/dataset.h"
#include "legopt/import/importer.h"
#include "tests/dataset/test_data.h"
#include "tests/import/walker.h"

namespace legopt::test {

class RobotImport : public testing::Test {
 protected:
  ImportReport Import(const Walker& walker) { return ImportText(walker.Urdf()); }
  ImportReport ImportText(const std::string& urdf) {
    WriteText(folder_.path() / "in" / "robot.urdf", urdf);
    options_.source = folder_.path() / "in";
    options_.name = "walker";
    out_ = folder_.path() / "out";
    std::filesystem::remove_all(out_);
    std::filesystem::create_directory(out_);
    return ImportDataset(options_, out_);
  }

  /// The folder that the last import wrote; the reference holds until the next call.
  const Dataset& Imported() {
    imported_ = Dataset::Load(out_);
    return *imported_;
  }

  static std::vector<DatasetDiagnostic> Of(const ImportReport& report, const std::string& check) {
    std::vector<DatasetDiagnostic> found;
    std::ranges::copy_if(report.findings, std::back_inserter(found),
                         [&](const DatasetDiagnostic& finding) { return finding.check == check; });
    return found;
  }

  TemporaryFolder folder_;
  ImportOptions options_;
  std::filesystem::path out_;

 private:
  std::shared_ptr<const Dataset> imported_;
};

}  // namespace legopt::test
