// Every defect that the audit detects is planted once and found by its name; the audit reports nothing for a sound
// database.
#include "db/audit.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <set>
#include <string>
#include <vector>

#include "db/connection.h"
#include "db/sqlite_store.h"
#include "db/store_error.h"
#include "tests/db/fixtures.h"
#include "tests/db/store_samples.h"

namespace legopt::db {
namespace {

struct Planted {
  std::string rule;
  std::string sql;
  std::string offender;  // text that the finding must contain
};

// Rows of tests/db/fixtures: jobs 1 and 2 done, 3 dead, 4 cancelled, 5 leased, 6 queued after a return.
const std::vector<Planted>& Plants() {
  static const std::vector<Planted> plants = {
      {"integrity", "UPDATE jobs SET state = 'bogus' WHERE job_id = 6", "CHECK constraint failed in jobs"},
      {"foreign_keys", "UPDATE jobs SET problem_key = 99 WHERE job_id = 6", "table jobs, row 6"},
      {"done_has_result", "UPDATE jobs SET state = 'done' WHERE job_id = 3", "job 3"},
      {"result_is_of_done_job", "UPDATE jobs SET state = 'failed' WHERE job_id = 1", "job 1"},
      {"result_is_of_last_finished_attempt", "UPDATE results SET attempt = 1 WHERE job_id = 2", "job 2"},
      {"finished_attempt_has_result", "UPDATE attempts SET outcome = 'finished' WHERE job_id = 3 AND attempt = 3",
       "job 3"},
      {"attempts_are_counted", "UPDATE jobs SET attempts = 2 WHERE job_id = 3", "job 3"},
      {"attempts_are_counted", "DELETE FROM attempts WHERE job_id = 3 AND attempt = 2", "job 3"},
      {"returned_attempts_are_counted", "UPDATE jobs SET returned = 0 WHERE job_id = 6", "job 6"},
      {"attempts_stay_within_maximum", "UPDATE jobs SET max_attempts = 2 WHERE job_id = 3", "job 3"},
      {"leased_job_has_owner", "UPDATE attempts SET outcome = 'expired', ended_at_us = 99 WHERE job_id = 5", "job 5"},
      {"running_attempt_is_of_leased_job", "UPDATE jobs SET state = 'queued' WHERE job_id = 5", "job 5"},
      {"tokens_are_unique", "UPDATE attempts SET token = 101 WHERE job_id = 5", "token 101"},
      {"closed_experiment_has_no_open_job",
       "UPDATE experiments SET state = 'done', finished_at_us = 9 WHERE experiment_id = 2", "experiment 2"},
      {"experiment_has_its_jobs", "UPDATE experiments SET num_jobs = 3 WHERE experiment_id = 2", "experiment 2"},
      {"cell_has_its_jobs", "UPDATE cells SET num_jobs = 5 WHERE cell_id = 3", "cell 3"},
      {"tasks_of_cell_and_problem_agree", "UPDATE jobs SET problem_key = 3 WHERE job_id = 1", "job 1"},
      {"result_is_in_cell_of_job", "UPDATE results SET cell_id = 2 WHERE job_id = 1", "job 1"},
      {"waypoints_have_no_gaps", "INSERT INTO waypoints VALUES (1, 5, x'00000000000000000000000000000000')", "job 1"},
      {"waypoints_have_no_gaps", "INSERT INTO waypoints VALUES (1, 1, x'0000000000000000')", "job 1"},
      {"results_are_counted", "UPDATE result_workers SET results = results + 1", "experiment 1"},
      {"results_of_cells_are_counted", "UPDATE cell_results SET solved_solid = solved_solid + 1 WHERE cell_id = 2",
       "cell 2"},
      {"results_of_cells_are_counted", "UPDATE cell_results SET results = results + 1 WHERE cell_id = 1", "cell 1"},
      {"results_of_cells_are_counted", "DELETE FROM cell_results WHERE cell_id = 1", "cell 1"},
      {"taken_result_is_of_an_equal_job", "UPDATE jobs SET taken_from = 2 WHERE job_id = 1", "job 1"},
      {"taken_result_is_that_of_the_solve", "UPDATE jobs SET taken_from = 2 WHERE job_id = 1", "job 1"},
      {"unsolved_waypoints_have_no_gaps",
       "INSERT INTO unsolved_waypoints VALUES (1, 5, x'0000000000000000'), (1, 7, x'0000000000000000')", "job 1"},
      {"unsolved_waypoints_are_of_an_unsolved_window",
       "INSERT INTO unsolved_waypoints VALUES (1, 5, x'0000000000000000')", "job 1"},
      {"times_are_in_order", "UPDATE attempts SET ended_at_us = 1 WHERE job_id = 1", "job 1"},
  };
  return plants;
}

class AuditTest : public testing::Test {
 protected:
  void SetUp() override {
    MakeReleased(9, path_);
    OpenSqliteStore(path_);
  }

