// Policy: methods of one name are distinguished and chosen by the options in which they differ. A choice without
// matches is an error that lists the alternatives.
#include "client/report/method_filter.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "client/client_error.h"
#include "test_database.h"

namespace legopt::client {
namespace {

using testing::HasSubstr;

class MethodFilterTest : public testing::Test {
 protected:
  MethodFilterTest() {
    TestExperiment experiment;
    experiment.methods = {{"SQP", 0}, {"SQP", 10}, {"I-Adam", 0}};
    experiment.results = {{.method = 0}, {.method = 1}, {.method = 2}};
    WriteTestDatabase(folder_.path() / "test.sqlite", experiment);
    source_ = OpenResults({(folder_.path() / "test.sqlite").string(), {}});
  }

  // Returns names and restarts of the selected methods.
  std::string Kept(const MethodFilter& filter) {
    std::string ids;
    for (const std::int64_t id : ExperimentMethods(*source_, 1).Ids(filter)) {
      ids += (ids.empty() ? " WHERE method_id IN (" : ", ") + std::to_string(id);
    }
    return source_
        ->Query("SELECT group_concat(name || ' ' || multi_starts, ', ') AS kept FROM methods" +
                (ids.empty() ? ids : ids + ")"))
        .At(0, "kept")
        .get<std::string>();
  }

  void ExpectRefused(const MethodFilter& filter, const std::string& words) {
    try {
      ExperimentMethods(*source_, 1).Ids(filter);
      ADD_FAILURE() << "an empty choice";
    } catch (const ClientError& error) {
      EXPECT_EQ(error.code(), ExitCode::kUsage);
      EXPECT_THAT(error.what(), HasSubstr(words));
    }
  }

  static MethodFilter Of(std::optional<std::string> method, std::optional<std::int64_t> multi_starts) {
    MethodFilter filter;
    filter.method = std::move(method);
    filter.multi_starts = multi_starts;
    return filter;
  }

  TemporaryFolder folder_;
  std::unique_ptr<ResultSource> source_;
};

TEST_F(MethodFilterTest, KeepsWhatFits) {
  EXPECT_EQ(Kept({}), "SQP 0, SQP 10, I-Adam 0");
  EXPECT_EQ(Kept(Of("sqp", {})), "SQP 0, SQP 10");
  EXPECT_EQ(Kept(Of({}, 0)), "SQP 0, I-Adam 0");
  EXPECT_EQ(Kept(Of("SQP", 10)), "SQP 10");
}

TEST_F(MethodFilterTest, WhatFitsNothingIsNamedWithWhatThereIs) {
  ExpectRefused(Of("SQQ", {}), "did you mean 'SQP'");
  ExpectRefused(Of({}, 7), "--multi-starts 7: experiment 1 has no such method");
  ExpectRefused(Of("I-Adam", 10), "among those of --method I-Adam");
  MethodFilter surface;
  surface.collision = SceneRepresentation::kSurface;
  ExpectRefused(surface, "solid");
}

TEST_F(MethodFilterTest, OnlyWhatDiffersWithinANameTellsApart) {
  EXPECT_EQ(ExperimentMethods(*source_, 1).DistinguishingColumns(), std::vector<std::string>{"multi_starts"});
}

}  // namespace
}  // namespace legopt::client
