#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "client/report/result_source.h"

namespace legopt::client {

/// A build on a kind of machine, and the number of accepted results of an experiment that it made. Unknown values are
/// empty or nullopt.
struct ResultProvenance {
  std::string build_id;  ///< equal ids imply equal bits
  std::string build;     ///< release, commit, compiler
  std::string hostname;
  std::string processor;
  std::optional<std::int64_t> processors;    ///< maximum number granted to a worker
  std::optional<std::int64_t> memory_bytes;  ///< memory of the host
  std::optional<double> load;                ///< largest load of the host when a worker was last seen
  std::int64_t workers = 0;
  std::int64_t results = 0;

  bool operator==(const ResultProvenance&) const = default;
};

/// Reads the origins of an experiment's results, most results first.
std::vector<ResultProvenance> ReadOrigins(ResultSource& source, std::int64_t experiment_id);

/// Returns a sentence for captions, empty without origins: "Build 0f3c... (legopt 0.1.0 (8a643da59c), GNU 12.2.0) on
/// AMD EPYC, 2 processors, 24 GiB, load 1.8." Lists several builds or machines.
std::string DescribeOrigins(const std::vector<ResultProvenance>& origins);

/// Returns the number of results that an experiment reused from other experiments.
std::int64_t CountReusedResults(ResultSource& source, std::int64_t experiment_id);

/// Returns a sentence to be appended to the origins, with a leading space: " 40 results were taken over from other
/// experiments." Empty if there are none.
std::string ReusedResultsSentence(std::int64_t results);

nlohmann::ordered_json OriginsJson(const std::vector<ResultProvenance>& origins);

/// Returns the distinct build ids, separated by spaces.
std::string BuildIds(const std::vector<ResultProvenance>& origins);

}  // namespace legopt::client
