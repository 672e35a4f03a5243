#include "client/commands/known_costs.h"

#include <map>
#include <tuple>

#include "db/named_queries.h"

namespace legopt::client {
namespace {

struct Mean {
  double cpu_s = 0.0;
  double results = 0.0;

  void Add(double mean_cpu_s, double count) {
    cpu_s += (mean_cpu_s - cpu_s) * count / (results + count);
    results += count;
  }
};

// Method hash, task, whether on the dataset of the spec.
using CostKey = std::tuple<std::string, Task, bool>;

std::map<CostKey, Mean> ReadMeans(const nlohmann::json& spec, ResultSource& source) {
  std::vector<std::string> hashes;
  for (const auto& method : spec.at("methods")) hashes.push_back(method.at("hash").get<std::string>());
  const Listing rows = source.Query(db::Sql(db::Query::kMeanCpuTimes, {{"method_hashes", hashes}}));
  std::map<CostKey, Mean> means;
  const auto dataset = spec.at("dataset").at("hash").get<std::string>();
  for (std::size_t i = 0; i < rows.rows.size(); ++i) {
    const CostKey key{rows.Text(i, "method"), rows.EnumAt<Task>(i, "task"), rows.Text(i, "dataset") == dataset};
    means[key].Add(rows.At(i, "cpu_s").get<double>(), rows.At(i, "results").get<double>());
  }
  return means;
}

}  // namespace

std::vector<KnownCost> FindKnownCosts(const nlohmann::json& spec, ResultSource* source) {
  const std::map<CostKey, Mean> means = source == nullptr ? std::map<CostKey, Mean>() : ReadMeans(spec, *source);
  const auto times =
      static_cast<std::int64_t>(spec.at("initializations").size()) * spec.at("repetitions").get<std::int64_t>();
  std::vector<KnownCost> costs;
  for (const auto& method : spec.at("methods")) {
    for (const auto& task : spec.at("tasks")) {
      KnownCost cost;
      cost.method_hash = method.at("hash").get<std::string>();
      cost.task = ParseEnum<Task>(task.at("task").get<std::string>()).value();
      cost.jobs = static_cast<std::int64_t>(task.at("problems").size()) * times;
      for (const bool same : {true, false}) {
        const auto found = means.find({cost.method_hash, cost.task, same});
        if (found == means.end()) continue;
        cost.job_cpu_s = found->second.cpu_s;
        cost.same_dataset = same;
        break;
      }
      costs.push_back(std::move(cost));
    }
  }
  return costs;
}

}  // namespace legopt::client
