// Policy: the suites of data/suites are valid, compare methods at one tolerance and by the rule of their family, and
// keep the hashes by which stored results are found.
#include <gtest/gtest.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <set>
#include <string>

#include "client/report/benchmark_table.h"
#include "client/suite/suite.h"
#include "legopt/input/text.h"
#include "legopt/math/blake2b.h"
#include "tests/folders.h"

namespace legopt::client {
namespace {

TEST(EmbeddedSuites, AreValid) {
  const std::filesystem::path folder = std::filesystem::path(SourceFolder()) / "data" / "suites";
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    if (entry.path().extension() == ".yaml") {
      EXPECT_NO_THROW(ReadSuite(entry.path())) << entry.path();
    }
  }
}

// Stored results are found by the hashes of their methods; a new option or default changes them on purpose. These
// hashes are with the original evaluator's pairs and each solver's own tolerance, which all suites used before.
TEST(EmbeddedSuites, HashesOfMethodsStay) {
  struct Row {
    const char* suite;
    std::size_t methods;
    const char* hash;  // hash of their hashes, one per line
  };
  const Row rows[] = {
      {"baselines", 6, "85d1739ec382d78df94415d604d4b59c40ab8cb27a272dc0edf5d6160c0eb222"},
      {"feasibility", 1, "4804ae5001e3a5a24d2eadd1666b359a8f7d5d2eebec3b7c4147d7979a6d6adb"},
      {"posture-sqp", 2, "703323b311931c550b24848762d76824595c20154191014f2a6de5f208581c43"},
      {"quick", 5, "3a5e15c1968401b5ae7b8f222766bf659c7518d0b89d7fdef78b5d132c03cbbd"},
      {"sample-size", 40, "28a3fdca4166b8533813b0e133290dc384b8fd6699035f4df3082e53b2639b5a"},
      {"table1-short", 16, "b4afb23e35445041e9369e2031b11dc63bc9fb6fcd4b1bde50dcca1630cbf82b"},
      {"table1", 32, "d05e0064d03fd6bc33531040c31d0bcb4194a56f33e06d344181e56b721a3b85"},
  };
  for (const Row& row : rows) {
    const std::string file = SourceFolder() + "/data/suites/" + row.suite + ".yaml";
    std::string text = ReadFileText(file, 1 << 16);
    if (const size_t at = text.find("constraint_tolerance: 1e-4"); at != std::string::npos) {
      text.erase(at, text.find('\n', at) - at);
    }
    const Suite suite = ParseSuite(text, file);
    EXPECT_EQ(suite.methods.size(), row.methods) << row.suite;
    std::string hashes;
    for (Method method : suite.methods) {
      method.pairs = PairSelection::kReference;
      hashes += method.Hash() + "\n";
    }
    EXPECT_EQ(Blake2bHex(hashes), row.hash) << row.suite;
  }
}

// Both suites of Table I list the paper's rows in its order.
TEST(EmbeddedSuites, TableOneHasThePapersRows) {
  const std::filesystem::path data = std::filesystem::path(SourceFolder()) / "data";
  const auto paper = ReadPaperTable(data / "paper-table1.csv");
  ASSERT_EQ(paper.size(), 16U);
  for (const char* name : {"table1.yaml", "table1-short.yaml"}) {
    const Suite suite = ReadSuite(data / "suites" / name);
    EXPECT_EQ(suite.tasks.size(), 2U);
    EXPECT_EQ(suite.initializations.size(), 2U);
    ASSERT_EQ(suite.methods.size() % paper.size(), 0U);
    for (std::size_t i = 0; i < suite.methods.size(); ++i) {
      const auto& row = paper[i % paper.size()];
      EXPECT_EQ(suite.methods[i].name, row.method);
      EXPECT_EQ(suite.methods[i].multi_starts, row.multi_starts);
      EXPECT_EQ(suite.methods[i].sample_size_percent, row.sample_size);
      EXPECT_EQ(suite.methods[i].incremental, row.method.starts_with("I-"));
    }
  }
}

// Only suites that measure what their tolerances change let methods end at different ones.
TEST(EmbeddedSuites, HaveOneToleranceIfTheyCompareMethods) {
  const std::set<std::string> apart = {"fidelity"};
  const std::set<std::string> alone = {"contacts-motions", "feasibility", "posture-sqp", "timed"};
  for (const auto& entry : std::filesystem::directory_iterator(SourceFolder() + "/data/suites")) {
    const std::string name = entry.path().stem().string();
    if (entry.path().extension() != ".yaml" || apart.contains(name) || alone.contains(name)) continue;
    for (const Method& method : ReadSuite(entry.path()).methods) {
      EXPECT_EQ(method.ToJson()["options"]["constraint_tolerance"].get<double>(), 1e-4) << name << ": " << method.name;
    }
  }
}

// Suites of the paper's experiments count by the original evaluator's rule, those on contacts with forces by the
// physical rule, and all others by the solid rule.
TEST(EmbeddedSuites, OfThePaperHaveTheOriginalEvaluatorsRule) {
  const std::set<std::string> paper = {"table1", "table1-short", "paper", "fidelity"};
  const std::set<std::string> forces = {"contacts", "contacts-motions", "stand-motions", "timed"};
  const auto folder = std::filesystem::path(SourceFolder()) / "data" / "suites";
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    if (entry.path().extension() != ".yaml") continue;
    const Suite suite = ReadSuite(entry.path());
    const bool original = paper.contains(entry.path().stem().string());
    const bool physical = forces.contains(entry.path().stem().string());
    EXPECT_EQ(suite.rule, original ? Rule::kLiteral : physical ? Rule::kPhysical : Rule::kSolid) << entry.path();
    for (const Method& method : suite.methods) {
      const bool reference = original || method.name.ends_with("original pairs");
      EXPECT_EQ(method.pairs, reference ? PairSelection::kReference : PairSelection::kAll) << entry.path();
    }
  }
}

}  // namespace
}  // namespace legopt::client
