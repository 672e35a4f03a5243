#include "client/reading.h"

namespace legopt::client {

BenchmarkTable ReadBenchmarkTable(ResultSource& source, std::optional<std::int64_t> id, const std::string& rule) {
  const ExperimentInfo experiment = FindExperiment(source, id);
  auto table = BuildBenchmarkTable(source.Query(BenchmarkCellsSql(experiment.id, rule)), experiment.id, rule);
  table.dataset = experiment.dataset_name;
  return table;
}

}  // namespace legopt::client
