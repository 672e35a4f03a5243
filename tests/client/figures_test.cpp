// Policy: `legopt plot` shows the figures of the stored solves, whose values are computed here by hand. Files of every
// format are whole, have the requested size, and equal figures have equal bytes. What cannot be drawn is refused.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <iterator>

#include "client/client_error.h"
#include "client/figures/convergence_figure.h"
#include "client/figures/solve_figures.h"
#include "client/plot/drawing.h"
#include "client/plot/plot_points.h"
#include "command_line_fixture.h"
#include "legopt/planning/internal/trace.h"
#include "toy_experiment.h"

namespace legopt::client {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;

std::vector<double> Xs(const PlotSeries& series) {
  std::vector<double> values;
  for (const PlotPoint& point : series.points) values.push_back(point.x);
  return values;
}

std::vector<double> Ys(const PlotSeries& series) {
  std::vector<double> values;
  for (const PlotPoint& point : series.points) values.push_back(point.y);
  return values;
}

class Figures : public CommandLine {
 protected:
  FigureData Read(const TestExperiment& experiment, const TableSelection& selection = {}) {
    source_.reset();
    std::filesystem::remove(file_);
    WriteTestDatabase(file_, experiment);
    source_ = OpenResults({file_, {}});
    return ReadFigureData(*source_, selection);
  }
  std::string Bytes(const std::string& name) const {
    std::ifstream stream(folder_.path() / name, std::ios::binary);
    return {std::istreambuf_iterator<char>(stream), {}};
  }

