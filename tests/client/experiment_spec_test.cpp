// Policy: the specification is canonical. Identical experiments have the same text and identity, different ones do
// not. It names only things that exist in the dataset.
#include "client/suite/experiment_spec.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>

#include "client/commands/submission.h"
#include "legopt/types/input_error.h"

namespace legopt::client {
namespace {

using testing::AllOf;
using testing::HasSubstr;

const DatasetFacts kTinyDataset = {"tiny", std::string(64, 'a'), {{{{{0, 1}, {1, 1}, {7, 1}}, {}}}}};

Suite SuiteOf(const std::string& text) { return ParseSuite(text, "suite.yaml"); }

TEST(ExperimentSpec, HoldsTheContractsKeys) {
  const auto spec = BuildSpec(
      SuiteOf("name: quick\ntasks: posture\nproblems: [7, 0]\nmethods:\n  - {solver: sqp, multi_starts: [0, 10]}\n"),
      kTinyDataset);
  EXPECT_EQ(spec.at("spec_version"), 1);
  EXPECT_EQ(spec.at("name"), "quick");
  EXPECT_EQ(spec.at("seed"), 1);
  EXPECT_EQ(spec.at("repetitions"), 1);
  EXPECT_EQ(spec.at("dataset"), (nlohmann::json{{"name", "tiny"}, {"hash", std::string(64, 'a')}}));
  EXPECT_EQ(spec.at("tasks"), nlohmann::json::parse(R"([{"task":"posture","problems":[0,7],"waypoints":[1,1]}])"));
  EXPECT_EQ(spec.at("initializations"), (nlohmann::json{"good", "in_collision"}));
  EXPECT_EQ(spec.at("limits"), (nlohmann::json{{"effort_limit", DescriptionOf(Task::kPosture).default_effort_limit},
                                               {"wall_time_s", DescriptionOf(Task::kPosture).default_wall_limit_s},
                                               {"memory_mb", 1024}}));
  EXPECT_EQ(spec.at("max_attempts"), 3);
  ASSERT_EQ(spec.at("methods").size(), 2U);
  const auto& method = spec.at("methods")[1];
  EXPECT_EQ(method.at("name"), "SQP");
  EXPECT_EQ(method.at("hash").get<std::string>().size(), 64U);
  EXPECT_EQ(method.at("multi_starts"), 10);
  EXPECT_EQ(method.at("sample_size"), 100);
  EXPECT_EQ(method.at("incremental"), false);
  EXPECT_EQ(method.at("options").at("options").at("pairs"), "all");
  EXPECT_FALSE(spec.contains("rule")) << "solid";
}

// The original evaluator's pairs add no key, so the hashes of methods stored by earlier releases are unchanged.
TEST(ExperimentSpec, RuleAndPairsOfTheOriginalEvaluator) {
  const auto spec =
      BuildSpec(SuiteOf("tasks: posture\nrule: literal\npairs: reference\nmethods: [{solver: sqp}]\n"), kTinyDataset);
  EXPECT_EQ(spec.at("rule"), "literal");
  EXPECT_FALSE(spec.at("methods")[0].at("options").at("options").contains("pairs"));
  Method method = Method::Of("sqp");
  method.pairs = PairSelection::kReference;
  EXPECT_EQ(spec.at("methods")[0].at("hash"), method.Hash());
}

TEST(ExperimentSpec, WhatIsLeftOutIsTold) {
  const DatasetFacts dataset = {"tiny", std::string(64, 'a'), {{{{{0, 1}}, {{0, 54}, {3, 160}, {4, 162}, {9, 998}}}}}};
  const auto left_out = [&](const std::string& keys) {
    std::vector<std::string> sentences;
    BuildSpec(SuiteOf("tasks: [posture, motion]\nmethods: [{solver: sqp}]\n" + keys), dataset, &sentences);
    return sentences;
  };
  EXPECT_TRUE(left_out("").empty());
  EXPECT_THAT(left_out("max_stances: 80\n"),
              testing::ElementsAre("2 of 4 motion problems are longer than 80 stances (max_stances)"));
  EXPECT_THAT(
      left_out("max_stances: 20\n"),
      testing::ElementsAre("no motion is left: all 4 chosen problems are longer than 20 stances (max_stances)"));
}

TEST(ExperimentSpec, LongMotionsAreLeftOut) {
  const DatasetFacts dataset = {"tiny", std::string(64, 'a'), {{{{{0, 1}}, {{0, 54}, {3, 160}, {4, 162}, {9, 998}}}}}};
  const auto problems = [&](const std::string& keys) {
    return BuildSpec(SuiteOf("tasks: motion\nmethods: [{solver: sqp}]\n" + keys), dataset).at("tasks")[0];
  };
  EXPECT_EQ(problems("max_stances: 80\n").at("problems"), (nlohmann::json{0, 3}));
  EXPECT_EQ(problems("max_stances: 80\n").at("waypoints"), (nlohmann::json{54, 160}));
  EXPECT_EQ(problems("max_stances: 80\nproblems: [3, 9]\n").at("problems"), nlohmann::json::array({3}));
  EXPECT_EQ(problems("").at("problems"), (nlohmann::json{0, 3, 4, 9}));
  const auto tasks =
      BuildSpec(SuiteOf("tasks: [posture, motion]\nmax_stances: 20\nmethods: [{solver: sqp}]\n"), dataset);
  ASSERT_EQ(tasks.at("tasks").size(), 1U) << "a task that has become empty is left out while another remains";
  EXPECT_EQ(tasks.at("tasks")[0].at("task"), "posture");
  try {
    problems("max_stances: 20\n");
    FAIL();
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), AllOf(HasSubstr("max_stances"), HasSubstr("20"), HasSubstr("no motion problem")));
  }
}

