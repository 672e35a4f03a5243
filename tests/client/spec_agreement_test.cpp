// Policy: the server accepts everything that a suite may request. Each limit is tested at its end, which both accept,
// and one step beyond, which the suite refuses with file, line and key.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "client/suite/experiment_spec.h"
#include "client/suite/suite.h"
#include "legopt/types/input_error.h"
#include "server/spec.h"

namespace legopt::client {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::StartsWith;

const DatasetFacts kLongDataset = {"tiny", std::string(64, 'a'), {{{{{0, 1}, {1'000'000, 1}}, {}}}}};

std::string Yaml(const std::string& keys, const std::string& method = "solver: sqp") {
  return "tasks: posture\nproblems: [0]\n" + keys + "\nmethods: [{" + method + "}]\n";
}

server::ExperimentSpec Accepted(const std::string& yaml) {
  return server::ParseSpec(BuildSpec(ParseSuite(yaml, "s.yaml"), kLongDataset).dump());
}

std::string Refusal(const std::string& yaml) {
  try {
    ParseSuite(yaml, "s.yaml");
  } catch (const InputError& error) {
    return error.what();
  }
  return "accepted";
}

TEST(SpecAgreement, EachLimitPassesBoth) {
  EXPECT_EQ(Accepted(Yaml("name: " + std::string(200, 'n'))).name.size(), 200U);
  EXPECT_EQ(Accepted(Yaml("", "solver: sqp, name: " + std::string(200, 'n'))).methods[0].name.size(), 200U);
  EXPECT_EQ(Accepted(Yaml("limits: {wall_time_s: 604800}")).tasks[0].wall_limit_us, 604'800'000'000);
  EXPECT_EQ(Accepted(Yaml("limits: {wall_time_s: 0.001}")).tasks[0].wall_limit_us, 1000);
  EXPECT_EQ(Accepted(Yaml("limits: {effort_limit: 1}")).tasks[0].effort_limit, 1);
  EXPECT_EQ(Accepted(Yaml("limits: {effort_limit: 1000000000000}")).tasks[0].effort_limit, 1'000'000'000'000);
  EXPECT_EQ(Accepted(Yaml("limits: {memory_mb: 64}")).memory_limit_bytes, 64 << 20);
  EXPECT_EQ(Accepted(Yaml("limits: {memory_mb: 1048576}")).memory_limit_bytes, std::int64_t{1} << 40);
  EXPECT_EQ(Accepted(Yaml("", "solver: sqp, multi_starts: 1000000")).methods[0].multi_starts, 1'000'000);
  EXPECT_EQ(Accepted(Yaml("repetitions: 100000")).repetitions, 100'000);
  EXPECT_EQ(Accepted(Yaml("max_attempts: 100")).max_attempts, 100);
  EXPECT_EQ(Accepted(Yaml("seed: 9223372036854775807")).seed, INT64_MAX);
  EXPECT_EQ(Accepted("tasks: posture\nproblems: [1000000]\nmethods: [{solver: sqp}]\n").tasks[0].problems[0],
            1'000'000);
}

TEST(SpecAgreement, OneStepBeyondTheSuiteSaysSo) {
  EXPECT_THAT(
      Refusal(Yaml("name: " + std::string(201, 'n'))),
      AllOf(StartsWith("s.yaml:3: name: is 201 bytes long, at most 200 are possible (got 'nnn"), HasSubstr("...'")));
  EXPECT_THAT(Refusal(Yaml("", "solver: sqp, name: " + std::string(5000, 'n'))),
              StartsWith("s.yaml:4: methods[0].name: is 5000 bytes long"));
  EXPECT_THAT(Refusal(Yaml("limits: {wall_time_s: 604801}")),
              HasSubstr("limits.wall_time_s: must be a number from 0.001 to 604800"));
  EXPECT_THAT(Refusal(Yaml("limits: {effort_limit: 1000000000001}")), HasSubstr("from 1 to 1000000000000"));
  EXPECT_THAT(Refusal(Yaml("limits: {memory_mb: 63}")), HasSubstr("from 64 to 1048576 (got '63')"));
  EXPECT_THAT(Refusal(Yaml("", "solver: sqp, multi_starts: 1000001")), HasSubstr("from 0 to 1000000"));
  EXPECT_THAT(Refusal(Yaml("repetitions: 100001")), HasSubstr("from 1 to 100000"));
  EXPECT_THAT(Refusal(Yaml("max_attempts: 101")), HasSubstr("from 1 to 100"));
  EXPECT_THAT(Refusal("tasks: posture\nproblems: [1000001]\nmethods: [{solver: sqp}]\n"), HasSubstr("1000001"));
  EXPECT_THAT(Refusal(Yaml("name: \"a\\0b\"")), HasSubstr("holds the character NUL"));
  EXPECT_THAT(Refusal(Yaml(
                  "", "solver: sqp, multi_starts: [" +
                          [] {
                            std::string list = "0";
                            for (int i = 1; i <= 1000; ++i) list += "," + std::to_string(i);
                            return list;
                          }() +
                          "]")),
              HasSubstr("more than 1000"));
}

}  // namespace
}  // namespace legopt::client
