// Policy: one filter for all commands that read results. Methods of one name are distinguished and chosen by the
// options in which they differ. A value without matches is an error that lists the alternatives.
#include "client/report/result_filter.h"

#include "test_database.h"

namespace legopt::client {
namespace {

using testing::HasSubstr;

class ResultFilterTest : public testing::Test {
 protected:
  ResultFilterTest() {
    TestExperiment experiment;
    experiment.methods = {{"SQP", 0}, {"SQP", 10}, {"I-Adam", 0}};
    experiment.results = {{.method = 0}, {.method = 0, .initialization = "in_collision"}, {.method = 1}, {.method = 2}};
    WriteTestDatabase(folder_.path() / "test.sqlite", experiment);
    source_ = OpenResults({(folder_.path() / "test.sqlite").string(), {}});
  }

  // Returns names, restarts and initializations of the selected cells.
  std::string Kept(const ResultFilter& filter) {
    std::string ids;
    const KeptCells kept(*source_, 1, filter);
    for (const std::int64_t id : kept.ids()) {
      ids += (ids.empty() ? " WHERE cell_id IN (" : ", ") + std::to_string(id);
    }
    const std::string order = " ORDER BY cell_id)";
    return source_
        ->Query(
            "SELECT group_concat(cell, ', ') AS kept FROM (SELECT name || ' ' || multi_starts || ' ' || "
            "initialization AS cell FROM cells JOIN methods USING (method_id)" +
            (ids.empty() ? ids : ids + ")") + order)
        .Text(0, "kept");
  }

  void ExpectRefused(const ResultFilter& filter, const std::string& words) {
    try {
      const KeptCells kept(*source_, 1, filter);
      ADD_FAILURE() << "an empty choice";
    } catch (const ClientError& error) {
      EXPECT_EQ(error.code(), ExitCode::kUsage);
      EXPECT_THAT(error.what(), HasSubstr(words));
    }
  }

  TemporaryFolder folder_;
  std::unique_ptr<ResultSource> source_;
};

TEST_F(ResultFilterTest, KeepsCellsOfEachOption) {
  EXPECT_EQ(Kept({}), "SQP 0 good, SQP 0 in_collision, SQP 10 good, I-Adam 0 good");
  EXPECT_EQ(Kept({.methods = {"sqp"}}), "SQP 0 good, SQP 0 in_collision, SQP 10 good");
  EXPECT_EQ(Kept({.initializations = {"in_collision"}}), "SQP 0 in_collision");
  EXPECT_EQ(Kept({.initializations = {"good"}, .multi_starts = 10}), "SQP 10 good");
  EXPECT_EQ(Kept({.tasks = {"posture"}, .multi_starts = 0}), "SQP 0 good, SQP 0 in_collision, I-Adam 0 good");
  EXPECT_EQ(Kept({.methods = {"SQP"}, .multi_starts = 10}), "SQP 10 good");
}

TEST_F(ResultFilterTest, MethodsAreListsOfNamesAndChoices) {
  EXPECT_EQ(Kept({.methods = {"sqp:multi_starts=10,i-adam"}}), "SQP 10 good, I-Adam 0 good");
  EXPECT_EQ(Kept({.methods = {"SQP:multi_starts=10,collision=solid", "I-Adam"}}), "SQP 10 good, I-Adam 0 good");
  EXPECT_EQ(Kept({.methods = {"I-Adam,SQP:multi_starts=10"}}), "SQP 10 good, I-Adam 0 good") << "order of the cells";
}

TEST_F(ResultFilterTest, AValueWithoutMatchesIsRefusedWithTheKnownOnes) {
  ExpectRefused({.methods = {"SQQ"}}, "--methods SQQ: experiment 1 has no such method; did you mean 'SQP'");
  ExpectRefused({.methods = {"SQP,ADAM"}}, "--methods ADAM: experiment 1 has no such method");
  ExpectRefused({.methods = {"SQP:multi_starts=7"}}, "there is 'SQP:multi_starts=0', 'SQP:multi_starts=10'");
  ExpectRefused({.methods = {"SQP:multi_start=7"}}, "'multi_start' tells no methods apart");
  ExpectRefused({.multi_starts = 7}, "--multi-starts 7: experiment 1 has no such method; valid: 0, 10");
  ExpectRefused({.methods = {"I-Adam"}, .multi_starts = 10}, "among those of --methods I-Adam");
  ExpectRefused({.collision = SceneRepresentation::kSurface}, "solid");
  ExpectRefused({.tasks = {"motion"}}, "--tasks motion: experiment 1 has no such task; valid: posture");
  ExpectRefused({.methods = {"I-Adam"}, .initializations = {"good", "in_collision"}},
                "--initializations in_collision: experiment 1 has no such initialization among those of --methods "
                "I-Adam; valid: good");
}

TEST_F(ResultFilterTest, ColumnsDistinguishMethodsOnlyWithinAName) {
  EXPECT_EQ(DistinguishingColumns(*source_, 1), std::vector<std::string>{"multi_starts"});
}

TEST(RowPositions, AreNumbersAndRanges) {
  using Positions = std::vector<std::size_t>;
  EXPECT_EQ(RowPositions({}, 2), (Positions{0, 1}));
  EXPECT_EQ(RowPositions({"3,1-2", "2"}, 5), (Positions{0, 1, 2}));
  for (const char* wrong : {"0", "2-1", "x", "1-", "-2", "6", "1-6", "1-99999999999999999999", ""}) {
    EXPECT_THROW(RowPositions({wrong}, 5), ClientError) << wrong;
  }
  EXPECT_THROW(RowPositions({"1"}, 0), ClientError);
}

}  // namespace
}  // namespace legopt::client
