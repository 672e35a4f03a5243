// Policy: monitoring data are complete and escaped, and the server counts as healthy only while it can write its
// database.

#include "client/serve/monitoring.h"

#include <gmock/gmock.h>

#include <nlohmann/json.hpp>

namespace legopt::client {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

nlohmann::json ServerStatus() {
  return {
      {"experiments",
       {{{"id", 3},
         {"name", "quick"},
         {"state", "active"},
         {"solved", 0},
         {"waiting_for", "no worker is connected"},
         {"jobs",
          {{"total", 5}, {"queued", 4}, {"leased", 0}, {"done", 1}, {"failed", 0}, {"dead", 0}, {"cancelled", 0}}}}}},
      {"workers", {{{"id", 7}, {"name", "a \"b\"\\"}, {"online", false}, {"silent_s", 12.5}, {"leases", 0}}}},
      {"server",
       {{"store_error", ""},
        {"oldest_lease_s", nullptr},
        {"commits", 9},
        {"disk_free_bytes", 1000},
        {"scheduler", {{"leases", 2}}},
        {"requests", {{"lease", {{"requests", 6}, {"bytes", 600}}}}},
        {"transport", {{"rejected_tag", 4}, {"sent", 5}}}}}};
}

TEST(Metrics, FiguresOfAServer) {
  const std::string text = MetricsText(ServerStatus());
  EXPECT_THAT(text, AllOf(HasSubstr("\nlegopt_jobs{state=\"queued\"} 4\n"),
                          HasSubstr("legopt_experiment_waits{experiment=\"3\"} 1\n"),
                          HasSubstr("legopt_worker_online{worker=\"7\",name=\"a \\\"b\\\"\\\\\"} 0\n")));
  EXPECT_THAT(text, AllOf(HasSubstr("legopt_commits_total 9\n"), HasSubstr("legopt_disk_free_bytes 1000\n"),
                          HasSubstr("legopt_scheduler_total{what=\"leases\"} 2\n"),
                          HasSubstr("legopt_requests_total{type=\"lease\"} 6\n"),
                          HasSubstr("legopt_rejected_datagrams_total{cause=\"tag\"} 4\n")));
  EXPECT_THAT(text, AllOf(Not(HasSubstr("oldest_lease")), Not(HasSubstr("cause=\"sent\"")))) << "nothing is leased";
}

TEST(Metrics, AFileHasNumbersOfJobsOnly) {
  nlohmann::json status = {{"experiments", ServerStatus().at("experiments")}};
  EXPECT_THAT(MetricsText(status), AllOf(HasSubstr("legopt_jobs{state=\"done\"} 1\n"), Not(HasSubstr("worker"))));
}

TEST(Health, ADatabaseThatCannotBeWrittenIsAFault) {
  nlohmann::json status = ServerStatus();
  EXPECT_EQ(HealthFault(status), "");
  status["server"]["store_error"] = "disk full";
  EXPECT_THAT(HealthFault(status), HasSubstr("disk full"));
}

}  // namespace
}  // namespace legopt::client
