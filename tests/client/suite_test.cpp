// Policy: a suite is parsed strictly. Valid values are stored exactly; every fault is an InputError that names the
// place (FILE:LINE), the key and the fix.
#include "client/suite/suite.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <string>

#include "legopt/types/input_error.h"
#include "tests/folders.h"

namespace legopt::client {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;

constexpr char kComplete[] = R"(name: table
dataset: ../garage-small
seed: 7
repetitions: 3
tasks: [posture, motion]
problems: [0, "3-5"]
initializations: [good]
methods:
  - name: SQP
    solver: sqp
    multi_starts: [0, 10]
limits: {effort_limit: 5000, wall_time_s: 2.5, memory_mb: 256}
max_attempts: 2
builds: any
rule: strict
pairs: reference
)";

constexpr char kSmall[] = "tasks: posture\nmethods:\n  - {solver: sqp}\n";

std::string FaultOf(const std::string& text) {
  try {
    ParseSuite(text, "suites/bad.yaml");
  } catch (const InputError& error) {
    return error.what();
  }
  return "no error";
}

TEST(Suite, TakesEveryKeyOver) {
  const Suite suite = ParseSuite(kComplete, "data/suites/table.yaml");
  EXPECT_EQ(suite.name, "table");
  EXPECT_EQ(suite.dataset, std::filesystem::path("data/garage-small"));
  EXPECT_EQ(suite.seed, 7);
  EXPECT_EQ(suite.repetitions, 3);
  ASSERT_EQ(suite.tasks.size(), 2U);
  EXPECT_EQ(suite.tasks[0].task, Task::kPosture);
  EXPECT_THAT(*suite.tasks[1].problems, ElementsAre(0, 3, 4, 5));
  EXPECT_THAT(suite.initializations, ElementsAre(Initialization::kGood));
  EXPECT_EQ(suite.effort_limit[Task::kPosture], 5000);
  EXPECT_EQ(suite.effort_limit[Task::kMotion], 5000);
  EXPECT_DOUBLE_EQ(suite.wall_time_s[Task::kPosture], 2.5);
  EXPECT_DOUBLE_EQ(suite.wall_time_s[Task::kMotion], 2.5);
  EXPECT_EQ(suite.memory_mb, 256);
  EXPECT_EQ(suite.max_attempts, 2);
  EXPECT_EQ(suite.builds, BuildPolicy::kAny);
  EXPECT_EQ(suite.rule, Rule::kStrict);
  for (const Method& method : suite.methods) EXPECT_EQ(method.pairs, PairSelection::kReference);
}

TEST(Suite, ListsOfMethodValuesMakeSeveralMethods) {
  const Suite suite = ParseSuite(kComplete, "table.yaml");
  ASSERT_EQ(suite.methods.size(), 2U);
  EXPECT_EQ(suite.methods[0].name, "SQP");
  EXPECT_EQ(suite.methods[0].multi_starts, 0);
  EXPECT_EQ(suite.methods[1].name, "SQP");
  EXPECT_EQ(suite.methods[1].multi_starts, 10);
  EXPECT_NE(suite.methods[0].Hash(), suite.methods[1].Hash());
}

TEST(Suite, DefaultsFillWhatIsNotSaid) {
  const Suite suite = ParseSuite(kSmall, "folder/small.yaml");
  EXPECT_EQ(suite.name, "small");
  EXPECT_FALSE(suite.dataset.has_value());
  EXPECT_EQ(suite.seed, 1);
  EXPECT_EQ(suite.repetitions, 1);
  EXPECT_FALSE(suite.tasks[0].problems.has_value());
  EXPECT_THAT(suite.initializations, ElementsAre(Initialization::kGood, Initialization::kInCollision));
  EXPECT_EQ(suite.methods[0].name, "SQP");
  EXPECT_EQ(suite.rule, Rule::kSolid);
  EXPECT_EQ(suite.methods[0].pairs, PairSelection::kAll);
}