TEST(ExperimentSpec, ASplitTakesEvenOrOddProblems) {
  const auto spec = [](const std::string& keys) {
    return BuildSpec(SuiteOf("tasks: posture\nmethods: [{solver: sqp}]\n" + keys), kTinyDataset);
  };
  EXPECT_FALSE(spec("split: all\n").contains("split"));
  EXPECT_EQ(spec("split: all\n"), spec(""));
  EXPECT_EQ(spec("split: tuning\n").at("tasks")[0].at("problems"), nlohmann::json::array({0}));
  EXPECT_EQ(spec("split: test\n").at("tasks")[0].at("problems"), (nlohmann::json{1, 7}));
  EXPECT_EQ(spec("split: test\nproblems: [0, 7]\n").at("tasks")[0].at("problems"), nlohmann::json::array({7}));
  EXPECT_EQ(spec("split: test\n").at("split"), "test");
  try {
    spec("split: test\nproblems: [0]\n");
    ADD_FAILURE() << "an experiment without a problem";
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), AllOf(HasSubstr("split"), HasSubstr("has none of the chosen posture problems")));
  }
}

TEST(ExperimentSpec, LimitsDifferOnlyWhereTasksDo) {
  const DatasetFacts dataset = {"tiny", std::string(64, 'a'), {{{{{0, 1}}, {{0, 54}}}}}};
  const auto limit = [&](const std::string& tasks, const std::string& keys) {
    const Suite suite = SuiteOf("tasks: " + tasks + "\nmethods: [{solver: sqp}]\n" + keys);
    return BuildSpec(suite, dataset).at("limits").at("wall_time_s");
  };
  EXPECT_EQ(limit("posture", ""), DescriptionOf(Task::kPosture).default_wall_limit_s);
  EXPECT_EQ(limit("motion", "limits: {wall_time_s: {motion: 300}}\n"), 300);
  EXPECT_EQ(limit("[posture, motion]", "limits: {wall_time_s: 20}\n"), 20);
  EXPECT_EQ(limit("[posture, motion]", "limits: {wall_time_s: {motion: 300}}\n"),
            (nlohmann::json{{"posture", DescriptionOf(Task::kPosture).default_wall_limit_s}, {"motion", 300.0}}));
  const Suite suite =
      SuiteOf("tasks: [posture, motion]\nmethods: [{solver: sqp}]\nlimits: {effort_limit: {motion: 7}}\n");
  EXPECT_EQ(BuildSpec(suite, dataset).at("limits").at("effort_limit"),
            (nlohmann::json{{"posture", DescriptionOf(Task::kPosture).default_effort_limit}, {"motion", 7}}));
}

