// Policy: plots show the content of the tables: every method, every pair, and failures on the border. Texts fit their
// width, and image files are readable by other programs.
#include "client/plot/plot.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tinyxml2.h>

#include <cmath>
#include <set>
#include <sstream>

#include "client/client_error.h"
#include "client/figures/figures.h"
#include "client/plot/drawing.h"
#include "toy_experiment.h"

namespace legopt::client {
namespace {

using testing::HasSubstr;

constexpr std::size_t kNarrow = 44;

std::vector<std::string> Labels(const PlotAxis& axis, int most) {
  std::vector<std::string> labels;
  for (const PlotTick& tick : TicksOf(axis, most)) labels.push_back(tick.label);
  return labels;
}

TEST(PlotAxes, TicksAreRoundAndNoMoreThanAskedFor) {
  using testing::ElementsAre;
  EXPECT_THAT(Labels({"", false, 0, 100}, 6), ElementsAre("0", "20", "40", "60", "80", "100"));
  EXPECT_THAT(Labels({"", false, -0.1, 0.1}, 5), ElementsAre("-0.1", "-0.05", "0", "0.05", "0.1"));
  EXPECT_THAT(Labels({"", true, 1, 20}, 6), ElementsAre("1", "2", "5", "10", "20"));
  EXPECT_THAT(Labels({"", true, 0.01, 1000}, 6), ElementsAre("0.01", "0.1", "1", "10", "100", "1000"));
  EXPECT_THAT(Labels({"", true, 1e-6, 1e6}, 5), ElementsAre("1e-06", "0.001", "1", "1000", "1e+06"));
  EXPECT_THAT(Labels({"", true, 1.1, 1.4}, 4), ElementsAre("1.1", "1.2", "1.3", "1.4"));
}

TEST(PlotAxes, PlacesAreLogarithmicWhereTheAxisIsAndStayOnIt) {
  const PlotAxis axis{"", true, 1, 100};
  EXPECT_DOUBLE_EQ(PlaceOn(axis, 10), 0.5);
  EXPECT_DOUBLE_EQ(PlaceOn(axis, 0), 0.0);
  EXPECT_DOUBLE_EQ(PlaceOn(axis, 1e9), 1.0);
  EXPECT_DOUBLE_EQ(PlaceOn({"", false, 0, 4}, 1), 0.25);
}

class PlotOfDatabase : public testing::Test {
 protected:
  std::string Stored(const TestExperiment& experiment) {
    const std::string file = (folder_.path() / "toy.sqlite").string();
    WriteTestDatabase(file, experiment);
    return file;
  }
  Plot Profiles(const TestExperiment& experiment) {
    const auto source = OpenResults({Stored(experiment), {}});
    return ProfilePlot(ReadStatisticsTable(*source, {}));
  }
  Plot Scatter(const TestExperiment& experiment) {
    ComparisonRequest request;
    request.a = "A";
    request.b = "B";
    request.source = {Stored(experiment), {}};
    return ScatterPlot(ReadComparison(request), kMilliseconds);
  }