TEST(Suite, AMethodsOwnPairsComeBeforeTheSuites) {
  constexpr char kText[] =
      "tasks: posture\npairs: reference\nmethods:\n  - {name: a, solver: sqp}\n"
      "  - {name: b, solver: best, options: {pairs: all}}\n";
  const Suite suite = ParseSuite(kText, "pairs.yaml");
  EXPECT_EQ(suite.methods[0].pairs, PairSelection::kReference);
  EXPECT_EQ(suite.methods[1].pairs, PairSelection::kAll);
}

TEST(Suite, AMethodsOwnToleranceComesBeforeTheSuites) {
  constexpr char kText[] =
      "tasks: posture\nconstraint_tolerance: 1e-4\nmethods:\n  - {name: a, solver: adam}\n"
      "  - {name: b, solver: best}\n  - {name: c, solver: best, options: {constraint_tolerance: 2e-4}}\n";
  const Suite suite = ParseSuite(kText, "tolerance.yaml");
  const auto tolerance = [&](std::size_t method) {
    return suite.methods[method].ToJson()["options"]["constraint_tolerance"].get<double>();
  };
  EXPECT_EQ(tolerance(0), 1e-4);
  EXPECT_EQ(tolerance(1), 1e-4);
  EXPECT_EQ(tolerance(2), 2e-4);
  EXPECT_THAT(FaultOf(std::string(kSmall) + "constraint_tolerance: 0.01\n"), HasSubstr("constraint_tolerance"));
  EXPECT_THAT(FaultOf("tasks: posture\nconstraint_tolerance: 1e-4\nmethods: [{solver: nothing}]\n"),
              HasSubstr("nothing"));
}

TEST(Suite, WrongWordsForRuleAndPairsAreNamed) {
  EXPECT_THAT(FaultOf(std::string(kSmall) + "rule: lenient\n"), HasSubstr("rule"));
  EXPECT_THAT(FaultOf(std::string(kSmall) + "rule: lenient\n"), HasSubstr("solid"));
  EXPECT_THAT(FaultOf(std::string(kSmall) + "pairs: some\n"), HasSubstr("reference"));
}

TEST(Suite, CollisionMakesOneMethodPerValue) {
  const Suite own = ParseSuite(
      "tasks: posture\nmethods:\n  - {solver: sqp, multi_starts: [0, 10], collision: [solid, surface]}\n", "s.yaml");
  ASSERT_EQ(own.methods.size(), 4U);
  EXPECT_EQ(own.methods[0].collision, SceneRepresentation::kSolid);
  EXPECT_EQ(own.methods[3].collision, SceneRepresentation::kSurface);
  EXPECT_EQ(own.methods[3].multi_starts, 10);
  EXPECT_NE(own.methods[0].Hash(), own.methods[2].Hash());

  const std::string methods = "tasks: posture\nmethods:\n  - {solver: sqp}\n  - {name: B, solver: sqp}\n";
  Suite shared = ParseSuite(methods + "collision: [surface, solid]\n", "s.yaml");
  ASSERT_EQ(shared.methods.size(), 4U) << "all methods once with each";
  EXPECT_EQ(shared.methods[1].name, "B");
  EXPECT_EQ(shared.methods[1].collision, SceneRepresentation::kSurface);
  EXPECT_EQ(shared.methods[2].name, "SQP");
  EXPECT_EQ(shared.methods[2].collision, SceneRepresentation::kSolid);
  SuiteFilter filter;
  filter.collision = {"solid"};
  ApplyFilter(filter, &shared);
  EXPECT_EQ(shared.methods.size(), 2U);
}

TEST(Suite, ANullRowIsTheFirstMethodUnderAnotherName) {
  Suite suite = ParseSuite(
      "tasks: posture\nmethods:\n  - {name: B, solver: sqp, multi_starts: 3}\n  - {solver: adam}\n", "s.yaml");
  AddNullRow(&suite);
  ASSERT_EQ(suite.methods.size(), 3U);
  EXPECT_EQ(suite.methods[2].name, "B (copy)");
  EXPECT_EQ(suite.methods[2].multi_starts, 3);
  EXPECT_EQ(suite.methods[2].Hash(), suite.methods[0].Hash());
  EXPECT_THROW(AddNullRow(&suite), InputError) << "the name is taken";
}

