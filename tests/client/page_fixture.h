// A small experiment on a standing robot, and its pages, read back.
#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <memory>
#include <string>

#include "client/page/page.h"
#include "test_database.h"
#include "tests/dataset/synthetic_dataset.h"

namespace legopt::client {

/// Decompresses a stored block, given without base64.
std::string Unzip(const std::string& packed);
/// Returns a block of a page; empty if there is none.
std::string Block(const std::string& page, const std::string& name);

class PageTest : public testing::Test {
 protected:
  void SetUp() override {
    experiment_.dataset_hash = dataset_->content_hash();
    experiment_.name = "</script><script>alert(1)</script>";
    experiment_.methods = {{"A"}, {"B"}};
    Eigen::VectorXd off = test::StandingUpright();
    off[test::kBaseY] += 0.01;
    experiment_.results = {
        {.method = 0, .problem = 0, .cost = 300.125, .wall_us = 1000, .waypoints = {test::StandingUpright()}},
        {.method = 1, .problem = 0, .verdict = "foot_pose", .wall_us = 2000, .waypoints = {off}},
        {.method = 0, .initialization = "in_collision", .problem = 0, .dead = true},
        {.method = 1, .initialization = "in_collision", .problem = 0, .finished = false}};
    WriteTestDatabase(file_, experiment_);
  }

  Page Report(std::size_t most_bytes = 25'000'000) const {
    ReportRequest request;
    request.sources = {{{file_.string(), {}}, std::nullopt}};
    request.datasets = {dataset_};
    request.most_bytes = most_bytes;
    return MakeReport(request);
  }

  Page View(std::int64_t job) const {
    ViewRequest request;
    request.source = {file_.string(), {}};
    request.job = job;
    request.dataset = dataset_;
    return MakeView(request);
  }

  TemporaryFolder folder_;
  TemporaryFolder data_;
  std::filesystem::path file_ = folder_.path() / "results.sqlite";
  std::shared_ptr<const Dataset> dataset_ = Dataset::Load(test::SyntheticFolder(data_.path()).path());
  TestExperiment experiment_;
};

}  // namespace legopt::client
