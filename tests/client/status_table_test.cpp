// Policy: the experiments shown by `legopt status` are a function of the server's status and the width. No line is
// longer. Text that does not fit continues on the next line or is cut with dots, never dropped silently.

#include "client/report/status_table.h"

#include <gmock/gmock.h>

#include <nlohmann/json.hpp>
#include <sstream>

#include "client/report/text_layout.h"

namespace legopt::client {
namespace {

using testing::HasSubstr;
using testing::Not;

ExperimentStatus Quick() {
  ExperimentStatus status;
  status.id = 3;
  status.name = "quick";
  status.state = ExperimentState::kActive;
  status.total = 80;
  status.done = 52;
  status.solved = 38;
  status.queued = 28;
  status.dataset = "garage-easier";
  status.methods = {"SQP", "I-SQP", "Adam"};
  status.eta_s = 12;
  status.share = 0.5;
  return status;
}

ExperimentStatus Long() {
  ExperimentStatus status = Quick();
  status.id = 12;
  status.name = "the-whole-table-with-every-method-and-start";
  status.submitter = "ann-with-a-long-name";
  status.tags = {"paper", "revision-2"};
  status.priority = 7;
  status.methods = {"SQP", "I-SQP", "Adam", "LegOpt-best", "Ipopt", "Augmented-Lagrangian", "STOMP"};
  status.eta_s = {};
  status.share = 0;
  status.waiting_for = "no worker has dataset 'garage' (0123456789ab); start one with --dataset";
  return status;
}

std::vector<std::string> Lines(const std::string& text) {
  std::istringstream in(text);
  std::vector<std::string> lines;
  for (std::string line; std::getline(in, line);) lines.push_back(line);
  return lines;
}

TEST(StatusTable, WideHasEverythingOnOneLine) {
  const std::vector<ExperimentStatus> list = {Quick()};
  EXPECT_EQ(RenderExperiments(list, 0),
            "ID  NAME   DATASET        METHODS                 JOBS  SOLVED  SHARE   ETA  STATE\n"
            " 3  quick  garage-easier  SQP, I-SQP, Adam  52/80 65 %      38   50 %  0:12  active\n");
}

TEST(StatusTable, WhatWasTakenOverIsAColumn) {
  std::vector<ExperimentStatus> list = {Quick(), Quick()};
  EXPECT_THAT(RenderExperiments(list, 0), Not(HasSubstr("TAKEN")));
  list[1].taken_over = 17;
  EXPECT_THAT(RenderExperiments(list, 0), HasSubstr("TAKEN"));
  EXPECT_THAT(Lines(RenderExperiments(list, 60))[3], HasSubstr("17"));
  EXPECT_EQ(ExperimentListing(list).At(1, "taken_over"), 17);
}

TEST(StatusTable, ColumnsThatNobodyHasAreLeftOut) {
  std::vector<ExperimentStatus> list = {Quick()};
  EXPECT_THAT(RenderExperiments(list, 0), Not(HasSubstr("TAGS")));
  list[0].submitter = "ann";
  list[0].tags = {"paper"};
  list[0].priority = -2;
  const std::string text = RenderExperiments(list, 0);
  for (const char* word : {"BY", "ann", "TAGS", "paper", "PRIORITY", "-2"}) EXPECT_THAT(text, HasSubstr(word));
}

TEST(StatusTable, NarrowHasTheRestOnALineOfItsOwn) {
  const std::vector<ExperimentStatus> list = {Long()};
  const std::string text = RenderExperiments(list, 80);
  const auto lines = Lines(text);
  ASSERT_EQ(lines.size(), 3U);
  EXPECT_THAT(lines[1], HasSubstr("the-whole-table-w..."));
  EXPECT_THAT(lines[1], HasSubstr("52/80 65 %"));
  EXPECT_THAT(lines[2], HasSubstr("garage-easier; SQP, I-SQP, Adam, "));
  EXPECT_THAT(Lines(RenderExperiments(list, 120))[2], HasSubstr("tags paper, revision-2; priority 7"));
}

TEST(StatusTable, NoLineIsLongerThanTheTerminal) {
  const std::vector<ExperimentStatus> list = {Quick(), Long()};
  const auto workers = nlohmann::json::parse(R"([{"id":1,"name":"a-worker-with-a-name","hostname":"host.example.org",
      "pid":4711,"slots":2,"leases":9,"online":true,"silent_s":0.1,"datasets":"garage-easier, garage-full",
      "build":"legopt 1.2, a compiler of some length"}])");
  for (std::size_t width = 40; width <= 200; ++width) {
    for (const std::string& line : Lines(RenderExperiments(list, width))) EXPECT_LE(DisplayWidth(line), width) << line;
    for (const std::string& line : Lines(RenderWorkers(workers, width))) EXPECT_LE(DisplayWidth(line), width) << line;
  }
}

TEST(StatusTable, TheStateIsTheReasonWhenNothingMoves) {
  std::vector<ExperimentStatus> list = {Long()};
  EXPECT_THAT(RenderExperiments(list, 0), HasSubstr("no worker has dataset 'garage' (0123456789ab)\n"));
  list[0].state = ExperimentState::kDone;
  EXPECT_THAT(RenderExperiments(list, 0), HasSubstr("done\n"));
}

TEST(StatusTable, CutsBetweenCharacters) {
  std::vector<ExperimentStatus> list = {Long()};
  list[0].name = "ääääääääääääääääääääääääääääää";
  EXPECT_THAT(RenderExperiments(list, 80), HasSubstr("äääääääääääääääää..."));
}

TEST(StatusTable, WorkersTellWhetherTheyWork) {
  const auto state = [](const char* fields) {
    return RenderWorkers(nlohmann::json::parse(std::string("[{\"id\":1,\"name\":\"w\",") + fields + "}]"), 0);
  };
  EXPECT_THAT(state(R"("online":true,"silent_s":0.2,"datasets":"garage")"), HasSubstr("online"));
  EXPECT_THAT(state(R"("online":true,"silent_s":0.2,"datasets":"")"), HasSubstr("loads its dataset"));
  EXPECT_THAT(state(R"("online":true,"silent_s":7.0,"datasets":"garage")"), HasSubstr("silent for 0:07"));
  EXPECT_THAT(state(R"("online":false,"silent_s":null,"datasets":"garage")"), HasSubstr("offline"));
}

TEST(StatusTable, OtherFormatsHaveEveryColumn) {
  const std::vector<ExperimentStatus> list = {Long()};
  const Listing listing = ExperimentListing(list);
  EXPECT_EQ(listing.At(0, "submitter"), "ann-with-a-long-name");
  EXPECT_EQ(listing.At(0, "tags"), "paper, revision-2");
  EXPECT_EQ(listing.At(0, "waiting_for"), Long().waiting_for);
  EXPECT_TRUE(listing.At(0, "eta_s").is_null());
}

}  // namespace
}  // namespace legopt::client
