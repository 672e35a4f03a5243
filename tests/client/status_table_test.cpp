// Policy: the experiments shown by `legopt status` are a function of the server's status. Columns without values are
// omitted; nothing else is.

#include "client/report/status_table.h"

#include <gmock/gmock.h>

#include <nlohmann/json.hpp>

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

std::string RenderExperiments(const std::vector<ExperimentStatus>& list) {
  return RenderTable(ExperimentTable(list), TableFormat::kText);
}

TEST(StatusTable, WideHasEverythingOnOneLine) {
  const std::vector<ExperimentStatus> list = {Quick()};
  EXPECT_EQ(RenderExperiments(list),
            "ID  NAME   DATASET        METHODS                 JOBS  SOLVED  SHARE   ETA  STATE\n"
            " 3  quick  garage-easier  SQP, I-SQP, Adam  52/80 65 %      38   50 %  0:12  active\n");
}

TEST(StatusTable, WhatWasTakenOverIsAColumn) {
  std::vector<ExperimentStatus> list = {Quick(), Quick()};
  EXPECT_THAT(RenderExperiments(list), Not(HasSubstr("TAKEN")));
  list[1].taken_over = 17;
  EXPECT_THAT(RenderExperiments(list), HasSubstr("TAKEN"));
  EXPECT_EQ(ExperimentListing(list).At(1, "taken_over"), 17);
}

TEST(StatusTable, ColumnsThatNobodyHasAreLeftOut) {
  std::vector<ExperimentStatus> list = {Quick()};
  EXPECT_THAT(RenderExperiments(list), Not(HasSubstr("TAGS")));
  list[0].submitter = "ann";
  list[0].tags = {"paper"};
  list[0].priority = -2;
  const std::string text = RenderExperiments(list);
  for (const char* word : {"BY", "ann", "TAGS", "paper", "PRIORITY", "-2"}) EXPECT_THAT(text, HasSubstr(word));
}

TEST(StatusTable, TheStateIsTheReasonWhenNothingMoves) {
  std::vector<ExperimentStatus> list = {Long()};
  EXPECT_THAT(RenderExperiments(list), HasSubstr("no worker has dataset 'garage' (0123456789ab)\n"));
  list[0].state = ExperimentState::kDone;
  EXPECT_THAT(RenderExperiments(list), HasSubstr("done\n"));
}

TEST(StatusTable, WorkersTellWhetherTheyWork) {
  const auto state = [](const char* fields) {
    const auto workers = nlohmann::json::parse(std::string("[{\"id\":1,\"name\":\"w\",") + fields + "}]");
    return RenderTable(WorkerTable(workers), TableFormat::kText);
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

TEST(StatusTable, WorkersThatAreNotListedAreCounted) {
  EXPECT_EQ(UnlistedWorkers({{"server", {{"workers_not_listed", 0}}}}), "");
  EXPECT_EQ(UnlistedWorkers({{"server", {{"workers_not_listed", 1}}}}), "and 1 worker that took no job yet\n");
  EXPECT_EQ(UnlistedWorkers({{"server", {{"workers_not_listed", 30}}}}), "and 30 workers that took no job yet\n");
}

}  // namespace
}  // namespace legopt::client