  TemporaryFolder folder_;
};

// Times 1 2 4 8 - of A, 2 1 - 4 16 of B, 4 4 2 - - of C: ratios 1 2 2 2 -, 2 1 - 1 1, 4 4 1 - -.
TEST_F(PlotOfDatabase, ProfilesOfTheToyPoolInLetters) {
  EXPECT_EQ(RenderPlotText(Profiles(ToyPool()), {kNarrow, false}), R"(Posture generation, good init: 5 problems
y: problems solved within it (%)
   100 |
       |
       |
    80 |                ababababababababa
       |
       |
    60 |bbbbbbbbbbbbbbbb                c
       |
       |
    40 |
       |
       |
    20 |acacacacacacacaccccccccccccccccc
       |
       |
     0 |
       ++---------------+----------------
        1               2
x: time over that of the best method
  a  A: best on 20 %, solves 80 %
  b  B: best on 60 %, solves 80 %
  c  C: best on 20 %, solves 60 %

Performance profiles of experiment 1 'test',
dataset tiny, solid rule, seed 1, one run
per problem. Build 0123456789ab (build) on
processor, 2 processors, 1 GiB, load 0.5.
)");
}

TEST_F(PlotOfDatabase, ScatterHasThePairsOfTheComparisonAndFailuresOnTheRim) {
  const Plot plot = Scatter(Discordant(12, 2, 1, 4));
  ASSERT_EQ(plot.panels.size(), 1u);
  int only_a = 0, only_b = 0;
  for (const PlotPoint& point : plot.panels[0].series[0].points) {
    only_a += std::isinf(point.y) ? 1 : 0;
    only_b += std::isinf(point.x) ? 1 : 0;
    EXPECT_FALSE(std::isinf(point.x) && std::isinf(point.y));
  }
  EXPECT_EQ(plot.panels[0].series[0].points.size(), 15u);
  EXPECT_EQ(only_a, 2);
  EXPECT_EQ(only_b, 1);
  const std::string text = RenderPlotText(plot, {kNarrow, false});
  EXPECT_THAT(text, HasSubstr("#"));  // twelve points in one place
  EXPECT_THAT(text, testing::ContainsRegex("failed \\| +2 +\\|"));
  EXPECT_THAT(text, testing::ContainsRegex("\\|o\n"));
  EXPECT_THAT(text, HasSubstr("both 12, only A 2, only B 1,"));
}

TEST_F(PlotOfDatabase, NoLineIsWiderThanAskedFor) {
  TestExperiment experiment = ToyPool();
  experiment.methods[0].name = "a method whose name is longer than the line that is left for all of it";
  const Plot plot = Profiles(experiment);
  for (const std::size_t width : {kNarrow, std::size_t{80}}) {
    std::istringstream lines(RenderPlotText(plot, {width, false}));
    for (std::string line; std::getline(lines, line);) EXPECT_LE(DisplayWidth(line), width) << line;
  }
}

TEST_F(PlotOfDatabase, WithoutAnyCommonProblemAxesStandEmptyAndSayWhy) {
  TestExperiment experiment = ToyPool();
  for (TestResult& result : experiment.results) result.finished = result.method == result.problem;
  EXPECT_THAT(RenderPlotText(Profiles(experiment)), HasSubstr("No problem has been completed by every method."));
}

TEST_F(PlotOfDatabase, AMethodThatHasNotBegunIsNamedAndHasNoCurve) {
  TestExperiment experiment = ToyPool();
  for (TestResult& result : experiment.results) result.finished = result.method != 1;
  const std::string text = RenderPlotText(Profiles(experiment));
  EXPECT_THAT(text, HasSubstr("Left out, without a completed problem: B."));
  EXPECT_THAT(text, testing::AllOf(HasSubstr("a  A: best"), HasSubstr("C: best"), testing::Not(HasSubstr("B: best"))));
}

// Returns the colours of the curves.
std::set<std::string> CurveColors(const tinyxml2::XMLElement* element) {
  std::set<std::string> colors;
  for (; element != nullptr; element = element->NextSiblingElement()) {
    colors.merge(CurveColors(element->FirstChildElement()));
    if (std::string(element->Name()) == "polyline") colors.insert(element->Attribute("stroke"));
  }
  return colors;
}

TEST_F(PlotOfDatabase, AnSvgParsesAloneAndHasACurveOfEachMethod) {
  const std::string bytes = RenderFigure(Profiles(ToyPool()), PlotFormat::kSvg);
  tinyxml2::XMLDocument document;
  ASSERT_EQ(document.Parse(bytes.data(), bytes.size()), tinyxml2::XML_SUCCESS) << document.ErrorStr();
  const tinyxml2::XMLElement* root = document.RootElement();
  EXPECT_STREQ(root->Name(), "svg");
  EXPECT_STREQ(root->Attribute("xmlns"), "http://www.w3.org/2000/svg");
  EXPECT_STREQ(root->Attribute("width"), "360pt") << "one panel";
  EXPECT_EQ(CurveColors(root).size(), 3u);
}

// Returns the texts of a figure, separated by newlines.
std::string TextsOf(const tinyxml2::XMLElement* element) {
  std::string texts;
  for (; element != nullptr; element = element->NextSiblingElement()) {
    if (std::string(element->Name()) == "text") texts += element->GetText() + std::string("\n");
    texts += TextsOf(element->FirstChildElement());
  }
  return texts;
}

TEST_F(PlotOfDatabase, AnSvgHasAxesLegendAndCaptionAsText) {
  const Plot plot = Scatter(Discordant(3, 1, 1, 0));
  tinyxml2::XMLDocument document;
  ASSERT_EQ(document.Parse(RenderFigure(plot, PlotFormat::kSvg).c_str()), tinyxml2::XML_SUCCESS) << document.ErrorStr();
  const std::string texts = TextsOf(document.RootElement());
  EXPECT_THAT(texts, HasSubstr(plot.panels[0].x.title));
  EXPECT_THAT(texts, HasSubstr(plot.panels[0].y.title));
  EXPECT_THAT(texts, HasSubstr("failed\n"));
  for (const PlotTick& tick : TicksOf(plot.panels[0].x, 7)) EXPECT_THAT(texts, HasSubstr(tick.label + "\n"));
  EXPECT_THAT(texts, HasSubstr(plot.caption.substr(0, plot.caption.find(' '))));
}

TEST(PlotSvg, NamesAreEscaped) {
  Plot plot;
  plot.entries = {"<b>&\"x\"", "bell\a", "broken\xff"};
  tinyxml2::XMLDocument document;
  ASSERT_EQ(document.Parse(RenderFigure(plot, PlotFormat::kSvg).c_str()), tinyxml2::XML_SUCCESS) << document.ErrorStr();
  EXPECT_EQ(TextsOf(document.RootElement()), "<b>&\"x\"\nbell\\x07\nbroken\\xff\n");
}

TEST(PlotSvg, MorePanelsThanAPageHoldsAreRefused) {
  Plot plot;
  plot.panels.resize(kMaxPanels + 1);
  try {
    RenderFigure(plot, PlotFormat::kSvg);
    FAIL() << "was drawn";
  } catch (const ClientError& error) {
    EXPECT_EQ(error.code(), ExitCode::kUsage);
    EXPECT_THAT(error.what(), HasSubstr("--method"));
  }
}

}  // namespace
}  // namespace legopt::client