TEST(Suite, WallTimeMayDifferByTask) {
  const Suite suite = ParseSuite(std::string(kSmall) + "limits: {wall_time_s: {posture: 5, motion: 7.5}}\n", "s.yaml");
  EXPECT_EQ(suite.wall_time_s[Task::kPosture], 5);
  EXPECT_EQ(suite.wall_time_s[Task::kMotion], 7.5);
  const Suite effort = ParseSuite(std::string(kSmall) + "limits: {effort_limit: {motion: 12}}\n", "s.yaml");
  EXPECT_EQ(effort.effort_limit[Task::kMotion], 12);
  EXPECT_EQ(effort.effort_limit[Task::kPosture], Suite().effort_limit[Task::kPosture]) << "what is not told stays";
  const Suite defaults = ParseSuite(kSmall, "s.yaml");
  EXPECT_GT(defaults.wall_time_s[Task::kMotion], defaults.wall_time_s[Task::kPosture]);
}

TEST(Suite, TaskMayNameItsOwnProblems) {
  const Suite suite = ParseSuite(
      "tasks:\n  - {task: posture, problems: [2, 1]}\n  - motion\nproblems: 9\nmethods: [{solver: sqp}]\n", "s.yaml");
  EXPECT_THAT(*suite.tasks[0].problems, ElementsAre(1, 2));
  EXPECT_THAT(*suite.tasks[1].problems, ElementsAre(9));
}

TEST(Suite, AnEmptyDocumentAtTheEndIsNone) {
  EXPECT_EQ(ParseSuite("---\n" + std::string(kSmall) + "---\n", "s.yaml").methods.size(), 1U);
}

TEST(Suite, ProblemsThatNoTaskHasAreRefused) {
  const auto narrow = [](const std::vector<std::string>& problems) {
    Suite suite = ParseSuite(
        "tasks:\n  - {task: posture, problems: [0-4]}\n  - {task: motion, problems: [3-6]}\nmethods: [{solver: sqp}]\n",
        "s.yaml");
    SuiteFilter filter;
    filter.problems = problems;
    ApplyFilter(filter, &suite);
    return suite;
  };
  const Suite both = narrow({"3-4"});
  EXPECT_THAT(*both.tasks[1].problems, ElementsAre(3, 4));
  const auto fault = [&](const std::vector<std::string>& problems) {
    try {
      narrow(problems);
    } catch (const InputError& error) {
      return std::string(error.what());
    }
    return std::string("accepted");
  };
  EXPECT_THAT(*narrow({"3-9"}).tasks[1].problems, ElementsAre(3, 4, 5, 6)) << "a range names what there is of it";
  EXPECT_THAT(fault({"3", "7"}), AllOf(HasSubstr("--problems"), HasSubstr("none of the suite's tasks (got '7')")));
  EXPECT_THAT(fault({"3", "7-9"}), HasSubstr("none of the suite's tasks (got '7-9')"));
  EXPECT_THAT(fault({"0-2"}), HasSubstr("leaves no problem of the task motion"));
}

TEST(Suite, AbsoluteDatasetStays) {
  EXPECT_EQ(ParseSuite(std::string(kSmall) + "dataset: /srv/data\n", "a/b.yaml").dataset,
            std::filesystem::path("/srv/data"));
}

struct BadSuite {
  const char* name;
  std::string text;
  std::vector<std::string> message;  // all of these occur
};

class BadSuiteTest : public testing::TestWithParam<BadSuite> {};

TEST_P(BadSuiteTest, IsNamedWithPlaceAndFix) {
  const std::string fault = FaultOf(GetParam().text);
  for (const auto& part : GetParam().message) EXPECT_THAT(fault, HasSubstr(part));
}

const std::string kMethods = "methods:\n  - {solver: sqp}\n";

