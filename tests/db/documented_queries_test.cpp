// docs/reference/database.md is correct: its views have the columns that it lists, in that order, and each example
// query runs and finds rows in a database written by the store.
#include <gtest/gtest.h>

#include <fstream>
#include <map>
#include <sstream>

#include "db/migrations.h"
#include "db/read_only_database.h"
#include "db/sqlite_store.h"
#include "tests/db/store_samples.h"
#include "tests/folders.h"

namespace legopt::db {
namespace {

// Returns the indented lines of a section, without their indentation.
std::vector<std::string> IndentedLines(const std::string& heading) {
  constexpr std::string_view kIndent = "    ";
  std::ifstream file(SourceFolder() + "/docs/reference/database.md");
  std::vector<std::string> lines;
  bool inside = false;
  for (std::string line; std::getline(file, line);) {
    if (line.starts_with("## ")) inside = line == "## " + heading;
    if (inside && line.starts_with(kIndent)) lines.push_back(line.substr(kIndent.size()));
  }
  return lines;
}

// Returns comment -> statement.
std::map<std::string, std::string> Examples() {
  std::map<std::string, std::string> examples;
  std::string comment;
  for (const std::string& line : IndentedLines("Examples")) {
    if (line.starts_with("-- ")) comment = line;
    examples[comment] += line + "\n";
  }
  return examples;
}

std::vector<std::string> Words(const std::string& list) {
  std::vector<std::string> words;
  std::istringstream text(list);
  for (std::string word; std::getline(text, word, ',');) {
    word.erase(0, word.find_first_not_of(' '));
    if (!word.empty()) words.push_back(word);
  }
  return words;
}

std::map<std::string, std::vector<std::string>> DocumentedViews() {
  std::map<std::string, std::vector<std::string>> views;
  std::string name;
  for (const std::string& line : IndentedLines("Views")) {
    const auto colon = line.find(": ");
    if (colon != std::string::npos) name = line.substr(0, colon);
    for (const std::string& column : Words(colon == std::string::npos ? line : line.substr(colon + 2))) {
      views[name].push_back(column);
    }
  }
  return views;
}

class DocumentedDatabase : public testing::Test {
 protected:
  // Two methods of one name with a success, a failure, a death, a disagreement, a disturbed timing and a trace.
  void SetUp() override {
    NewExperiment e = SampleExperiment(1, 1, 1);
    e.dataset.joint_names = {"hip", "knee"};
    e.methods.push_back({"SQP", HashOf('b'), "{}", 10, 100, false, SceneRepresentation::kSurface});
    e.cells[1].method_index = 1;
    ResultRecord solved = SampleResult();
    solved.trace = {1, 2, 3};
    solved.wall_us = 9000;
    ResultRecord failed = SampleResult();
    failed.verdict_literal = failed.verdict_strict = failed.verdict_solid = failed.verdict_physical = Verdict::kCom;
    store_->Apply(std::vector<StoreOp>{CreateExperiment{e}, PutWorker{SampleWorker(1)}, LeaseJob{1, 1, 71, 1, 1},
                                       AcceptResult{1, 1, solved, "", "", 2}, LeaseJob{2, 1, 72, 1, 1},
                                       AcceptResult{2, 1, failed, "", "", 2}, LeaseJob{3, 1, 73, 1, 1},
                                       EndAttempt{3, 1, AttemptOutcome::kCrashed, JobState::kDead, 11, "", "", 2},
                                       LeaseJob{4, 1, 74, 1, 1}, AcceptResult{4, 1, SampleResult(), "", "", 2},
                                       FinishExperiment{1, 3}, RecordEvent{"experiment_finished", 3, 1, {}, {}, ""}});
  }

  TemporaryFolder folder_;
  std::filesystem::path path_ = folder_ / "results.sqlite";
  std::unique_ptr<Store> store_ = OpenSqliteStore(path_);
};

TEST_F(DocumentedDatabase, EveryExampleRunsAndFindsSomething) {
  const auto examples = Examples();
  EXPECT_GE(examples.size(), 9U);
  ReadOnlyDatabase database(path_);
  for (const auto& [comment, sql] : examples) {
    try {
      EXPECT_FALSE(database.Query(sql).rows.empty()) << sql;
    } catch (const StoreError& error) {
      ADD_FAILURE() << sql << error.what();
    }
  }
}

TEST_F(DocumentedDatabase, ViewsHaveTheColumnsThatAreListed) {
  auto documented = DocumentedViews();
  ReadOnlyDatabase database(path_);
  for (const auto& row : database.Query("SELECT name FROM sqlite_schema WHERE type = 'view'").rows) {
    const std::string name = std::get<std::string>(row.at(0));
    if (name.ends_with("_scores")) continue;  // documented in a sentence
    ASSERT_TRUE(documented.contains(name)) << name;
    std::vector<std::string> expected = documented[name];
    if (name == "benchmark_table") {  // the last four are repeated for each column of the table
      const std::vector<std::string> each(expected.end() - 4, expected.end());
      expected.resize(expected.size() - 4);
      for (const char* prefix : {"posture_good_", "posture_in_collision_", "motion_good_", "motion_in_collision_"}) {
        for (const std::string& column : each) expected.push_back(prefix + column);
      }
    }
    EXPECT_EQ(database.Query("SELECT * FROM " + name).columns, expected) << name;
    documented.erase(name);
  }
  EXPECT_TRUE(documented.empty()) << documented.begin()->first << " does not exist";
}

TEST_F(DocumentedDatabase, TheSchemaVersionIsTheOneThatIsNamed) {
  std::ifstream file(SourceFolder() + "/docs/reference/database.md");
  const std::string text(std::istreambuf_iterator<char>(file), {});
  EXPECT_NE(text.find("schema's version, now " + std::to_string(SchemaVersion()) + "."), std::string::npos);
}

}  // namespace
}  // namespace legopt::db
