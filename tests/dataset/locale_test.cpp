// Policy: a host program with a decimal comma gets the same datasets, messages and files as in the C locale.
#include <gtest/gtest.h>

#include <clocale>
#include <cstdlib>
#include <locale>
#include <string>

#include "legopt/dataset/dataset.h"
#include "legopt/dataset/internal/dataset_file.h"
#include "legopt/dataset/internal/dataset_writer.h"
#include "legopt/input/json.h"
#include "legopt/input/text.h"
#include "legopt/robot/internal/urdf_check.h"
#include "legopt/types/number_text.h"
#include "tests/dataset/synthetic_dataset.h"
#include "tests/dataset/test_data.h"

namespace legopt {
namespace {

constexpr std::size_t kMostBytes = 1 << 20;

/// Returns the content of a dataset as text.
std::string Description(const std::filesystem::path& folder) {
  const auto dataset = Dataset::Load(folder);
  std::string text = dataset->content_hash() + "\n" + FormatDatasetFile(ReadDatasetFile(folder), "");
  for (const Link& link : dataset->robot().links()) {
    text += link.name + " " + FormatNumber(link.mass) + " " + FormatNumber(link.com.x()) + "\n";
    for (const ShapeSpec& shape : link.collision) text += FormatNumber(shape.size.x()) + "\n";
  }
  for (const Joint& joint : dataset->robot().joints()) {
    text += joint.name + " " + FormatNumber(joint.lower) + " " + FormatNumber(joint.upper) + "\n";
  }
  const std::string urdf = ReadFileText(folder / ReadDatasetFile(folder).robot_file, kMostBytes);
  for (const UrdfDiagnostic& remark : ReviewUrdf(CheckUrdf(urdf, "robot")))
    text += remark.field + " " + remark.message + "\n";
  for (const SceneObject& object : dataset->scene().objects) {
    text += object.name + " " + FormatNumber(object.shape.size.x()) + " " +
            FormatNumber(object.shape.pose.translation().x()) + "\n";
    text += std::to_string(Tessellate(object.shape).vertices.size()) + "\n";
  }
  return text + FormatProblems(dataset->problems(Task::kPosture), Task::kPosture, "r", "s");
}

class LocaleTest : public testing::Test {
 protected:
  void SetUp() override {
    const std::string folder = (folder_ / "locales").string();
    std::filesystem::create_directories(folder);
    const std::string make = "localedef -i de_DE -f UTF-8 '" + folder + "/de_DE.UTF-8' >/dev/null 2>&1";
    // localedef returns 1 if it prints warnings.
    if (std::system(make.c_str()) != 0 && !std::filesystem::exists(folder + "/de_DE.UTF-8/LC_NUMERIC")) {
      GTEST_SKIP() << "localedef cannot make the locale de_DE (package locales)";
    }
    ::setenv("LOCPATH", folder.c_str(), 1);
  }
  void TearDown() override {
    std::locale::global(std::locale::classic());
    std::setlocale(LC_ALL, "C");
    ::unsetenv("LOCPATH");
  }

  test::TemporaryFolder folder_;
};

TEST_F(LocaleTest, DatasetsAreTheSameUnderADecimalCommaOfC) {
  const test::SyntheticFolder source(folder_ / "source");
  const std::string before = Description(source.path());
  ASSERT_NE(std::setlocale(LC_ALL, "de_DE.UTF-8"), nullptr);
  ASSERT_STREQ(std::localeconv()->decimal_point, ",");
  EXPECT_EQ(Description(source.path()), before);
  EXPECT_STREQ(std::localeconv()->decimal_point, ",") << "the host program's locale stays";
}

TEST_F(LocaleTest, DatasetsAreTheSameUnderADecimalCommaOfCpp) {
  const test::SyntheticFolder source(folder_ / "source");
  const std::string before = Description(source.path());
  std::locale::global(std::locale("de_DE.UTF-8"));
  EXPECT_EQ(Description(source.path()), before);
}

TEST_F(LocaleTest, TextsHaveAPoint) {
  std::locale::global(std::locale("de_DE.UTF-8"));
  EXPECT_EQ(FormatFixed(1234.5, 1), "1234.5");
  EXPECT_EQ(ParseNumber("0.5"), 0.5);
  EXPECT_EQ(ParseJson("[1234.5]", "").at(0), 1234.5);
  EXPECT_EQ(Dump(nlohmann::json{1234.5}), "[1234.5]");
}

}  // namespace
}  // namespace legopt
