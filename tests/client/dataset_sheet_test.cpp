// Policy: the data sheets of embedded datasets are those that `legopt dataset sheet` writes; LEGOPT_WRITE_GOLDEN=1
// writes them anew. Datasets with fewer files have shorter sheets, and damaged files are named.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "command_line_fixture.h"
#include "tests/dataset/test_data.h"
#include "tests/folders.h"

namespace legopt::client {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

std::filesystem::path Embedded(const std::string& name) {
  return std::filesystem::path(SourceFolder()) / "data" / name;
}

class EmbeddedSheet : public CommandLine, public testing::WithParamInterface<const char*> {};

TEST_P(EmbeddedSheet, IsUpToDate) {
  const std::filesystem::path file = Embedded(GetParam()) / "sheet.md";
  const ProgramResult result = Run({"dataset", "sheet", Embedded(GetParam()).string()});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  if (std::getenv("LEGOPT_WRITE_GOLDEN") != nullptr) std::ofstream(file) << result.out;
  EXPECT_EQ(result.out, test::ReadText(file))
      << "'legopt dataset sheet data/" << GetParam() << " --out data/" << GetParam() << "/sheet.md' writes it anew";
}

INSTANTIATE_TEST_SUITE_P(Datasets, EmbeddedSheet,
                         testing::Values("contacts-humanoid", "contacts-quadruped", "hands-small", "quadruped-rubble",
                                         "garage-hard"),
                         [](const auto& name) {
                           std::string text = name.param;
                           std::erase(text, '-');
                           return text;
                         });

class DatasetSheetTest : public CommandLine {
 protected:
  /// Copies an embedded dataset.
  std::filesystem::path Copy(const std::string& name) {
    const std::filesystem::path copy = folder_.path() / name;
    std::filesystem::copy(Embedded(name), copy, std::filesystem::copy_options::recursive);
    return copy;
  }
  ProgramResult Sheet(const std::filesystem::path& folder) { return Run({"dataset", "sheet", folder.string()}); }
};

TEST_F(DatasetSheetTest, DependsOnTheFilesOnly) {
  const std::filesystem::path copy = Copy("contacts-quadruped");
  const ProgramResult result = Run({"dataset", "sheet", copy.string(), "--out", "page.md"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(result.out, "");
  EXPECT_EQ(test::ReadText(folder_.path() / "page.md"), test::ReadText(copy / "sheet.md"));
}

TEST_F(DatasetSheetTest, WithoutTheFilesOfAGeneratorItHasLess) {
  const std::filesystem::path copy = Copy("contacts-quadruped");
  for (const char* file :
       {"generation.json", "features.csv", "certificate.json", "solutions-posture.json", "solutions-motion.json"}) {
    std::filesystem::remove(copy / file);
  }
  std::filesystem::remove_all(copy / "traps");
  const ProgramResult result = Sheet(copy);
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out,
              AllOf(HasSubstr("no `generation.json`"), HasSubstr("Without `certificate.json`"),
                    HasSubstr("| posture | 40 |"), Not(HasSubstr("## Features")), Not(HasSubstr("`traps/`"))));
}

TEST_F(DatasetSheetTest, AProofThatDoesNotHoldIsCounted) {
  const std::filesystem::path copy = Copy("contacts-quadruped");
  std::string proofs = test::ReadText(copy / "traps" / "proofs.json");
  const size_t turn = proofs.find("\"turn\": ") + 8;
  proofs.replace(turn, proofs.find(',', turn) - turn, "0.5");
  test::WriteText(copy / "traps" / "proofs.json", proofs);
  EXPECT_THAT(Sheet(copy).out, HasSubstr("19 of the 20 proofs"));
}

TEST_F(DatasetSheetTest, NamesFilesThatCannotBeRead) {
  ExpectError(Sheet(folder_.path() / "nowhere"), 2, "nowhere");
  const std::filesystem::path copy = Copy("contacts-quadruped");
  const auto damaged = [&](const std::string& file, const std::string& text) {
    const std::string before = test::ReadText(copy / file);
    test::WriteText(copy / file, text);
    const ProgramResult result = Sheet(copy);
    test::WriteText(copy / file, before);
    EXPECT_EQ(result.exit_code, file == "certificate.json" ? 13 : 2) << file;
    return result.err;
  };
  EXPECT_THAT(damaged("features.csv", "id,family\n0\n"),
              AllOf(HasSubstr("features.csv: line 2: the first line has 2 columns (got '1 cells')"),
                    HasSubstr("restore the file, or remove it")));
  EXPECT_THAT(damaged("features.csv", ""), HasSubstr("features.csv: line 1: names of columns are missing"));
  EXPECT_THAT(damaged("generation.json", "[]"), HasSubstr("generation.json: must be a JSON object"));
  EXPECT_THAT(damaged("generation.json", R"({"format": "legopt-contacts/2"})"),
              HasSubstr("generation.json: is not a record of a generator"));
  EXPECT_THAT(damaged("traps/proofs.json", R"({"proofs": [1]})"), HasSubstr("proofs.json: proofs: is not a list"));
  EXPECT_THAT(damaged("solutions-posture.json", "{"), HasSubstr("solutions-posture.json"));
  EXPECT_THAT(damaged("certificate.json", test::ReadText(Embedded("contacts-humanoid") / "certificate.json")),
              HasSubstr("certificate.json: is a certificate of dataset content"));
  const ProgramResult unwritable = Run({"dataset", "sheet", copy.string(), "--out", "/nowhere/page.md"});
  EXPECT_EQ(unwritable.exit_code, 2);
  EXPECT_THAT(unwritable.err, HasSubstr("/nowhere/page.md"));
}

TEST_F(DatasetSheetTest, EscapesTheNamesOfFiles) {
  const std::filesystem::path copy = Copy("contacts-quadruped");
  test::ReplaceInFile(copy / "features.csv", "rubble", "<b>|x");
  EXPECT_THAT(Sheet(copy).out, AllOf(Not(HasSubstr("<b>")), HasSubstr("| 1 |")));
}

}  // namespace
}  // namespace legopt::client
