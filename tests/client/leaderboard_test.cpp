// Policy: a leaderboard counts all problems of a dataset by the judge's verdicts and the tier's rule. Problems that an
// archive lacks are not solved. Claimed times and judged figures are never mixed. The definition of a benchmark is read
// strictly.
#include "client/benchmark/leaderboard.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <map>

#include "app/data_folder.h"
#include "client/archive/archive_database.h"
#include "client/page/page_experiment.h"
#include "client/report/result_source.h"
#include "legopt/math/blake2b.h"
#include "legopt/types/input_error.h"
#include "tests/temporary_folder.h"

namespace legopt::client {
namespace {

using testing::HasSubstr;

const std::shared_ptr<const Dataset>& Garage() {
  static const auto dataset = Dataset::Load(app::DataFolder() / "garage-small");
  return dataset;
}

BenchmarkSet GarageSet() { return {"garage-small", Garage()->content_hash(), {Task::kPosture}}; }

Benchmark OneTier(Rule rule) {
  Benchmark benchmark;
  benchmark.tiers = {{"stand", "Stand", "?", rule, false, {GarageSet()}}};
  return benchmark;
}

// Verdicts by the literal and the physical rule, and claims.
struct MadeRun {
  int problem = 0, repetition = 0;
  Verdict literal = Verdict::kSuccess, physical = Verdict::kSuccess;
  double cost = 1.0;
  std::int64_t work_ns = 1'000'000;
};

// An entry with two methods, "A" with `runs` and "B" without results.
Entry EntryOf(const std::vector<MadeRun>& runs, int repetitions = 1) {
  Entry entry;
  entry.name = "entry";
  entry.dataset = Garage();
  Archive& archive = entry.archive;
  archive.dataset_hash = Garage()->content_hash();
  archive.repetitions = repetitions;
  archive.methods = {{"A", "", "{}", 0, 100}, {"B", "", "{}", 0, 100}};
  archive.initializations = {Initialization::kInCollision};
  archive.tasks = {{Task::kPosture, {0, 1}}};
  for (const MadeRun& run : runs) {
    ArchivedResult result;
    result.initialization = Initialization::kInCollision;
    result.problem = run.problem;
    result.repetition = run.repetition;
    result.work_ns = run.work_ns;
    result.cpu_us = 2000;
    archive.results.push_back(result);
    JudgedResult judged;
    for (const auto& [rule, word] : kEnumNames<Rule>) judged.verdicts[rule] = run.literal;
    judged.verdicts[Rule::kPhysical] = run.physical;
    judged.cost = run.cost;
    entry.judged.results.push_back(judged);
  }
  return entry;
}

const BoardCell& CellOf(const Board& board, std::size_t row) {
  return *board.rows.at(row).cells.at(EnumNumber(Initialization::kInCollision));
}

TEST(Leaderboard, MissingProblemsAreNotSolvedAndTheTiersRuleCounts) {
  const std::vector<Entry> entries = {
      EntryOf({{.problem = 0}, {.problem = 1, .physical = Verdict::kEquilibrium, .cost = 3.0}})};
  const Board literal = MakeBoards(OneTier(Rule::kLiteral), entries).at(0);
  ASSERT_EQ(literal.problems.size(), Garage()->problems(Task::kPosture).size());
  EXPECT_EQ(CellOf(literal, 0).solved, 2.0);
  EXPECT_EQ(CellOf(literal, 0).given, 2);
  const Board physical = MakeBoards(OneTier(Rule::kPhysical), entries).at(0);
  const BoardCell& cell = CellOf(physical, 0);
  EXPECT_EQ(cell.solved, 1.0);
  EXPECT_LT(cell.share.upper, 0.5) << "one of all problems, not one of two";
  EXPECT_EQ(cell.problems[1].verdict, Verdict::kEquilibrium);
  EXPECT_EQ(cell.problems[0].cost, 1.0);
  EXPECT_FALSE(cell.problems[1].cost.has_value());
  EXPECT_EQ(cell.problems[2].job_id, 0);
  EXPECT_TRUE(std::isinf(cell.cost_median)) << "most are not solved";
  EXPECT_FALSE(physical.rows[0].cells[EnumNumber(Initialization::kGood)].has_value());
  EXPECT_EQ(physical.rows.size(), 2U);
  EXPECT_EQ(CellOf(physical, 1).solved, 0.0);
}

TEST(Leaderboard, RepetitionsAreAveragedAndAMissingOneFails) {
  const std::vector<Entry> entries = {
      EntryOf({{.problem = 0, .repetition = 0, .cost = 1.0}, {.problem = 0, .repetition = 1, .cost = 2.0}}, 4)};
  const Board board = MakeBoards(OneTier(Rule::kSolid), entries).at(0);
  EXPECT_EQ(CellOf(board, 0).problems[0].share, 0.5);
  EXPECT_EQ(CellOf(board, 0).problems[0].cost, 1.5);
  EXPECT_EQ(CellOf(board, 0).solved, 0.5);
}

TEST(Leaderboard, UnknownWorkIsNotZeroWork) {
  std::vector<MadeRun> runs;
  std::vector<int> ids;
  for (const ProblemDefinition& problem : Garage()->problems(Task::kPosture)) {
    ids.push_back(problem.id);
    runs.push_back({.problem = problem.id, .work_ns = problem.id == 3 ? 0 : 1});
  }
  Entry entry = EntryOf(runs);
  entry.archive.tasks[0].problems = ids;
  const Board board = MakeBoards(OneTier(Rule::kSolid), std::vector<Entry>{entry}).at(0);
  EXPECT_FALSE(CellOf(board, 0).work_median_ms.has_value());
  EXPECT_EQ(CellOf(board, 0).cpu_median_ms, 2.0);
}

TEST(Leaderboard, BestRowsComeFirstAndJobsAreThoseOfTheArchivesPage) {
  std::vector<Entry> entries = {EntryOf({{.problem = 0}}), EntryOf({{.problem = 0}, {.problem = 1}})};
  entries[1].name = "better";
  const Board board = MakeBoards(OneTier(Rule::kSolid), entries).at(0);
  ASSERT_EQ(board.rows.size(), 4U);
  EXPECT_EQ(board.rows[0].entry, 1U);
  EXPECT_EQ(board.rows[1].entry, 0U);
  EXPECT_EQ(CellOf(board, 0).problems[1].job_id, 2);
  EXPECT_EQ(JobIds(entries[1].archive).at({1, Task::kPosture, Initialization::kInCollision, 0, 0}), 3);
  const nlohmann::ordered_json json = BoardsJson(OneTier(Rule::kSolid), entries, std::vector<Board>{board});
  EXPECT_EQ(json[0]["rows"][0]["cells"]["in_collision"]["solved"], 2.0);
  EXPECT_TRUE(json[0]["rows"][0]["cells"]["good"].is_null());
  EXPECT_TRUE(json[0]["rows"][0]["cells"]["in_collision"]["cost_median"].is_null());
  EXPECT_EQ(BoardsTable(OneTier(Rule::kSolid), entries, std::vector<Board>{board}).rows.size(), 4U);
}

// An archive that has one initialization does not lose by that; claims do not change the order.
TEST(Leaderboard, TheOrderIsThatOfJudgedShares) {
  std::vector<Entry> entries = {EntryOf({{.problem = 0, .work_ns = 1}}),
                                EntryOf({{.problem = 0}, {.problem = 1, .cost = 9.0}})};
  entries[0].archive.initializations.push_back(Initialization::kGood);
  ArchivedResult good = entries[0].archive.results[0];
  good.initialization = Initialization::kGood;
  entries[0].archive.results.push_back(good);
  entries[0].judged.results.push_back(entries[0].judged.results[0]);
  const Board board = MakeBoards(OneTier(Rule::kSolid), entries).at(0);
  EXPECT_EQ(board.rows[0].entry, 1U) << "two of forty from one guess, not one and one of two guesses";
  Benchmark traps = OneTier(Rule::kSolid);
  traps.tiers[0].infeasible = true;
  EXPECT_EQ(MakeBoards(traps, entries).at(0).rows.back().entry, 1U) << "most successes are the worst";
}

// Links to the page of an archive use its indices of methods and columns, whatever the order in the archive.
TEST(Leaderboard, LinksHaveTheIndicesOfTheArchivesPage) {
  Entry entry = EntryOf({{.problem = 1}});
  Archive& archive = entry.archive;
  archive.experiment = "mixed";
  archive.methods = {{"B", Blake2bHex("{}"), "{}", 0, 100}, {"A", Blake2bHex("{}"), "{}", 0, 100}};
  archive.builds = {{"0123456789ab", "legopt", "processor"}};
  archive.initializations = {Initialization::kInCollision, Initialization::kGood};
  archive.tasks = {{Task::kMotion, {0}}, {Task::kPosture, {0, 1}}};
  entry.judged.results[0].cost = 1.0;
  ArchiveDatabase writer;
  writer.Add(archive, entry.judged, *entry.dataset);
  const test::TemporaryFolder folder;
  writer.Finish(folder.path() / "r.sqlite");
  const SourceOptions options{(folder.path() / "r.sqlite").string(), {}, {}};
  const auto source = OpenResults(options);
  const nlohmann::ordered_json page =
      DescribeExperiment(*source, options, "", std::nullopt, {.rule = Rule::kSolid, .filter = {}}).json;
  const std::vector<Entry> entries = {entry};
  const std::vector<Board> boards = MakeBoards(OneTier(Rule::kSolid), entries);
  const nlohmann::ordered_json json = BoardsJson(OneTier(Rule::kSolid), entries, boards);
  for (const auto& row : json[0]["rows"]) {
    EXPECT_EQ(page["methods"][row["method"].get<std::size_t>()]["name"], row["name"]);
    for (const auto& [initialization, cell] : row["cells"].items()) {
      const auto& column = page["columns"][cell["column"].get<std::size_t>()];
      EXPECT_EQ(column["initialization"], initialization);
      EXPECT_EQ(column["task"], "posture");
      const auto job = cell["problems"]["job"][1];
      const auto& jobs = page["jobs"];
      const auto at = std::find(jobs["job"].begin(), jobs["job"].end(), job) - jobs["job"].begin();
      const auto index = static_cast<std::size_t>(at);
      EXPECT_EQ(jobs["problem"][index], 1);
      EXPECT_EQ(jobs["method"][index], row["method"]);
      EXPECT_EQ(jobs["column"][index], cell["column"]);
    }
  }
}

TEST(BenchmarkFile, TheEmbeddedTiersAreThoseOfTheEmbeddedDatasets) {
  const Benchmark benchmark = ReadBenchmark(EmbeddedBenchmark());
  EXPECT_EQ(benchmark.name, "RubbleBench");
  const std::map<std::string, std::string> folders = {{"contacts-humanoid-traps", "contacts-humanoid/traps"},
                                                      {"contacts-quadruped-traps", "contacts-quadruped/traps"}};
  int sets = 0;
  for (const BenchmarkTier& tier : benchmark.tiers) {
    for (const BenchmarkSet& set : tier.sets) {
      const auto folder = folders.find(set.dataset);
      const auto dataset = Dataset::Load(app::DataFolder() / (folder == folders.end() ? set.dataset : folder->second));
      EXPECT_EQ(dataset->content_hash(), set.hash) << set.dataset;
      for (const Task task : set.tasks) EXPECT_FALSE(dataset->problems(task).empty()) << set.dataset;
      ++sets;
    }
  }
  EXPECT_EQ(sets, 10);
}

std::string FaultOf(const std::string& tiers) {
  const test::TemporaryFolder folder;
  const auto file = folder.path() / "b.yaml";
  std::ofstream(file) << "name: B\nedition: \"1\"\nabout: text\ntiers:\n" << tiers;
  try {
    ReadBenchmark(file);
  } catch (const InputError& error) {
    return error.what();
  }
  return "no error";
}

TEST(BenchmarkFile, FaultsAreNamed) {
  const std::string hash(64, 'a');
  const auto tier = [&](const std::string& id, const std::string& rule, const std::string& set_hash,
                        const std::string& task) {
    return "  - {id: " + id + ", title: T, question: Q, rule: " + rule + ", sets: [{dataset: d, hash: " + set_hash +
           ", tasks: [" + task + "]}]}\n";
  };
  EXPECT_EQ(FaultOf(tier("a", "solid", hash, "posture")), "no error");
  EXPECT_THAT(FaultOf(tier("A", "solid", hash, "posture")), HasSubstr("other characters than a-z"));
  EXPECT_THAT(FaultOf(tier("a", "strong", hash, "posture")), HasSubstr("tiers[0].rule: 'strong' is unknown"));
  EXPECT_THAT(FaultOf(tier("a", "solid", "12", "posture")), HasSubstr("hash: must have 64 hex digits"));
  EXPECT_THAT(FaultOf(tier("a", "solid", hash, "jump")), HasSubstr("'jump' is unknown"));
  EXPECT_THAT(FaultOf(tier("a", "solid", hash, "posture") + tier("a", "solid", hash, "motion")),
              HasSubstr("'a' is the id of two tiers"));
  EXPECT_THAT(FaultOf(tier("a", "solid", hash, "posture") + tier("b", "strict", hash, "motion")),
              HasSubstr("another tier judges d by another rule"));
  EXPECT_THAT(FaultOf(tier("a", "solid", hash, "posture") + tier("b", "solid", hash, "posture")),
              HasSubstr("the posture problems of d are listed twice"));
}

}  // namespace
}  // namespace legopt::client