INSTANTIATE_TEST_SUITE_P(
    Faults, BadSuiteTest,
    testing::Values(
        BadSuite{"UnknownKey",
                 kSmall + std::string("problms: [1]\n"),
                 {"bad.yaml:4", "problms", "unknown key", "did you mean 'problems'?"}},
        BadSuite{"UnknownMethodKey",
                 "tasks: posture\nmethods:\n  - solver: sqp\n    multistarts: 3\n",
                 {"bad.yaml:4", "methods[0].multistarts", "unknown key", "multi_starts"}},
        BadSuite{"SecondDocument",
                 kSmall + std::string("---\nname: other\n"),
                 {"bad.yaml:5", "a second YAML document begins here", "'---'"}},
        BadSuite{"MergeKey",
                 "tasks: posture\nmethods:\n  - &m {solver: sqp}\n  - {<<: *m, name: B}\n",
                 {"bad.yaml:4", "merge keys (<<) are not supported; write the keys out"}},
        BadSuite{"KeyTwice", kSmall + std::string("seed: 1\nseed: 2\n"), {"bad.yaml:5", "'seed' is given twice"}},
        BadSuite{"BlankBehindAName",
                 "tasks: posture\nmethods:\n  - {name: 'SQP ', solver: sqp}\n",
                 {"bad.yaml:3", "methods[0].name", "begins or ends with a blank"}},
        BadSuite{"InvisibleCharacterInAName",
                 kSmall + std::string("name: \"a\\u202eb\"\n"),
                 {"bad.yaml:4", "name", "invisible character U+202E"}},
        BadSuite{"Latin1", kSmall + std::string("name: gr\xfcnd\n"), {"bad.yaml:4", "byte", "not UTF-8"}},
        // yaml-cpp would read endless empty documents here until memory is exhausted.
        BadSuite{"Comma", ",\n", {"bad.yaml:1", "is not valid YAML"}},
        BadSuite{"CommaInASecondDocument", kSmall + std::string("---\n,\n"), {"bad.yaml:5", "is not valid YAML"}},
        BadSuite{"EmptyName", kSmall + std::string("name: ''\n"), {"bad.yaml:4: name: is empty"}},
        BadSuite{"EmptyMethodName",
                 "tasks: posture\nmethods:\n  - {solver: sqp, name: \"\"}\n",
                 {"bad.yaml:3: methods[0].name: is empty"}},
        BadSuite{"NoName", kSmall + std::string("name:\n"), {"name: must be text (got 'nothing')"}},
        BadSuite{"WordForAWholeNumber",
                 "tasks: posture\nmethods:\n  - {solver: sqp, options: {max_iterations: big}}\n",
                 {"options.max_iterations: must be a whole number from 1 to 100000 (got 'big')"}},
        BadSuite{"FractionForAWholeNumber",
                 "tasks: posture\nmethods:\n  - {solver: sqp, options: {max_iterations: 2.5}}\n",
                 {"options.max_iterations: must be a whole number from 1 to 100000 (got '2.5')"}},
        BadSuite{"WordForANumber",
                 "tasks: posture\nmethods:\n  - {solver: sqp, options: {restart_noise_deg: much}}\n",
                 {"options.restart_noise_deg: must be a number from 0.0 to 180.0 (got 'much')"}},
        BadSuite{"UnknownLimit",
                 kSmall + std::string("limits: {wall_time: 3}\n"),
                 {"bad.yaml:4", "limits.wall_time", "wall_time_s"}},
        BadSuite{"UnknownOption",
                 "tasks: posture\nmethods:\n  - {solver: sqp, options: {trust_box: 0.1}}\n",
                 {"bad.yaml:3", "trust_box"}},
        BadSuite{"UnknownSolver", "tasks: posture\nmethods:\n  - {solver: spq}\n", {"bad.yaml:3", "spq", "sqp"}},
        BadSuite{
            "UnknownTask", "tasks: [walking]\n" + kMethods, {"bad.yaml:1", "tasks[0]", "walking", "posture, motion"}},
        BadSuite{"UnknownInitialization",
                 kSmall + std::string("initializations: [god]\n"),
                 {"bad.yaml:4", "initializations[0]", "did you mean 'good'?"}},
        BadSuite{"WrongType",
                 kSmall + std::string("repetitions: many\n"),
                 {"bad.yaml:4", "repetitions", "whole number", "many"}},
        BadSuite{"QuotedNumber", kSmall + std::string("seed: \"1\"\n"), {"bad.yaml:4", "seed", "whole number"}},
        BadSuite{"Split", kSmall + std::string("split: half\n"), {"split", "'all', 'tuning' or 'test'", "half"}},
        BadSuite{"Builds", kSmall + std::string("builds: all\n"), {"builds", "'one' or 'any'", "all"}},
        BadSuite{"Fraction", kSmall + std::string("max_attempts: 1.5\n"), {"max_attempts", "1.5"}},
        BadSuite{"OutOfRange", kSmall + std::string("limits: {memory_mb: 1}\n"), {"limits.memory_mb", "from 64"}},
        BadSuite{"NoEffort", kSmall + std::string("limits: {effort_limit: 0}\n"), {"limits.effort_limit", "from 1"}},
        BadSuite{
            "PartOfAnEffort", kSmall + std::string("limits: {effort_limit: 1.5}\n"), {"limits.effort_limit", "1.5"}},
        BadSuite{"NegativeTime", kSmall + std::string("limits: {wall_time_s: -1}\n"), {"limits.wall_time_s", "-1"}},
        BadSuite{
            "NotANumberTime", kSmall + std::string("limits: {wall_time_s: .nan}\n"), {"limits.wall_time_s", ".nan"}},
        BadSuite{"ListForScalar", kSmall + std::string("seed: [1, 2]\n"), {"bad.yaml:4", "seed", "a list"}},
        BadSuite{"EmptyTasks", "tasks: []\n" + kMethods, {"bad.yaml:1", "tasks", "must not be empty"}},
        BadSuite{"EmptyMethods", "tasks: posture\nmethods: []\n", {"bad.yaml:2", "methods", "must not be empty"}},
        BadSuite{"EmptyProblems", kSmall + std::string("problems: []\n"), {"problems", "must not be empty"}},
        BadSuite{"EmptyMultiStarts",
                 "tasks: posture\nmethods:\n  - {solver: sqp, multi_starts: []}\n",
                 {"methods[0].multi_starts", "must not be empty"}},
        BadSuite{"UnknownCollision",
                 kSmall + std::string("collision: [solid, surfaces]\n"),
                 {"bad.yaml:4", "collision[1]", "did you mean 'surface'?"}},
        BadSuite{"CollisionTwice",
                 "tasks: posture\ncollision: solid\nmethods:\n  - {solver: sqp, collision: solid}\n",
                 {"bad.yaml:4", "methods[0].collision", "more than once"}},
        BadSuite{"UnknownTaskLimit",
                 kSmall + std::string("limits: {wall_time_s: {motions: 3}}\n"),
                 {"limits.wall_time_s.motions", "did you mean 'motion'?"}},
        BadSuite{"MaxStances", kSmall + std::string("max_stances: 1\n"), {"max_stances", "from 2"}},
        BadSuite{"MissingTasks", kMethods, {"tasks", "is missing"}},
        BadSuite{"MissingMethods", "tasks: posture\n", {"methods", "is missing"}},
        BadSuite{"MissingSolver",
                 "tasks: posture\nmethods:\n  - {name: A}\n",
                 {"bad.yaml:3", "methods[0].solver", "is missing"}},
        BadSuite{"DuplicateMethodName",
                 "tasks: posture\nmethods:\n  - {name: A, solver: sqp}\n  - {name: A, solver: sqp}\n",
                 {"bad.yaml:4", "methods[1].name", "'A'", "name of its own"}},
        BadSuite{"DuplicateKey", "seed: 1\nseed: 2\n" + std::string(kSmall), {"bad.yaml:2", "seed", "twice"}},
        BadSuite{"DuplicateTask", "tasks: [posture, posture]\n" + kMethods, {"tasks[1]", "occurs twice"}},
        BadSuite{"BadRange", kSmall + std::string("problems: [5-3]\n"), {"bad.yaml:4", "problems", "5-3", "range"}},
        BadSuite{"NegativeProblem", kSmall + std::string("problems: [-3]\n"), {"problems", "-3"}},
        BadSuite{"BrokenYaml", "tasks: [posture\nmethods: {\n", {"bad.yaml:", "not valid YAML"}},
        BadSuite{"NotAMapping", "- posture\n", {"bad.yaml:1", "must be a mapping"}},
        BadSuite{"Empty", "", {"bad.yaml", "must be a mapping"}}),
    [](const auto& param_info) { return param_info.param.name; });