TEST(ExperimentSpec, AllProblemsWhenNoneAreNamed) {
  const auto spec = BuildSpec(SuiteOf("tasks: posture\nmethods: [{solver: sqp}]\nrepetitions: 4\n"), kTinyDataset);
  EXPECT_EQ(spec.at("tasks")[0].at("problems"), (nlohmann::json{0, 1, 7}));
  EXPECT_EQ(CountJobs(spec), 1 * 2 * 3 * 4);
  EXPECT_EQ(DescribeJobs(spec), "24 jobs: 1 method x 2 initializations x 3 posture problems x 4 repetitions");
}

TEST(ExperimentSpec, UnknownProblemIsNamedWithWhatThereIs) {
  try {
    BuildSpec(SuiteOf("tasks: posture\nproblems: [1, 5]\nmethods: [{solver: sqp}]\n"), kTinyDataset);
    FAIL();
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(),
                AllOf(HasSubstr("suite.yaml"), HasSubstr("'5'"), HasSubstr("tiny"), HasSubstr("from 0 to 7")));
  }
}

TEST(ExperimentSpec, TaskWithoutProblemsIsRefused) {
  EXPECT_THROW(BuildSpec(SuiteOf("tasks: motion\nmethods: [{solver: sqp}]\n"), kTinyDataset), InputError);
}

TEST(ExperimentSpec, EqualContentHasEqualIdentity) {
  const auto spec = BuildSpec(SuiteOf("tasks: posture\nmethods: [{solver: sqp}]\n"), kTinyDataset);
  const auto same = BuildSpec(
      SuiteOf("methods:\n  - solver: sqp\n    multi_starts: 0\nproblems: [0-7]\ntasks:\n  - posture\nseed: 1\n"),
      {"tiny", kTinyDataset.hash, {{{{{0, 1}, {1, 1}, {2, 1}, {3, 1}, {4, 1}, {5, 1}, {6, 1}, {7, 1}}, {}}}}});
  const auto explicit_same = BuildSpec(
      SuiteOf("methods:\n  - solver: sqp\n    multi_starts: 0\nproblems: [7, 0, 1]\ntasks:\n  - posture\nseed: 1\n"),
      kTinyDataset);
  EXPECT_EQ(spec.dump(), explicit_same.dump());
  EXPECT_EQ(ContentSubmissionId(spec), ContentSubmissionId(explicit_same));
  EXPECT_NE(ContentSubmissionId(spec), ContentSubmissionId(same));
  const auto other_seed = BuildSpec(SuiteOf("tasks: posture\nmethods: [{solver: sqp}]\nseed: 2\n"), kTinyDataset);
  EXPECT_NE(ContentSubmissionId(spec), ContentSubmissionId(other_seed));
}

TEST(ExperimentSpec, TheSubmitterIsTheUserUnlessSaidOtherwise) {
  unsetenv("LEGOPT_SUBMITTER");
  const std::string user = SubmitterName();
  EXPECT_FALSE(user.empty());
  EXPECT_EQ(user, SubmitterName());
  setenv("LEGOPT_SUBMITTER", "nightly", 1);
  EXPECT_EQ(SubmitterName(), "nightly");
  setenv("LEGOPT_SUBMITTER", "", 1);
  EXPECT_EQ(SubmitterName(), "");
  for (const std::string& bad : {std::string(201, 'x'), std::string("\xff")}) {
    setenv("LEGOPT_SUBMITTER", bad.c_str(), 1);
    try {
      SubmitterName();
      ADD_FAILURE() << bad;
    } catch (const InputError& error) {
      EXPECT_THAT(error.what(), AllOf(HasSubstr("LEGOPT_SUBMITTER"), HasSubstr("200 bytes")));
    }
  }
  unsetenv("LEGOPT_SUBMITTER");
}

TEST(ExperimentSpec, EachSubmitterHasAnIdentityOfHisOwn) {
  auto spec = BuildSpec(SuiteOf("tasks: posture\nmethods: [{solver: sqp}]\n"), kTinyDataset);
  spec["submitter"] = "ada";
  const std::string of_ada = ContentSubmissionId(spec);
  EXPECT_EQ(ContentSubmissionId(spec), of_ada);
  spec["submitter"] = "bob";
  EXPECT_NE(ContentSubmissionId(spec), of_ada);
}

TEST(ExperimentSpec, RandomIdentitiesDiffer) {
  EXPECT_EQ(RandomSubmissionId().size(), 32U);
  EXPECT_NE(RandomSubmissionId(), RandomSubmissionId());
}

}  // namespace
}  // namespace legopt::client