  std::string file_ = (folder_.path() / "toy.sqlite").string();
  std::unique_ptr<ResultSource> source_;
};

// Times 1 2 4 8 - of A, 2 1 - 4 16 of B, 4 4 2 - - of C, in ms.
TEST_F(Figures, DistributionsAndCactusHaveTheSortedTimes) {
  const FigureData data = Read(ToyPool());
  const PlotPanel ecdf = EcdfPlot(data, Measure::kTime).panels.at(0);
  EXPECT_THAT(Xs(ecdf.series.at(0)), ElementsAre(1, 2, 4, 8));
  EXPECT_THAT(Ys(ecdf.series.at(0)), ElementsAre(20, 40, 60, 80));
  EXPECT_THAT(Xs(ecdf.series.at(2)), ElementsAre(2, 4));
  EXPECT_THAT(Ys(ecdf.series.at(2)), ElementsAre(20, 60));
  EXPECT_EQ(ecdf.x.from, 1.0);
  EXPECT_EQ(ecdf.x.to, 100.0);
  const PlotPanel cactus = CactusPlot(data, Measure::kTime).panels.at(0);
  EXPECT_THAT(Xs(cactus.series.at(1)), ElementsAre(1, 2, 3, 4));
  EXPECT_THAT(Ys(cactus.series.at(1)), ElementsAre(1, 2, 4, 16));
}

TEST_F(Figures, ByToleranceAStricterJudgeAcceptsFewer) {
  TestExperiment experiment;
  experiment.methods = {{"A"}, {"B"}};
  for (const double value : {1e-4, 5e-4, 0.0}) {
    const Violation feet{Verdict::kFootPose, Rule::kLiteral, 0, "l_foot", value};
    experiment.results.push_back({.problem = static_cast<int>(experiment.results.size()), .violations = {feet}});
  }
  experiment.results.push_back({.problem = 3, .verdict = "com"});
  const PlotPanel panel = EcdfPlot(Read(experiment), Measure::kTolerance).panels.at(0);
  EXPECT_TRUE(panel.x.logarithmic);
  EXPECT_THAT(Xs(panel.series.at(0)), ElementsAre(kLeastTolerance, 1e-4, 5e-4));
  EXPECT_THAT(Ys(panel.series.at(0)), ElementsAre(25, 50, 75));
  experiment.results.push_back({.method = 1, .problem = 0});
  try {
    EcdfPlot(Read(experiment), Measure::kTolerance);
    FAIL() << "the violations of B are not known";
  } catch (const ClientError& error) {
    EXPECT_THAT(error.what(), HasSubstr("the violations of the solutions of B were not stored"));
  }
}

TEST_F(Figures, WithRepetitionsEveryProblemHasTheSameWeight) {
  TestExperiment experiment;
  experiment.methods = {{"A"}};
  // Problem 0: solved in 1 ms and failed; problem 1: solved in 2 and 3 ms.
  experiment.results = {{.problem = 0, .wall_us = 1000, .repetition = 0},
                        {.problem = 0, .verdict = "foot_pose", .wall_us = 9000, .repetition = 1},
                        {.problem = 1, .wall_us = 2000, .repetition = 0},
                        {.problem = 1, .wall_us = 3000, .repetition = 1}};
  const PlotPanel ecdf = EcdfPlot(Read(experiment), Measure::kTime).panels.at(0);
  EXPECT_THAT(Xs(ecdf.series.at(0)), ElementsAre(1, 2, 3));
  EXPECT_THAT(Ys(ecdf.series.at(0)), ElementsAre(25, 50, 75));
}

TEST_F(Figures, BoxesHaveQuantilesAndFailuresAreInfinite) {
  const PlotPanel panel = BoxPlot(Read(ToyPool()), Measure::kTime).panels.at(0);
  const PlotBox& box = panel.series.at(0).box.value();
  EXPECT_DOUBLE_EQ(box.whiskers.low, 1.2);  // type 7 of Hyndman and Fan: 1 + 0.2 (2 - 1)
  EXPECT_EQ(box.quartiles.low, 2.0);
  EXPECT_EQ(box.median, 4.0);
  EXPECT_EQ(box.quartiles.high, 8.0);
  EXPECT_TRUE(std::isinf(box.whiskers.high));
  EXPECT_TRUE(panel.y.rim);
}

TEST_F(Figures, AScatterHasTheProblemsThatEitherSolved) {
  TableSelection selection;
  selection.rows = {"1-2"};
  const Plot plot = ScatterPlot(Read(ToyPool(), selection), Measure::kTime);
  EXPECT_THAT(Xs(plot.panels.at(0).series.at(0)), ElementsAre(1, 2, 4, 8, INFINITY));
  EXPECT_THAT(Ys(plot.panels.at(0).series.at(0)), ElementsAre(2, 1, INFINITY, 4, 16));
  EXPECT_THROW(ScatterPlot(Read(ToyPool()), Measure::kTime), ClientError) << "three methods";
}

// B takes half of A's time everywhere; C takes A's, 10 % more or less in turns.
TEST_F(Figures, RanksJoinMethodsThatDoNotDiffer) {
  TestExperiment experiment;
  experiment.methods = {{"A"}, {"B"}, {"C"}};
  std::vector<std::optional<double>> a, b, c;
  for (int i = 0; i < 20; ++i) {
    a.emplace_back(10.0 + i);
    b.emplace_back(5.0 + i / 2.0);
    c.emplace_back((10.0 + i) * (i % 2 == 0 ? 1.1 : 0.9));
  }
  AddTimes(0, a, &experiment);
  AddTimes(1, b, &experiment);
  AddTimes(2, c, &experiment);
  const PlotPanel panel = RankPlot(Read(experiment), Measure::kTime).panels.at(0);
  ASSERT_EQ(panel.series.size(), 3U);
  EXPECT_EQ(panel.series[0].entry, 1U) << "the best rank first";
  EXPECT_EQ(panel.series[0].points[0].x, 1.0);
  ASSERT_EQ(panel.groups.size(), 1U);
  EXPECT_EQ(panel.groups[0].low, 2.5);
  EXPECT_EQ(panel.groups[0].high, 2.5);
}

// B fails on every other problem, on which A is slower than B elsewhere.
TEST_F(Figures, AFailureIsTheLargestDifference) {
  TestExperiment experiment;
  experiment.methods = {{"A"}, {"B"}};
  std::vector<std::optional<double>> a, b;
  for (int i = 0; i < 20; ++i) {
    a.emplace_back(1000.0);
    b.push_back(i % 4 == 0 ? std::optional(1.0) : std::nullopt);
  }
  AddTimes(0, a, &experiment);
  AddTimes(1, b, &experiment);
  const PlotPanel panel = RankPlot(Read(experiment), Measure::kTime).panels.at(0);
  EXPECT_EQ(panel.series[0].entry, 0U);
  EXPECT_TRUE(panel.groups.empty()) << "15 losses outweigh 5 wins";
}

// A solves problem 0 in one of two runs, fast; B in both, slowly.
TEST_F(Figures, RanksPutAFailedRunLastAsTablesDo) {
  TestExperiment experiment;
  experiment.methods = {{"A"}, {"B"}};
  experiment.results = {{.method = 0, .problem = 0, .wall_us = 1000, .repetition = 0},
                        {.method = 0, .problem = 0, .verdict = "foot_pose", .wall_us = 1000, .repetition = 1},
                        {.method = 1, .problem = 0, .wall_us = 9000, .repetition = 0},
                        {.method = 1, .problem = 0, .wall_us = 190'000, .repetition = 1}};
  const FigureData data = Read(experiment);
  EXPECT_EQ(RankPlot(data, Measure::kTime).panels.at(0).series.at(0).entry, 1U);
  EXPECT_EQ(EcdfPlot(data, Measure::kTime).panels.at(0).x.to, 1000.0) << "the axis has every run";
}

TEST_F(Figures, WorkThatWasNotCountedIsRefused) {
  const FigureData data = Read(ToyPool());
  try {
    EcdfPlot(data, Measure::kWork);
    FAIL() << "was drawn";
  } catch (const ClientError& error) {
    EXPECT_THAT(error.what(), HasSubstr("give --measure time"));
  }
}

std::vector<std::uint8_t> TraceOf(const std::vector<std::array<double, 3>>& steps) {
  std::vector<IterationRecord> records;
  for (const auto& [evaluations, cost, violation] : steps) {
    IterationRecord& record = records.emplace_back();
    record.step = static_cast<int>(records.size()) - 1;
    record.evaluations = static_cast<std::int64_t>(evaluations);
    record.cost = cost;
    record.violation = violation;
  }
  return EncodeTrace(records);
}

TEST_F(Figures, ConvergenceIsTheBestFeasibleCostOverTheBestKnown) {
  TestExperiment experiment;
  experiment.methods = {{"A"}, {"B"}};
  experiment.results = {{.method = 0,
                         .trace = TraceOf({{1, 1.0, 0.5},
                                           {10, 8.0, 1e-4},
                                           {100, 9.0, 0.0},
                                           {500, std::nan(""), 0.0},
                                           {600, 1.0, std::nan("")},
                                           {1000, 4.0, 1e-3}})},
                        {.method = 1, .trace = TraceOf({{10, 2.0, 0.0}})}};
  const FigureData data = Read(experiment);
  const PlotPanel panel = ConvergencePlot(*source_, data).panels.at(0);
  const PlotSeries& a = panel.series.at(0);
  EXPECT_NEAR(a.points.front().x, 10.0, 0.6) << "the first point that satisfies the constraints";
  EXPECT_EQ(a.points.front().y, 4.0);
  EXPECT_EQ(a.points.back().x, 1000.0);
  EXPECT_EQ(a.points.back().y, 2.0);
  EXPECT_EQ(panel.series.at(1).points.back().y, 1.0);
}

TEST_F(Figures, FilesHaveTheSizeAndEqualBytes) {
  const Plot plot = EcdfPlot(Read(ToyPool()), Measure::kTime);
  const FigureStyle style{.width = 244.8, .height = 216.0, .font_size = 8.0};
  const std::string pdf = RenderFigure(plot, PlotFormat::kPdf, style);
  EXPECT_THAT(pdf, AllOf(StartsWith("%PDF-"), HasSubstr("[ 0 0 244.8 216 ]"), HasSubstr("%%EOF")));
  EXPECT_THAT(pdf, Not(HasSubstr("CreationDate")));
  EXPECT_EQ(pdf, RenderFigure(plot, PlotFormat::kPdf, style));
  EXPECT_THAT(RenderFigure(plot, PlotFormat::kSvg, style), HasSubstr("width=\"244.8pt\" height=\"216.00pt\""));
  const std::string pgf = RenderFigure(plot, PlotFormat::kPgf, style);
  EXPECT_THAT(pgf, AllOf(HasSubstr("\\useasboundingbox (0,0) rectangle (244.80,216.00);"),
                         HasSubstr("{problems solved (\\%)};"), testing::EndsWith("\\end{tikzpicture}\n")));
  EXPECT_THROW(RenderFigure(plot, PlotFormat::kSvg, {.width = 244.8, .height = 72.0, .font_size = 8.0}), ClientError);
  EXPECT_THROW(RenderFigure(plot, PlotFormat::kSvg, {.width = 72.0, .height = {}, .font_size = 8.0}), ClientError);
}

TEST_F(Figures, EveryKindIsDrawnInEveryFormat) {
  Read(ToyPool());
  for (const std::string kind : {"profile", "ecdf", "cactus", "box", "scatter", "cd", "convergence"}) {
    for (const std::string ending : {"svg", "pdf", "pgf", "csv"}) {
      const std::vector<std::string> words = {"plot",   kind,  "--db",  file_,
                                              "--rows", "1,2", "--out", kind + "." + ending};
      const auto result = Run(words);
      EXPECT_EQ(result.exit_code, 0) << result.err;
      EXPECT_FALSE(Bytes(kind + "." + ending).empty());
    }
  }
  EXPECT_THAT(Bytes("ecdf.csv"), StartsWith("panel,curve,x,y,low,high,quartile_low,quartile_high\n"));
  EXPECT_THAT(Bytes("box.csv"), HasSubstr(",A,1.0,4.0,1.2,,2.0,8.0\n")) << "an infinite whisker is empty";
}

TEST_F(Figures, WhatCannotBeDrawnIsRefused) {
  Read(ToyPool());
  const auto refuse = [&](std::vector<std::string> words, const std::string& why) {
    words.insert(words.begin(), "plot");
    words.insert(words.end(), {"--db", file_});
    ExpectError(Run(words), 2, why);
  };
  refuse({"pie"}, "KIND");
  refuse({"ecdf", "--size", "3.4x"}, "write WIDTH or WIDTHxHEIGHT in inches");
  refuse({"ecdf", "--size", "0.2"}, "write WIDTH or WIDTHxHEIGHT in inches");
  refuse({"ecdf", "--out", "figure.png"}, "unknown file extension; name it .svg, .pdf, .pgf or .csv");
  refuse({"profile", "--measure", "cost"}, "leave --measure away");
  refuse({"convergence", "--measure", "time"}, "leave --measure away");
  refuse({"scatter", "--measure", "time"}, "a scatter plot shows two methods, not 3");
  refuse({"cd", "--measure", "time", "--rows", "1"}, "ranks compare at least two methods");
  refuse({"ecdf", "--measure", "time", "--columns", "2"}, "2");
  refuse({"ecdf", "--measure", "time", "--size", "3.4x1"}, "the figure is too low");
}

}  // namespace
}  // namespace legopt::client