TEST(Suite, MissingFileIsNamed) {
  try {
    ReadSuite("/nowhere/quick.yaml");
    FAIL();
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), AllOf(HasSubstr("/nowhere/quick.yaml"), HasSubstr("cannot be read")));
  }
}

TEST(SuiteFilter, KeepsWhatIsNamed) {
  Suite suite = ParseSuite(kComplete, "table.yaml");
  SuiteFilter filter;
  filter.methods = {"sqp"};
  filter.tasks = {"motion"};
  filter.problems = {"4-9"};
  filter.seed = 11;
  ApplyFilter(filter, &suite);
  EXPECT_EQ(suite.methods.size(), 2U);
  ASSERT_EQ(suite.tasks.size(), 1U);
  EXPECT_EQ(suite.tasks[0].task, Task::kMotion);
  EXPECT_THAT(*suite.tasks[0].problems, ElementsAre(4, 5));
  EXPECT_EQ(suite.seed, 11);
}

TEST(SuiteFilter, NamesOfSolversOfOthersNeedNoMark) {
  const auto kept = [](const std::string& wanted) {
    Suite suite;
    for (const char* name : {"SQP", "slsqp (external)", "both", "both (external)"}) {
      suite.methods.emplace_back();
      suite.methods.back().name = name;
    }
    SuiteFilter filter;
    filter.methods = {wanted};
    ApplyFilter(filter, &suite);
    std::vector<std::string> names;
    for (const Method& method : suite.methods) names.push_back(method.name);
    return names;
  };
  EXPECT_THAT(kept("SLSQP"), ElementsAre("slsqp (external)"));
  EXPECT_THAT(kept("slsqp (external)"), ElementsAre("slsqp (external)"));
  EXPECT_THAT(kept("both"), ElementsAre("both")) << "a name that fits as it stands comes first";
  EXPECT_THROW(kept("slsq"), InputError);
}

