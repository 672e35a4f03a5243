// Policy: the program reproduces published worked examples. Incomparable methods are refused with the reason,
// reservations are printed with the comparison, and the exit code depends on the verdict only on request.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "command_line_fixture.h"
#include "toy_experiment.h"

namespace legopt::client {
namespace {

using testing::AllOf;
using testing::HasSubstr;

constexpr int kWorse = static_cast<int>(app::ExitCode::kWorse);
constexpr int kOtherDataset = static_cast<int>(app::ExitCode::kDatasetMismatch);

class CompareCommand : public CommandLine {
 protected:
  std::string Stored(const TestExperiment& experiment, const std::string& name = "toy.sqlite") {
    const auto file = folder_.path() / name;
    WriteTestDatabase(file, experiment);
    return file.string();
  }

  // Returns the first comparison of A and B.
  nlohmann::json Compared(const std::string& file) {
    const auto result = Run({"compare", "A", "B", "--db", file, "--format", "json"});
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return nlohmann::json::parse(result.out).at("comparisons").at(0);
  }
};

TEST_F(CompareCommand, McNemarAsFagerlandHasIt) {
  const auto first = Compared(Stored(Discordant(60, 1, 7, 5)));
  EXPECT_DOUBLE_EQ(first.at("success").at("mcnemar_mid_p"), 0.0390625);
  EXPECT_DOUBLE_EQ(first.at("success").at("mcnemar_exact_p"), 0.0703125);
  EXPECT_EQ(first.at("only_b"), 7);
  EXPECT_EQ(first.at("neither"), 5);
  EXPECT_EQ(first.at("change"), "better");
  const auto second = Compared(Stored(Discordant(20, 6, 16, 0), "second.sqlite"));
  EXPECT_NEAR(second.at("success").at("mcnemar_mid_p"), 0.034690, 5e-7);
  const auto even = Compared(Stored(Discordant(0, 5, 5, 0), "even.sqlite"));
  EXPECT_NEAR(even.at("success").at("mcnemar_mid_p"), 0.876953, 5e-7);
  EXPECT_EQ(even.at("change"), "none");
}

TEST_F(CompareCommand, WilcoxonAsHollanderAndWolfeAndDarwinHaveIt) {
  TestExperiment depression;
  depression.methods = {{"A"}, {"B"}};
  AddCosts(0, {1.83, 0.50, 1.62, 2.48, 1.68, 1.88, 1.55, 3.06, 1.30}, &depression);
  AddCosts(1, {0.878, 0.647, 0.598, 2.05, 1.06, 1.29, 1.06, 3.14, 1.29}, &depression);
  const auto cost = Compared(Stored(depression)).at("cost");
  EXPECT_EQ(cost.at("wilcoxon_negative_sum"), 40.0);  // differences are B - A
  EXPECT_DOUBLE_EQ(cost.at("wilcoxon_p"), 0.0390625);
  TestExperiment maize;
  maize.methods = {{"A"}, {"B"}};
  std::vector<double> crossed;
  for (const double eighths : {6, 8, 14, 16, 23, 24, 28, 29, 41, -48, 49, 56, 60, -67, 75}) {
    crossed.push_back(100.0 + eighths);
  }
  AddCosts(0, std::vector<double>(15, 100.0), &maize);
  AddCosts(1, crossed, &maize);
  const auto second = Compared(Stored(maize, "maize.sqlite")).at("cost");
  EXPECT_EQ(second.at("wilcoxon_negative_sum"), 24.0);
  EXPECT_DOUBLE_EQ(second.at("wilcoxon_p"), 0.041259765625);
}

TEST_F(CompareCommand, FailingDoesNotPay) {
  const auto result = Run({"compare", "A", "C", "--db", Stored(ToyPool()), "--format", "json"});
  const auto cell = nlohmann::json::parse(result.out).at("comparisons").at(0);
  EXPECT_DOUBLE_EQ(cell.at("par10_a_ms"), 203.0);
  EXPECT_DOUBLE_EQ(cell.at("par10_b_ms"), 402.0);
  EXPECT_EQ(cell.at("both"), 3);
  EXPECT_EQ(cell.at("fastest").at(0).at("problem"), 2);
  EXPECT_DOUBLE_EQ(cell.at("fastest").at(0).at("time_ratio"), 0.5);
  EXPECT_EQ(cell.at("slowest").at(0).at("problem"), 0);
  EXPECT_EQ(cell.at("runtimes"), "a");
}

TEST_F(CompareCommand, ARatioThatIsEverywhereTheSameHasNoSpread) {
  TestExperiment experiment;
  experiment.methods = {{"A"}, {"B"}};
  AddTimes(0, {2, 4, 6, 8, 10, 12, 14, 16}, &experiment);
  AddTimes(1, {1, 2, 3, 4, 5, 6, 7, 8}, &experiment);
  const auto cell = Compared(Stored(experiment));
  EXPECT_NEAR(cell.at("time").at("ratio"), 0.5, 1e-12);
  EXPECT_NEAR(cell.at("time").at("interval").at(0), 0.5, 1e-12);
  EXPECT_NEAR(cell.at("time").at("interval").at(1), 0.5, 1e-12);
  EXPECT_NEAR(cell.at("time").at("hodges_lehmann"), 0.5, 1e-12);
  EXPECT_NEAR(cell.at("time").at("hodges_lehmann_interval").at(1), 0.5, 1e-12);
  EXPECT_EQ(cell.at("time").at("change"), "better");
  EXPECT_EQ(cell.at("cost").at("equal"), 8);
  EXPECT_EQ(cell.at("cost").at("change"), "none");
  EXPECT_EQ(cell.at("runtimes"), "b");
}

// The median of the Walsh averages of 0 .. 5 doublings. With six problems the confidence interval is the full range.
TEST_F(CompareCommand, HodgesAndLehmannAreShownWithWilcoxon) {
  TestExperiment experiment;
  experiment.methods = {{"A"}, {"B"}};
  AddTimes(0, {1, 1, 1, 1, 1, 1}, &experiment);
  AddTimes(1, {1, 2, 4, 8, 16, 32}, &experiment);
  const std::string file = Stored(experiment);
  const auto time = Compared(file).at("time");
  EXPECT_NEAR(time.at("hodges_lehmann"), std::exp2(2.5), 1e-9);
  EXPECT_NEAR(time.at("hodges_lehmann_interval").at(0), 1.0, 1e-12);
  EXPECT_NEAR(time.at("hodges_lehmann_interval").at(1), 32.0, 1e-9);
  EXPECT_DOUBLE_EQ(time.at("hodges_lehmann_coverage"), 1.0 - 2.0 / 64);
  EXPECT_THAT(Run({"compare", "A", "B", "--db", file}).out, HasSubstr("Hodges-Lehmann 5.66 [1, 32]"));
  const auto few = Compared(Stored(Discordant(4, 0, 0, 0), "few.sqlite")).at("time");
  EXPECT_TRUE(few.at("hodges_lehmann_interval").at(1).is_null()) << "four problems bound nothing";
  EXPECT_TRUE(Compared(Stored(Discordant(0, 2, 2, 0), "none.sqlite")).at("time").at("hodges_lehmann").is_null());
}

TEST_F(CompareCommand, AFailureIsChargedWhatIsSaid) {
  TestExperiment experiment = ToyPool();
  experiment.effort_limit = 1000;
  const std::string file = Stored(experiment);
  const auto cell = Compared(file);
  EXPECT_DOUBLE_EQ(cell.at("charge_ms"), 10'000.0);
  EXPECT_EQ(cell.at("charge_rule"), "per_waypoint");
  EXPECT_DOUBLE_EQ(cell.at("par10_a_ms"), 2003.0);
  EXPECT_THAT(Run({"compare", "A", "B", "--db", file}).out,
              HasSubstr("a failure costs 10000 ms for each waypoint of the problem"));
  const auto chosen = Run({"compare", "A", "B", "--db", file, "--charge", "0.05", "--format", "json"});
  EXPECT_DOUBLE_EQ(nlohmann::json::parse(chosen.out).at("comparisons")[0].at("par10_a_ms"), 13.0);
  ExpectError(Run({"compare", "A", "B", "--db", file, "--charge", "0"}), 2, "--charge");
  ExpectError(Run({"table", "--db", file, "--charge", "1"}), 2, "--charge sets the cost of a failed run");
  const auto table = Run({"table", "--db", file, "--statistics", "--charge", "0.05", "--format", "json"});
  EXPECT_DOUBLE_EQ(nlohmann::json::parse(table.out).at("rows")[0].at("par10_ms"), 13.0);
  EXPECT_THAT(Run({"table", "--db", file, "--profile", "--format", "csv"}).out, HasSubstr(",problems,ratio,share"));
}

// One method under two names, the second at a time of higher load.
TEST_F(CompareCommand, EqualWorkIsNoDifferenceWhateverTheTimes) {
  TestExperiment experiment;
  experiment.methods = {{"A"}, {"B"}};
  for (int problem = 0; problem < 30; ++problem) {
    const std::int64_t work_ns = 1'000'000 * (1 + problem);
    experiment.results.push_back({.method = 0, .problem = problem, .wall_us = work_ns / 1000, .work_ns = work_ns});
    experiment.results.push_back(
        {.method = 1, .problem = problem, .wall_us = work_ns / 1000 * 13 / 10, .work_ns = work_ns});
  }
  const auto same = Compared(Stored(experiment));
  EXPECT_EQ(same.at("change"), "none");
  EXPECT_NEAR(same.at("time").at("ratio"), 1.3, 1e-9);
  EXPECT_EQ(same.at("work").at("ratio"), 1.0);
  for (TestResult& result : experiment.results) result.work_ns = result.work_ns * (result.method == 1 ? 11 : 10);
  const std::string file = Stored(experiment, "more.sqlite");
  EXPECT_EQ(Compared(file).at("change"), "worse");
  EXPECT_THAT(Run({"compare", "A", "B", "--db", file}).out, HasSubstr("B is worse (more work)"));
  experiment.results.back().work_ns = 0;
  const std::string partly = Stored(experiment, "partly.sqlite");
  EXPECT_THAT(Run({"compare", "A", "B", "--db", partly}).out,
              AllOf(HasSubstr("B is worse (slower)"), HasSubstr("- (not counted)")));
}

// C is a copy of A whose solves were slower by 1.1 to 1.3; B was slower than A by 1.05 to 1.25. No work was counted.
TEST_F(CompareCommand, TimesOfTheSameWorkGiveTheLeastMargin) {
  TestExperiment experiment;
  experiment.methods = {{"A"}, {"B"}};
  for (int problem = 0; problem < 30; ++problem) {
    const std::int64_t wall_us = 10'000 * (1 + problem), percent = problem % 5 * 5;
    experiment.results.push_back({.method = 0, .problem = problem, .wall_us = wall_us});
    experiment.results.push_back({.method = 1, .problem = problem, .wall_us = wall_us * (105 + percent) / 100});
  }
  const auto alone = Compared(Stored(experiment, "alone.sqlite"));
  EXPECT_EQ(alone.at("time").at("change"), "worse");
  EXPECT_EQ(alone.at("time_margin"), 0.0);
  experiment.methods.push_back({.name = "C", .copy_of = 0});
  for (int problem = 0; problem < 30; ++problem) {
    const std::int64_t wall_us = 10'000 * (1 + problem), percent = problem % 5 * 5;
    experiment.results.push_back({.method = 2, .problem = problem, .wall_us = wall_us * (110 + percent) / 100});
  }
  const std::string file = Stored(experiment);
  const auto result = Run({"compare", "A", "B", "--db", file, "--format", "json"});
  const auto json = nlohmann::json::parse(result.out);
  ASSERT_EQ(json.at("identical_work").size(), 1U);
  const auto& same = json.at("identical_work").at(0);
  EXPECT_EQ(same.at("copy").at("name"), "C");
  EXPECT_NEAR(same.at("time_ratio"), 1.198, 1e-3);  // geometric mean of 1.1, 1.15, ..., 1.3
  EXPECT_DOUBLE_EQ(same.at("margin"), same.at("interval").at(1).get<double>() - 1.0);
  const auto& cell = json.at("comparisons").at(0);
  EXPECT_EQ(cell.at("time_margin"), same.at("margin"));
  EXPECT_EQ(cell.at("time").at("change"), "none");
  EXPECT_THAT(Run({"compare", "A", "B", "--db", file}).out,
              HasSubstr("The same work differs: C takes 1.2 [1.17, 1.22] of the time of A, "));
  EXPECT_THAT(Run({"compare", "A", "C", "--db", file}).out, HasSubstr("no difference shown"));
}

// B solves each problem in half of A's time, C in twice as much, D in the same.
TEST_F(CompareCommand, AControlIsComparedWithEveryOtherMethodInOneFamily) {
  TestExperiment experiment;
  experiment.methods = {{"A"}, {"B"}, {"C"}, {"D"}};
  std::vector<std::optional<double>> a, b, c;
  for (int i = 0; i < 12; ++i) {
    a.emplace_back(10.0 + i);
    b.emplace_back(5.0 + i / 2.0);
    c.emplace_back(20.0 + 2 * i);
  }
  AddTimes(0, a, &experiment);
  AddTimes(1, b, &experiment);
  AddTimes(2, c, &experiment);
  AddTimes(3, a, &experiment);
  const std::string file = Stored(experiment);
  const auto result = Run({"compare", "--control", "A", "--db", file, "--format", "json"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const auto cells = nlohmann::json::parse(result.out).at("comparisons");
  ASSERT_EQ(cells.size(), 3U);
  EXPECT_EQ(cells.at(0).at("method_b").at("name"), "B");
  EXPECT_EQ(cells.at(0).at("change"), "better");
  EXPECT_EQ(cells.at(1).at("change"), "worse");
  EXPECT_EQ(cells.at(2).at("change"), "none");
  // Holm over the three: the smallest p is tripled.
  EXPECT_DOUBLE_EQ(cells.at(0).at("time").at("adjusted_p"), 3 * cells.at(0).at("time").at("wilcoxon_p").get<double>());
  EXPECT_THAT(Run({"compare", "--control", "A", "--db", file}).out,
              AllOf(HasSubstr("B: each other method of experiment 1"), HasSubstr("C, 0 multi-starts")));
  const auto one = Run({"compare", "--control", "A", "--methods", "C", "--db", file, "--format", "json"});
  EXPECT_EQ(nlohmann::json::parse(one.out).at("comparisons").size(), 1U);
  ExpectError(Run({"compare", "--control", "A", "--methods", "A", "--db", file}), 2, "no other method");
  ExpectError(Run({"compare", "--control", "A", "B", "--db", file}), 2, "give one or the other");
  ExpectError(Run({"compare", "A", "--db", file}), 2, "give A and B, or --control METHOD");
  ExpectError(Run({"compare", "--control", "X", "--db", file}), 2, "X");
}

TEST_F(CompareCommand, CopiesThatReusedOneResultSayNothing) {
  TestExperiment experiment;
  experiment.methods = {{"A"}, {"B"}, {.name = "C", .copy_of = 0}};
  AddTimes(0, {1, 2, 3}, &experiment);
  AddTimes(1, {2, 3, 4}, &experiment);
  AddTimes(2, {1, 2, 3}, &experiment);
  const auto result = Run({"compare", "A", "B", "--db", Stored(experiment), "--format", "json"});
  EXPECT_TRUE(nlohmann::json::parse(result.out).at("identical_work").empty());
}

TEST_F(CompareCommand, WithRepetitionsShareDifferencesAreTested) {
  TestExperiment experiment;
  experiment.methods = {{"A"}, {"B"}};
  // B solves one of ten more on seven problems, and loses one problem altogether: seven of eight signs are its.
  for (int problem = 0; problem < 8; ++problem) {
    for (int repetition = 0; repetition < 10; ++repetition) {
      const int of_a = problem == 7 ? 10 : 5, of_b = problem == 7 ? 0 : 6;
      for (const auto& [method, solved] : {std::pair(0, of_a), std::pair(1, of_b)}) {
        experiment.results.push_back({.method = method,
                                      .problem = problem,
                                      .verdict = repetition < solved ? "success" : "com",
                                      .repetition = repetition});
      }
    }
  }
  const std::string file = Stored(experiment);
  const auto success = Compared(file).at("success");
  // |7 - 10| = 3, and no signs give a smaller sum.
  EXPECT_DOUBLE_EQ(success.at("permutation_p"), 1.0);
  EXPECT_NEAR(success.at("mcnemar_mid_p"), 0.0390625, 1e-12) << "a sign test would see a difference";
  EXPECT_THAT(Run({"compare", "A", "B", "--db", file}).out, HasSubstr("permutation p 1"));
}

TEST_F(CompareCommand, FamilyIsWhatIsShown) {
  TestExperiment experiment = Discordant(20, 0, 6, 0);
  const std::size_t half = experiment.results.size();
  for (std::size_t i = 0; i < half; ++i) {
    experiment.results.push_back(experiment.results[i]);
    experiment.results.back().initialization = "in_collision";
  }
  const std::string file = Stored(experiment);
  const auto both = Compared(file);
  EXPECT_DOUBLE_EQ(both.at("success").at("mcnemar_mid_p"), 0.015625);
  EXPECT_DOUBLE_EQ(both.at("success").at("adjusted_p"), 0.03125);
  const auto one = Run({"compare", "A", "B", "--db", file, "--initialization", "good", "--format", "json"});
  const auto json = nlohmann::json::parse(one.out);
  ASSERT_EQ(json.at("comparisons").size(), 1U);
  EXPECT_DOUBLE_EQ(json.at("comparisons")[0].at("success").at("adjusted_p"), 0.015625);
  EXPECT_EQ(json.at("least_discordant"), 5);
  // Two intervals hold together: each has the level 97.5 %. One has 95 %.
  const auto two = nlohmann::json::parse(Run({"compare", "A", "B", "--db", file, "--format", "json"}).out);
  EXPECT_DOUBLE_EQ(two.at("interval_level"), 0.975);
  EXPECT_DOUBLE_EQ(json.at("interval_level"), 0.95);
  const auto wide = both.at("success").at("interval"), narrow = json.at("comparisons")[0].at("success").at("interval");
  EXPECT_LT(wide.at(0).get<double>(), narrow.at(0).get<double>());
  EXPECT_GT(wide.at(1).get<double>(), narrow.at(1).get<double>());
  EXPECT_THAT(Run({"compare", "A", "B", "--db", file}).out,
              HasSubstr("Each kind of interval contains all 2 values with a nominal probability of 95 % (Bonferroni)"));
}

TEST_F(CompareCommand, AFamilyMayBeThatOfADocument) {
  TestExperiment experiment = Discordant(20, 0, 6, 0);
  const std::string file = Stored(experiment);
  const auto with_family = [&](const std::string& family) {
    return Run({"compare", "A", "B", "--db", file, "--family", family, "--format", "json"});
  };
  const auto three = nlohmann::json::parse(with_family("3").out);
  EXPECT_DOUBLE_EQ(three.at("comparisons")[0].at("success").at("adjusted_p"), 3 * 0.015625);
  EXPECT_EQ(three.at("comparisons")[0].at("success").at("change"), "better");
  EXPECT_EQ(three.at("family"), 3);
  EXPECT_DOUBLE_EQ(three.at("interval_level"), 1.0 - 0.05 / 3);
  const auto four = nlohmann::json::parse(with_family("4").out);
  EXPECT_DOUBLE_EQ(four.at("comparisons")[0].at("success").at("adjusted_p"), 4 * 0.015625);
  EXPECT_EQ(four.at("comparisons")[0].at("success").at("change"), "none");
  EXPECT_THAT(Run({"compare", "A", "B", "--db", file, "--family", "4"}).out,
              HasSubstr("adjusted by Holm over the 4 comparisons of the whole document"));
  ExpectError(with_family("0"), 2, "--family");
}

TEST_F(CompareCommand, AFamilyIsAtLeastWhatIsShown) {
  TestExperiment experiment = Discordant(20, 0, 6, 0);
  const std::size_t half = experiment.results.size();
  for (std::size_t i = 0; i < half; ++i) {
    experiment.results.push_back(experiment.results[i]);
    experiment.results.back().initialization = "in_collision";
  }
  const auto result = Run({"compare", "A", "B", "--db", Stored(experiment), "--family", "1", "--format", "json"});
  EXPECT_EQ(nlohmann::json::parse(result.out).at("family"), 2);
}

TEST_F(CompareCommand, TextSaysVerdictAndRule) {
  const std::string file = Stored(Discordant(20, 9, 0, 1));
  const auto text = Run({"compare", "A", "B", "--db", file});
  EXPECT_EQ(text.exit_code, 0) << "a comparison that was made";
  EXPECT_THAT(text.out, AllOf(HasSubstr("A: A of experiment 1 'test'"), HasSubstr("B is worse (solves fewer)"),
                              HasSubstr("30: both 20, only A 9, only B 0, neither 1"), HasSubstr("McNemar mid-p"),
                              HasSubstr("Rule: success decides"), HasSubstr("B is worse than A: of 1 comparisons")));
  EXPECT_EQ(Run({"compare", "A", "B", "--db", file, "--fail-if-worse"}).exit_code, kWorse);
  EXPECT_EQ(Run({"compare", "B", "A", "--db", file, "--fail-if-worse"}).exit_code, 0);
  EXPECT_THAT(Run({"compare", "A", "B", "--db", file, "--format", "markdown"}).out, HasSubstr("| success |"));
}

TEST_F(CompareCommand, AMarginIsWhatScriptsWant) {
  TestExperiment experiment;
  experiment.methods = {{"A"}, {"B"}};
  AddTimes(0, {10, 20, 30, 40, 50, 60, 70, 80}, &experiment);
  AddTimes(1, {10.2, 20.4, 30.6, 40.8, 51, 61.2, 71.4, 81.6}, &experiment);
  const std::string file = Stored(experiment);
  EXPECT_EQ(Run({"compare", "A", "B", "--db", file, "--fail-if-worse"}).exit_code, kWorse);
  EXPECT_EQ(Run({"compare", "A", "B", "--db", file, "--fail-if-worse", "--margin", "5"}).exit_code, 0);
}

TEST_F(CompareCommand, MethodsOfOneNameAreToldApart) {
  TestExperiment experiment;
  experiment.methods = {{"SQP", 0}, {"SQP", 10}, {"Adam", 0}};
  for (int method = 0; method < 3; ++method) AddTimes(method, {1, 2}, &experiment);
  const std::string file = Stored(experiment);
  ExpectError(Run({"compare", "SQP", "Adam", "--db", file}), 2,
              "'SQP' names 2 methods; say which: 'SQP:multi_starts=0', 'SQP:multi_starts=10'");
  EXPECT_EQ(Run({"compare", "sqp:multi_starts=10", "Adam", "--db", file}).exit_code, 0);
  ExpectError(Run({"compare", "SQP:multi_starts=7", "Adam", "--db", file}), 2, "there is 'SQP:multi_starts=0'");
  ExpectError(Run({"compare", "SQP:multistarts=0", "Adam", "--db", file}), 2, "did you mean 'multi_starts'");
  ExpectError(Run({"compare", "Adan", "Adam", "--db", file}), 2, "did you mean 'Adam'");
  ExpectError(Run({"compare", "Adam", "Adan", "--db", file}), 2, "has no method 'Adan'; did you mean 'Adam'");
  ExpectError(Run({"compare", "Adam", "adam", "--db", file}), 2, "A and B are the same, Adam of experiment 1");
}

TEST_F(CompareCommand, FilesAreComparedMethodByMethod) {
  TestExperiment before = ToyPool(), after = ToyPool();
  after.build_id = "ba9876543210";
  after.methods.push_back({"D"});
  AddTimes(3, {1, 1, 1, 1, 1}, &after);
  const std::string a = Stored(before, "before.sqlite"), b = Stored(after, "after.sqlite");
  const auto result = Run({"compare", a, b, "--format", "json"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const auto json = nlohmann::json::parse(result.out);
  EXPECT_EQ(json.at("comparisons").size(), 3U);
  EXPECT_EQ(json.at("change"), "none");
  EXPECT_THAT(json.at("notes").dump(), HasSubstr("Different builds: A 0123456789ab, B ba9876543210"));
  const auto one = Run({"compare", a, b, "--method", "C", "--format", "json"});
  EXPECT_EQ(nlohmann::json::parse(one.out).at("comparisons").size(), 1U);
  ExpectError(Run({"compare", a, a}), 2, "are the same");
  ExpectError(Run({"compare", a, "SQP"}), 2, "is a file, 'SQP' is none");
  ExpectError(Run({"compare", a, b, "--methods", "E"}), 2,
              "--methods E: experiment 1 has no such method; valid: A, B, C");
}

TEST_F(CompareCommand, ProblemsOfDifferentDatasetsAreNotPaired) {
  TestExperiment other = ToyPool();
  other.dataset_name = "another";
  other.dataset_hash = std::string(64, 'c');
  ExpectError(Run({"compare", Stored(ToyPool()), Stored(other, "other.sqlite")}), kOtherDataset,
              "their problems are not the same");
}

TEST_F(CompareCommand, NothingInCommonIsRefused) {
  TestExperiment experiment;
  experiment.methods = {{"A"}, {"B"}};
  experiment.results = {{.method = 0, .problem = 0}, {.method = 1, .problem = 1}};
  ExpectError(Run({"compare", "A", "B", "--db", Stored(experiment)}), 2, "no problem in common");
  ExpectError(Run({"compare", "1", "7", "--db", Stored(ToyPool(), "toy2.sqlite")}), 2, "no experiment 7");
  ExpectError(Run({"compare", "nothing", "1", "--db", Stored(ToyPool(), "toy3.sqlite")}), 2,
              "'nothing' is no database file, no experiment, and no method");
}

TEST_F(CompareCommand, ResultsWithoutAVerdictByTheRuleAreRefused) {
  const std::string file = Stored(ToyPool());
  EXPECT_EQ(Run({"compare", "A", "B", "--db", file, "--rule", "solid"}).exit_code, 0);
  AlterDatabase(file, "results_are_final",
                "UPDATE results SET verdict_solid = NULL WHERE job_id = 1; UPDATE cell_results SET unjudged_solid = 1");
  ExpectError(Run({"compare", "A", "B", "--db", file, "--rule", "solid"}), 2, "a release without the solid rule");
  ExpectError(Run({"table", "--statistics", "--db", file, "--rule", "solid"}), 2, "a release without the solid rule");
}

TEST_F(CompareCommand, WhatIsMissingIsCounted) {
  TestExperiment experiment;
  experiment.methods = {{"A"}, {"B"}};
  AddTimes(0, {1, 2, 3, 4}, &experiment);
  AddTimes(1, {1, 2, 3}, &experiment);
  experiment.results[1].finished = false;
  const std::string file = Stored(experiment);
  const auto cell = Compared(file);
  EXPECT_EQ(cell.at("pairs"), 2);
  EXPECT_EQ(cell.at("missing"), 1);
  EXPECT_EQ(cell.at("without_partner_a"), 1);
  EXPECT_THAT(Run({"compare", "A", "B", "--db", file}).out,
              AllOf(HasSubstr("1 pairs are missing"), HasSubstr("Problems without a partner: 1 of A, 0 of B")));
}

}  // namespace
}  // namespace legopt::client