  // Applies a change, bypassing every guard that stops a program.
  void Plant(const std::string& sql) {
    Connection connection(path_, Connection::Mode::kReadWriteCreate);
    std::vector<std::pair<std::string, std::string>> triggers;
    {
      Statement read(connection, "SELECT name, sql FROM sqlite_schema WHERE type = 'trigger'", false);
      while (read.Step()) triggers.emplace_back(read.column_text(0), read.column_text(1));
    }
    for (const auto& [name, text] : triggers) connection.Execute("DROP TRIGGER " + name);
    connection.Execute("PRAGMA foreign_keys = OFF; PRAGMA ignore_check_constraints = 1");
    connection.Execute(sql);
    for (const auto& [name, text] : triggers) connection.Execute(text);
  }

  static std::string Listing(const std::vector<AuditDiagnostic>& defects) {
    std::string lines;
    for (const AuditDiagnostic& defect : defects) lines += defect.rule + ": " + defect.detail + "\n";
    return lines;
  }

  TemporaryFolder folder_;
  std::filesystem::path path_ = folder_ / "results.sqlite";
};

TEST_F(AuditTest, ASoundDatabaseHasNoDefect) { EXPECT_EQ(Listing(Audit(path_)), ""); }

TEST_F(AuditTest, AnEmptyDatabaseHasNoDefect) {
  { OpenSqliteStore(folder_ / "empty.sqlite"); }
  EXPECT_EQ(Listing(Audit(folder_ / "empty.sqlite")), "");
}

TEST_F(AuditTest, EveryPlantedDefectIsFoundByName) {
  for (const Planted& planted : Plants()) {
    const auto copy = folder_ / "sound.sqlite";
    std::filesystem::copy_file(path_, copy, std::filesystem::copy_options::overwrite_existing);
    Plant(planted.sql);
    const auto defects = Audit(path_);
    const auto found = std::find_if(defects.begin(), defects.end(),
                                    [&](const AuditDiagnostic& defect) { return defect.rule == planted.rule; });
    ASSERT_NE(found, defects.end()) << planted.rule << " was not found, but:\n" << Listing(defects);
    EXPECT_THAT(found->detail, testing::HasSubstr(planted.offender));
    EXPECT_GE(found->places, 1);
    std::filesystem::copy_file(copy, path_, std::filesystem::copy_options::overwrite_existing);
  }
}

TEST_F(AuditTest, AMissingTriggerIsFound) {
  {
    Connection connection(path_, Connection::Mode::kReadWriteCreate);
    connection.Execute("DROP TRIGGER results_are_final");
  }
  const auto defects = Audit(path_);
  ASSERT_EQ(defects.size(), 1U) << Listing(defects);
  EXPECT_EQ(defects[0].rule, "schema");
  EXPECT_THAT(defects[0].detail, testing::HasSubstr("results_are_final"));
}

TEST_F(AuditTest, AMissingTableIsADefectOfThisFile) {
  {
    Connection connection(path_, Connection::Mode::kReadWriteCreate);
    connection.Execute("DROP TABLE waypoints");
  }
  const auto defects = Audit(path_);
  ASSERT_FALSE(defects.empty());
  EXPECT_EQ(defects[0].rule, "schema");
  EXPECT_THAT(defects[0].detail, testing::HasSubstr("table 'waypoints'"));
  EXPECT_THAT(Listing(defects), testing::Not(testing::HasSubstr("legopt-audit")));
}

TEST_F(AuditTest, EveryRuleIsPlantedHere) {
  std::set<std::string> planted = {"schema"};
  for (const Planted& plant : Plants()) planted.insert(plant.rule);
  for (const std::string& rule : AuditRules()) EXPECT_TRUE(planted.contains(rule)) << rule;
}

TEST_F(AuditTest, DamagedPagesAreFoundWithoutACrash) {
  const auto size = std::filesystem::file_size(path_);
  constexpr std::uintmax_t kPage = 4096;
  int used = 0;
  for (std::uintmax_t page = 1; page * kPage < size; ++page) {
    // A free page holds nothing that damage could change.
    Connection connection(path_, Connection::Mode::kReadOnly);
    if (connection.QueryInt("SELECT count(*) FROM dbstat WHERE pageno = " + std::to_string(page + 1)) == 0) continue;
    ++used;
    const auto copy = folder_ / "damaged.sqlite";
    std::filesystem::copy_file(path_, copy, std::filesystem::copy_options::overwrite_existing);
    {
      std::fstream file(copy, std::ios::binary | std::ios::in | std::ios::out);
      file.seekp(static_cast<std::streamoff>(page * kPage));
      file << std::string(kPage, '\xA5');
    }
    try {
      EXPECT_FALSE(Audit(copy).empty()) << "page " << page;
    } catch (const StoreError& error) {
      EXPECT_EQ(error.code(), StoreErrorCode::kCorrupt) << error.what();
    }
  }
  EXPECT_GT(used, 30);
}

}  // namespace
}  // namespace legopt::db