TEST(SuiteFilter, RefusesWhatTheSuiteDoesNotHave) {
  const auto fault = [](const SuiteFilter& filter) -> std::string {
    Suite suite = ParseSuite(kComplete, "table.yaml");
    try {
      ApplyFilter(filter, &suite);
    } catch (const InputError& error) {
      return error.what();
    }
    return "no error";
  };
  EXPECT_THAT(fault({.methods = {"SQQ"},
                     .tasks = {},
                     .problems = {},
                     .initializations = {},
                     .seed = {},
                     .max_stances = {},
                     .collision = {}}),
              AllOf(HasSubstr("--methods"), HasSubstr("did you mean 'SQP'?")));
  EXPECT_THAT(fault({.methods = {},
                     .tasks = {},
                     .problems = {},
                     .initializations = {"in_collision"},
                     .seed = {},
                     .max_stances = {},
                     .collision = {}}),
              AllOf(HasSubstr("--initializations"), HasSubstr("good")));
  EXPECT_THAT(fault({.methods = {},
                     .tasks = {},
                     .problems = {"17"},
                     .initializations = {},
                     .seed = {},
                     .max_stances = {},
                     .collision = {}}),
              HasSubstr("leaves no problem"));
  EXPECT_THAT(fault({.methods = {},
                     .tasks = {},
                     .problems = {"x"},
                     .initializations = {},
                     .seed = {},
                     .max_stances = {},
                     .collision = {}}),
              AllOf(HasSubstr("--problems"), HasSubstr("'x'")));
}

}  // namespace
}  // namespace legopt::client
