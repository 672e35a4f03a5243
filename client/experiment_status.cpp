#include "client/experiment_status.h"

#include "client/client_error.h"

namespace legopt::client {

std::vector<ExperimentStatus> ParseExperiments(const nlohmann::json& status) {
  std::vector<ExperimentStatus> experiments;
  try {
    for (const auto& entry : status.at("experiments")) {
      const auto& jobs = entry.at("jobs");
      const auto count = [&jobs](const char* key) { return jobs.at(key).get<std::int64_t>(); };
      experiments.push_back({entry.at("id").get<std::int64_t>(), entry.at("name").get<std::string>(),
                             entry.at("state").get<std::string>(), count("total"), count("queued"), count("leased"),
                             count("done"), count("failed"), count("dead"), count("cancelled"),
                             entry.at("solved").get<std::int64_t>(), entry.value("hold", "none"),
                             entry.value("hold_reason", ""), entry.value("priority", 0)});
      for (const auto& job : entry.value("running", nlohmann::json::array())) {
        experiments.back().running.push_back(
            {job.at("job").get<std::int64_t>(), job.at("task").get<std::string>(), job.at("worker").get<std::int64_t>(),
             job.at("progress_done").get<std::int64_t>(), job.at("progress_total").get<std::int64_t>()});
      }
    }
  } catch (const nlohmann::json::exception& error) {
    throw ClientError(ExitCode::kInternal, std::string("the server's status is not understood: ") + error.what() +
                                               "; check that server and client are of the same version");
  }
  return experiments;
}

std::string StateText(const ExperimentStatus& status) {
  if (status.over() || status.hold == "none") return status.state;
  return status.hold == "held" ? "held: " + status.hold_reason : status.hold;
}

std::string StandstillReason(const nlohmann::json& status) {
  const auto experiments = status.contains("experiments") ? ParseExperiments(status) : std::vector<ExperimentStatus>{};
  for (const auto& experiment : experiments) {
    if (experiment.over() || experiment.hold == "none") continue;
    return "experiment " + std::to_string(experiment.id) + " is " + StateText(experiment) + "; 'legopt " +
           (experiment.hold == "held" ? "release " : "resume ") + std::to_string(experiment.id) + "' lets it go on";
  }
  int online = 0;
  for (const auto& worker : status.value("workers", nlohmann::json::array())) {
    if (!worker.value("online", false)) continue;
    if (worker.value("leases", 0) > 0) return {};
    ++online;
  }
  if (online == 0) return "no worker is connected; start one with 'legopt-worker --slots 2'";
  return "workers are connected, but none takes these jobs; do they have the dataset ('legopt status' lists them)?";
}

std::string StoreError(const nlohmann::json& status) {
  return status.value(nlohmann::json::json_pointer("/server/store_error"), std::string());
}

nlohmann::json ParseStatusText(const std::string& text) {
  auto status = nlohmann::json::parse(text, nullptr, false);
  if (status.is_discarded()) {
    throw ClientError(ExitCode::kInternal,
                      "the server's status is not JSON; check that server and client are of the same version");
  }
  return status;
}

}  // namespace legopt::client
