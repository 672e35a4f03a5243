#include "server/spec.h"

#include <gtest/gtest.h>

#include "legopt/input/json.h"
#include "server/experiment.h"
#include "tests/server/scheduler_fixture.h"

namespace legopt::server {
namespace {

using Json = nlohmann::json;

void ExpectRefused(const Json& json, const std::string& word) {
  try {
    ParseSpec(json.dump());
    ADD_FAILURE() << "accepted: " << json.dump();
  } catch (const SpecError& error) {
    EXPECT_NE(std::string(error.what()).find(word), std::string::npos) << error.what();
  }
}

TEST(Spec, SampleIsRead) {
  const ExperimentSpec spec = ParseSpec(SampleSpec(3).dump());
  EXPECT_EQ(spec.name, "sample");
  EXPECT_EQ(spec.seed, 7);
  EXPECT_EQ(spec.num_jobs(), 3);
  EXPECT_EQ(spec.tasks[0].wall_limit_us, 60'000'000);
  EXPECT_EQ(spec.memory_limit_bytes, std::int64_t{1} << 30);
  EXPECT_EQ(spec.methods[0].hash, HashOf('a'));
}

TEST(Spec, ASubmitterMayBeNamed) {
  Json spec = SampleSpec();
  EXPECT_EQ(ParseSpec(spec.dump()).submitter, "") << "older ones name none";
  const std::string hash = ParseSpec(spec.dump()).hash;
  spec["submitter"] = std::string(200, 'x');
  const ExperimentSpec named = ParseSpec(spec.dump());
  EXPECT_EQ(named.submitter.size(), 200U);
  EXPECT_NE(named.hash, hash);
  EXPECT_EQ(MakeNewExperiment(named, 1, 1, 1).submitter, named.submitter);
  for (const Json& bad : {Json(""), Json(std::string(201, 'x')), Json(7), Json()}) {
    spec["submitter"] = bad;
    ExpectRefused(spec, "submitter");
  }
}

TEST(Spec, ASplitHoldsAllItsProblems) {
  Json spec = SampleSpec();
  spec["tasks"][0]["problems"] = {1, 3};
  spec["tasks"][0]["waypoints"] = {1, 1};
  spec["split"] = "test";
  EXPECT_NO_THROW(ParseSpec(spec.dump()));
  spec["split"] = "tuning";
  ExpectRefused(spec, "split");
  spec["split"] = "half";
  ExpectRefused(spec, "split");
}

TEST(Spec, TheDatasetsJointsMayBeNamed) {
  Json spec = SampleSpec();
  EXPECT_TRUE(ParseSpec(spec.dump()).dataset.joint_names.empty());
  spec["dataset"]["joint_names"] = {"l_leg_kny", "r_leg_kny"};
  const ExperimentSpec named = ParseSpec(spec.dump());
  EXPECT_EQ(named.dataset.joint_names, (std::vector<std::string>{"l_leg_kny", "r_leg_kny"}));
  EXPECT_EQ(MakeNewExperiment(named, 1, 1, 1).dataset.joint_names, named.dataset.joint_names);
  for (const Json& bad :
       {Json::array(), Json({""}), Json({7}), Json("knee"), Json(std::vector<std::string>(1001, "x"))}) {
    spec["dataset"]["joint_names"] = bad;
    ExpectRefused(spec, "dataset.joint_names");
  }
}

TEST(Spec, HashIgnoresLayoutAndOrderOfKeys) {
  const std::string compact = SampleSpec().dump(), spacious = SampleSpec().dump(4);
  EXPECT_EQ(ParseSpec(compact).hash, ParseSpec(spacious).hash);
  EXPECT_NE(ParseSpec(compact).hash, ParseSpec(SampleSpec(5).dump()).hash);
}

TEST(Spec, CollisionIsReadFromTheOptions) {
  Json spec = SampleSpec();
  EXPECT_EQ(ParseSpec(spec.dump()).methods[0].collision, SceneRepresentation::kSolid);
  spec["methods"][0]["options"]["options"] = {{"collision", "surface"}};
  EXPECT_EQ(ParseSpec(spec.dump()).methods[0].collision, SceneRepresentation::kSurface);
  spec["methods"][0]["options"]["options"]["collision"] = "gas";
  ExpectRefused(spec, "methods[0].options.options.collision");
}

TEST(Spec, WallTimeMayDifferByTask) {
  Json spec = SampleSpec(1);
  spec["tasks"].push_back({{"task", "motion"}, {"problems", {0}}, {"waypoints", {30}}});
  EXPECT_EQ(ParseSpec(spec.dump()).tasks[1].wall_limit_us, 60'000'000);
  spec["limits"]["wall_time_s"] = {{"posture", 10}, {"motion", 900}};
  const ExperimentSpec parsed = ParseSpec(spec.dump());
  EXPECT_EQ(parsed.tasks[0].wall_limit_us, 10'000'000);
  EXPECT_EQ(parsed.tasks[1].wall_limit_us, 900'000'000);
  const db::NewExperiment rows = MakeNewExperiment(parsed, 1, 1, 1);
  EXPECT_EQ(rows.wall_limit_us, 900'000'000);
  EXPECT_EQ(rows.cells[0].wall_limit_us, 10'000'000);
  EXPECT_EQ(rows.cells[1].wall_limit_us, 900'000'000);
  spec["limits"]["wall_time_s"] = {{"posture", 10}};
  ExpectRefused(spec, "limits.wall_time_s.motion");
  spec["limits"]["wall_time_s"] = {{"posture", 10}, {"motion", 9}, {"dance", 1}};
  ExpectRefused(spec, "dance");
}

TEST(Spec, EffortMayBeLimitedAndDifferByTask) {
  Json spec = SampleSpec(1);
  spec["tasks"].push_back({{"task", "motion"}, {"problems", {0}}, {"waypoints", {30}}});
  EXPECT_EQ(ParseSpec(spec.dump()).tasks[1].effort_limit, 0) << "as in specifications of before";
  spec["limits"]["effort_limit"] = 12;
  EXPECT_EQ(ParseSpec(spec.dump()).tasks[1].effort_limit, 12);
  spec["limits"]["effort_limit"] = {{"posture", 5}, {"motion", 1'000'000'000'000}};
  const db::NewExperiment rows = MakeNewExperiment(ParseSpec(spec.dump()), 1, 1, 1);
  EXPECT_EQ(rows.cells[0].effort_limit, 5);
  EXPECT_EQ(rows.cells[1].effort_limit, 1'000'000'000'000);
  spec["limits"]["effort_limit"] = {{"posture", 5}};
  ExpectRefused(spec, "limits.effort_limit.motion");
  for (const Json& wrong : {Json(0), Json(-1), Json(1.5), Json("many"), Json(1'000'000'000'001)}) {
    spec["limits"]["effort_limit"] = wrong;
    ExpectRefused(spec, "limits.effort_limit");
  }
}

TEST(Spec, FaultsNameTheKey) {
  EXPECT_THROW(ParseSpec("{"), SpecError);
  EXPECT_THROW(ParseSpec("[]"), SpecError);
  std::string twice = Dump(SampleSpec());
  twice.insert(1, "\"name\": \"first\", ");
  EXPECT_THROW(ParseSpec(twice), SpecError) << "a key that is given twice";
  const auto with = [](const char* pointer, const Json& value) {
    Json spec = SampleSpec();
    spec[Json::json_pointer(pointer)] = value;
    return spec;
  };
  for (const char* key : {"name", "seed", "repetitions", "dataset", "tasks", "initializations", "methods", "limits"}) {
    Json spec = SampleSpec();
    spec.erase(key);
    ExpectRefused(spec, key);
  }
  ExpectRefused(with("/colour", "red"), "colour");
  ExpectRefused(with("/dataset/path", "x"), "dataset.path");
  ExpectRefused(with("/methods/0/extra", 1), "methods[0].extra");
  ExpectRefused(with("/spec_version", 2), "spec_version");
  ExpectRefused(with("/seed", -1), "seed");
  ExpectRefused(with("/seed", 18446744073709551615ULL), "seed");
  ExpectRefused(with("/seed", 1.5), "seed");
  ExpectRefused(with("/repetitions", 0), "repetitions");
  ExpectRefused(with("/name", ""), "name");
  ExpectRefused(with("/name", std::string(201, 'x')), "name");
  for (const char* alike : {"a ", "\u202ea", "e\u0301", "a\nb"}) {
    ExpectRefused(with("/name", alike), "name");
    ExpectRefused(with("/methods/0/name", alike), "methods[0].name");
    ExpectRefused(with("/dataset/name", alike), "dataset.name");
    ExpectRefused(with("/submitter", alike), "submitter");
  }
  ExpectRefused(with("/dataset/hash", "abc"), "dataset.hash");
  ExpectRefused(with("/tasks", Json::array()), "tasks");
  ExpectRefused(with("/tasks/0/task", "dance"), "tasks[0].task");
  ExpectRefused(with("/tasks/0/problems", {0, 1, 1, 2}), "twice");
  ExpectRefused(with("/tasks/0/waypoints", {1}), "waypoints");
  ExpectRefused(with("/tasks/0/problems/0", -1), "problems");
  ExpectRefused(with("/initializations", {"good", "good"}), "twice");
  ExpectRefused(with("/initializations/0", "hard"), "initializations");
  ExpectRefused(with("/methods/0/sample_size", 0), "sample_size");
  ExpectRefused(with("/methods/0/options", 3), "options");
  ExpectRefused(with("/methods/0/incremental", 1), "incremental");
  ExpectRefused(with("/methods/1", MethodJson("SQP", 'a')), "twice");
  ExpectRefused(with("/limits/wall_time_s", 0), "wall_time_s");
  ExpectRefused(with("/limits/memory_mb", 1), "memory_mb");
  ExpectRefused(with("/max_attempts", 101), "max_attempts");
}

TEST(Spec, SizeIsBounded) {
  Json spec = SampleSpec(10);
  spec["repetitions"] = 100'000;
  EXPECT_EQ(ParseSpec(spec.dump()).num_jobs(), kMaxJobsPerExperiment);
  spec["initializations"] = {"good", "in_collision"};
  ExpectRefused(spec, "more than 1000000");
}

// Order: method, task, initialization, problem, repetition; the last varies fastest.
TEST(Spec, JobsFollowTheOrderOfTheContract) {
  Json json = SampleSpec(2);
  json["repetitions"] = 2;
  json["initializations"] = {"in_collision", "good"};
  json["methods"].push_back(MethodJson("I-SQP", 'b'));
  json["tasks"].push_back({{"task", "motion"}, {"problems", {8, 3, 5}}, {"waypoints", {20, 30, 40}}});
  const ExperimentSpec spec = ParseSpec(json.dump());
  ASSERT_EQ(spec.num_jobs(), 2 * (2 + 3) * 2 * 2);
  const db::NewExperiment rows = MakeNewExperiment(spec, 5, 100, 50);
  ASSERT_EQ(rows.jobs.size(), 40U);
  EXPECT_EQ(rows.cells.size(), 8U);
  std::int64_t index = 0;
  for (std::size_t method = 0; method < 2; ++method) {
    for (std::size_t task = 0; task < 2; ++task) {
      for (std::size_t initialization = 0; initialization < 2; ++initialization) {
        for (std::size_t problem = 0; problem < spec.tasks[task].problems.size(); ++problem) {
          for (std::size_t repetition = 0; repetition < 2; ++repetition, ++index) {
            const JobCoordinates at = CoordinatesOf(spec, index);
            EXPECT_EQ(at.method, method);
            EXPECT_EQ(at.task, task);
            EXPECT_EQ(at.initialization, initialization);
            EXPECT_EQ(at.problem, problem);
            EXPECT_EQ(at.repetition, repetition);
            const db::NewJob& job = rows.jobs[static_cast<std::size_t>(index)];
            EXPECT_EQ(job.job_id, 100 + index);
            const db::CellRecord& cell = rows.cells[static_cast<std::size_t>(job.cell_index)];
            EXPECT_EQ(cell.cell_id, 50 + job.cell_index);
            EXPECT_EQ(cell.task, spec.tasks[task].task);
            EXPECT_EQ(cell.initialization, spec.initializations[initialization]);
            EXPECT_EQ(cell.method_index, static_cast<int>(method));
            EXPECT_EQ(cell.num_jobs, static_cast<std::int64_t>(spec.tasks[task].problems.size()) * 2);
            const db::ProblemRecord& row = rows.problems[static_cast<std::size_t>(job.problem_index)];
            EXPECT_EQ(row.task, spec.tasks[task].task);
            EXPECT_EQ(row.number, spec.tasks[task].problems[problem]);
          }
        }
      }
    }
  }
}

}  // namespace
}  // namespace legopt::server
