// `legopt export --motion`: motions in time as CSV, JSON and contact sequences, of solution files and experiments.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>
#include <nlohmann/json.hpp>
#include <sstream>

#include "command_line_fixture.h"
#include "legopt/types/number_text.h"
#include "planted_experiment.h"

namespace legopt::client {
namespace {

using testing::AllOf;
using testing::HasSubstr;

/// Columns of a CSV file by name.
using Columns = std::map<std::string, std::vector<double>>;

class MotionExport : public CommandLine {
 protected:
  MotionExport() : file_(PlantedMotionsOf({0, 1, 10})) {}

  std::string FilePath() {
    const std::string path = (folder_.path() / "motions.json").string();
    WriteSolutions(path, file_);
    return path;
  }
  ProgramResult Export(const std::string& format, const std::vector<std::string>& more) {
    std::vector<std::string> arguments = {"export",   "--file", FilePath(), "--dataset", PlantedFolder(),
                                          "--motion", format,   "--out",    "-"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return Run(arguments);
  }
  std::string TextOf(const std::string& format, const std::vector<std::string>& more = {"--problem", "0"}) {
    const ProgramResult result = Export(format, more);
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return result.out;
  }
  static Columns ColumnsOf(const std::string& csv) {
    std::istringstream lines(csv);
    std::string line, cell;
    std::vector<std::string> names;
    Columns columns;
    while (std::getline(lines, line)) {
      std::istringstream cells(line);
      for (size_t i = 0; std::getline(cells, cell, ','); ++i) {
        if (names.size() <= i && columns.empty()) {
          names.push_back(cell);
        } else {
          columns[names.at(i)].push_back(ParseNumber(cell).value());
        }
      }
      if (columns.empty()) {
        for (const std::string& name : names) columns[name];
      }
    }
    return columns;
  }

  SolutionFile file_;
};

TEST_F(MotionExport, CsvHasARowPerSampleUpToTheShortestDuration) {
  const Columns columns = ColumnsOf(TextOf("csv", {"--problem", "0", "--rate", "50"}));
  const std::string durations =
      Run({"evaluate", FilePath(), "--dataset", PlantedFolder(), "--durations", "motions", "--format", "json"}).out;
  const std::vector<double>& times = columns.at("time_s");
  EXPECT_EQ(times.back(), nlohmann::json::parse(durations)[0]["duration_s"].get<double>());
  EXPECT_EQ(times[1], 0.02);
  EXPECT_EQ(times.size(), static_cast<size_t>(times.back() / 0.02) + 2);
  EXPECT_EQ(columns.at("waypoint").back(), static_cast<double>(file_.problems[0].definition.stances.size()) * 2 - 1);
  EXPECT_EQ(columns.at("velocity_lf_knee").front(), 0.0);
  EXPECT_EQ(columns.at("velocity_lf_knee").back(), 0.0);
  for (size_t k = 0; k < times.size(); ++k) {
    EXPECT_LE(std::abs(columns.at("torque_lf_knee")[k]), 60.0 * 1.05);
    EXPECT_GE(columns.at("force_lf_foot_z")[k], 0.0);
  }
}

TEST_F(MotionExport, JsonHasTheSameNumbersWithNamesAndLimits) {
  const nlohmann::json motion = nlohmann::json::parse(TextOf("json"));
  const Columns columns = ColumnsOf(TextOf("csv"));
  EXPECT_EQ(motion["kind"], "motion");
  EXPECT_EQ(motion["problem"], 0);
  EXPECT_EQ(motion["joints"].size(), 12u);
  EXPECT_EQ(motion["effort_limits"][0], 60.0);
  EXPECT_EQ(motion["samples"].back()["time_s"], motion["duration_s"]);
  ASSERT_EQ(motion["samples"].size(), columns.at("time_s").size());
  for (size_t k = 0; k < motion["samples"].size(); ++k) {
    const nlohmann::json& sample = motion["samples"][k];
    for (size_t j = 0; j < motion["joints"].size(); ++j) {
      const std::string joint = motion["joints"][j];
      EXPECT_EQ(sample["positions"][j], columns.at("position_" + joint)[k]);
      EXPECT_EQ(sample["torques"][j], columns.at("torque_" + joint)[k]);
    }
    for (const auto& [contact, points] : sample["contacts"].items()) {
      double sum_N = 0.0;
      for (const nlohmann::json& point : points) sum_N += point["force_N"][2].get<double>();
      EXPECT_NEAR(sum_N, columns.at("force_" + contact + "_z")[k], 1e-9);
    }
  }
}

TEST_F(MotionExport, ContactSequenceCoversTheMotionWithTheFramesOfTheStances) {
  const nlohmann::json sequence = nlohmann::json::parse(TextOf("contacts"));
  double time_s = 0.0;
  const Stance& first = file_.problems[0].definition.stances.front();
  ASSERT_GT(sequence["phases"].size(), 2u);
  EXPECT_EQ(sequence["phases"][0]["contacts"].size(), first.contacts.size());
  for (const nlohmann::json& phase : sequence["phases"]) {
    EXPECT_EQ(phase["begin_s"], time_s);
    time_s = phase["end_s"];
    for (const nlohmann::json& contact : phase["contacts"]) {
      EXPECT_EQ(contact["kind"], "point");
      EXPECT_GT(contact["friction"].get<double>(), 0.0);
      EXPECT_EQ(contact["points_m"].size(), 1u);
    }
  }
  EXPECT_EQ(time_s, sequence["duration_s"].get<double>());
  for (size_t i = 0; i < first.contacts.size(); ++i) {
    const nlohmann::json& contact = sequence["phases"][0]["contacts"][i];
    EXPECT_EQ(contact["contact"], first.contacts[i].contact);
    EXPECT_EQ(contact["position_m"][2], first.contacts[i].position.z());
  }
}

TEST_F(MotionExport, MotionsOfAnExperimentAreThoseOfItsSolutions) {
  const auto dataset = Dataset::Load(PlantedFolder());
  const std::string database = (folder_.path() / "planted.sqlite").string();
  WriteTestDatabase(database, PlantedExperiment(*dataset, PlantedMotionsOf({0})));
  const ProgramResult result =
      Run({"export", "--db", database, "--dataset", PlantedFolder(), "--motion", "csv", "--out", "motion.csv"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  std::ifstream stream(folder_.path() / "motion.csv");
  const std::string text((std::istreambuf_iterator<char>(stream)), {});
  EXPECT_EQ(text, TextOf("csv"));
}

TEST_F(MotionExport, SeveralMotionsAreRefusedWithTheOptionsThatChoose) {
  ExpectError(Export("csv", {}), 2, "3 motions that match");
  EXPECT_THAT(Export("csv", {}).err, HasSubstr("choose one with --problem, --tasks, --methods or --initializations"));
  ExpectError(Export("csv", {"--problem", "7"}), 2, "no motion of problem 7 that matches");
}

TEST_F(MotionExport, AMotionThatCannotBeExecutedNamesThePlaceAndTheLimit) {
  const ProgramResult result = Export("csv", {"--problem", "10"});
  EXPECT_EQ(result.exit_code, 4);
  EXPECT_EQ(result.out, "");
  EXPECT_THAT(result.err, AllOf(HasSubstr("balanced problem 10 by LegOpt-best"), HasSubstr("blocked at waypoint 1.00"),
                                HasSubstr("friction of lh_foot")));
}

TEST_F(MotionExport, AMotionAtRestAndABrokenOneAreNamed) {
  for (Eigen::VectorXd& x : file_.problems[0].solutions[0].waypoints) {
    const double time = x[x.size() - 1];
    x = file_.problems[0].solutions[0].waypoints[0];
    x[x.size() - 1] = time;
  }
  file_.problems[1].solutions[0].waypoints.pop_back();
  EXPECT_THAT(Export("csv", {"--problem", "0"}).err, HasSubstr("it is at rest"));
  EXPECT_EQ(Export("csv", {"--problem", "1"}).exit_code, 4);
}

TEST_F(MotionExport, OptionsOfMotionsNeedAMotion) {
  ExpectError(Run({"export", "--problem", "1", "--out", "-"}), 2, "--problem requires --motion");
  ExpectError(Export("csv", {"1"}), 2, "name only one of them");
  EXPECT_EQ(Export("csv", {"--rate", "0"}).exit_code, 2);
  EXPECT_EQ(Export("bvh", {}).exit_code, 2);
}

}  // namespace
}  // namespace legopt::client
