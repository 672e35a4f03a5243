// Policy: the page's playback of a motion has the duration of its time law, loads within limits, and forces that carry
// the robot; or the reason why the motion cannot be executed.
#include "client/page/page_playback.h"

#include <gmock/gmock.h>

#include "client/report/motion_path.h"
#include "client/report/sampled_motion.h"
#include "client/serve/live_page.h"
#include "page_fixture.h"
#include "planted_experiment.h"

namespace legopt::client {
namespace {

using Json = nlohmann::ordered_json;
using testing::AllOf, testing::EndsWith, testing::StartsWith;

class PagePlayback : public testing::Test {
 protected:
  /// `problem`: 0 can be executed, 10 cannot.
  Json Of(int problem) const {
    const SolutionFile file = PlantedMotionsOf({problem});
    return PlaybackJson(*dataset_, JobOf(problem), {file.problems.at(0).solutions.at(0).waypoints, {}});
  }
  static PageJob JobOf(int problem) {
    PageJob job;
    job.task = Task::kBalanced;
    job.problem = problem;
    return job;
  }

  std::shared_ptr<const Dataset> dataset_ = Dataset::Load(PlantedFolder());
};

TEST_F(PagePlayback, HasSamplesUpToItsDurationWithForcesThatCarryTheRobot) {
  const Json playback = Of(0);
  const auto duration_s = playback.at("duration_s").get<double>();
  const size_t samples = playback.at("times_s").size();
  EXPECT_EQ(samples, static_cast<size_t>(duration_s * kPlaybackRate_Hz) + 2);
  EXPECT_NEAR(playback["times_s"].back().get<double>(), duration_s, 1e-6);
  const double weight_N = dataset_->robot().total_mass() * dataset_->gravity_m_s2();
  double mean_N = 0.0;
  for (const char* list : {"waypoints", "x", "velocities", "torques", "forces"}) {
    ASSERT_EQ(playback.at(list).size(), samples) << list;
  }
  for (size_t k = 0; k < samples; ++k) {
    EXPECT_EQ(playback["x"][k].size(), 19u);
    EXPECT_EQ(playback["torques"][k].size(), 12u);
    for (const Json& force : playback["forces"][k]) {
      const Json& point = playback.at("points").at(force.at(0).get<size_t>());
      EXPECT_NO_THROW(dataset_->contact(point.at("contact").get<std::string>()));
      mean_N += force.at(3).get<double>() / static_cast<double>(samples);
    }
  }
  EXPECT_NEAR(mean_N, weight_N, 0.3 * weight_N) << "the robot ends at the height at which it began";
  double shares = 0.0;
  for (const auto& [limit, share] : playback.at("nearest").items()) shares += share.get<double>();
  EXPECT_NEAR(shares, 1.0, 1e-3);
}

TEST_F(PagePlayback, NamesWhatBlocksAMotion) {
  const std::vector<Eigen::VectorXd> waypoints = PlantedMotionsOf({10}).problems.at(0).solutions.at(0).waypoints;
  const MotionPath path = ReadMotionPath(Task::kBalanced, dataset_->problem(Task::kBalanced, 10), waypoints,
                                         dataset_->robot().configuration_size());
  const MotionTiming timing = SampleMotion(*dataset_, path, kPlaybackRate_Hz, kMostPlaybackSamples).timing;
  ASSERT_GE(timing.blocked_at, 0.0);
  ASSERT_THAT(timing.blocked_by, StartsWith("friction of "));

  const Json playback = Of(10);
  EXPECT_TRUE(playback.at("duration_s").is_null());
  EXPECT_EQ(playback.at("blocked_by"), timing.blocked_by);
  EXPECT_NEAR(playback.at("blocked_at").get<double>(), timing.blocked_at, 1e-6);
  EXPECT_THAT(playback.at("reason").get<std::string>(),
              AllOf(StartsWith("it is blocked at waypoint "), EndsWith(": " + timing.blocked_by)));
  EXPECT_FALSE(playback.contains("x"));
}

TEST_F(PagePlayback, NamesUnsolvedWindowsAndBrokenSolutions) {
  const SolutionFile file = PlantedMotionsOf({0});
  PageMotion motion{file.problems[0].solutions[0].waypoints, 4};
  EXPECT_EQ(PlaybackJson(*dataset_, JobOf(0), motion).at("reason"), "the window from waypoint 4 on is not solved");
  motion = {{motion.waypoints.begin(), motion.waypoints.end() - 1}, {}};
  const Json broken = PlaybackJson(*dataset_, JobOf(0), motion);
  EXPECT_TRUE(broken.at("duration_s").is_null());
  EXPECT_FALSE(broken.at("reason").get<std::string>().empty());
}

TEST_F(PagePlayback, IsTheSameInAViewAndFromAServer) {
  const test::TemporaryFolder folder;
  const std::filesystem::path database = folder.path() / "planted.sqlite";
  WriteTestDatabase(database, PlantedExperiment(*dataset_, PlantedMotionsOf({0})));
  ViewRequest view;
  view.source = {database.string(), {}};
  view.job = 1;
  view.dataset = dataset_;
  const Json in_view = Json::parse(Block(MakeView(view).text, "playback-1"));
  FigureRequest figures;
  figures.sources = {{{database.string(), {}}, std::nullopt}};
  figures.datasets = {dataset_};
  LiveBlocks blocks(figures);
  const HttpReply first = blocks.Make({"/blocks/playback-1", ""}), second = blocks.Make({"/blocks/playback-1", ""});
  ASSERT_EQ(first.status, 200U);
  EXPECT_EQ(Json::parse(Unzip(*first.body)), in_view);
  EXPECT_EQ(in_view, Of(0));
  EXPECT_EQ(first.etag, second.etag) << "computed once";
  EXPECT_EQ(blocks.Make({"/blocks/playback-7", ""}).status, 404U);
}

using PostureWithoutPlayback = PageTest;

TEST_F(PostureWithoutPlayback, IsNotFound) {
  FigureRequest figures;
  figures.sources = {{{file_.string(), {}}, std::nullopt}};
  figures.datasets = {dataset_};
  const HttpReply reply = LiveBlocks(figures).Make({"/blocks/playback-2", ""});
  EXPECT_EQ(reply.status, 404U);
  EXPECT_NE(reply.body->find("is a posture, which has no duration"), std::string::npos);
  EXPECT_EQ(Block(View(2).text, "playback-2"), "");
}

}  // namespace
}  // namespace legopt::client
