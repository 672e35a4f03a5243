#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "client/report/result_source.h"

namespace legopt::client {

/// A build on a kind of machine, and how many accepted results of an experiment it made. What is not known is empty or
/// none.
struct ResultOrigin {
  std::string build_id;  ///< equal: the same bits
  std::string build;     ///< release, commit, compiler
  std::string hostname;
  std::string processor;
  std::optional<std::int64_t> processors;    ///< granted to a worker; the most
  std::optional<std::int64_t> memory_bytes;  ///< of the host
  std::optional<double> load;                ///< of the host, when a worker was last seen; the largest
  std::int64_t workers = 0;
  std::int64_t results = 0;

  bool operator==(const ResultOrigin&) const = default;
};

/// Most results first.
std::vector<ResultOrigin> ReadOrigins(ResultSource& source, std::int64_t experiment_id);

/// A sentence for captions, empty without origins: "Build 0f3c... (legopt 0.1.0 (8a643da59c), GNU 12.2.0) on AMD EPYC,
/// 2 processors, 24 GiB, load 1.8." Several builds are named as such, several machines in turn.
std::string DescribeOrigins(const std::vector<ResultOrigin>& origins);

/// How many results of an experiment its jobs took over from equal jobs of other experiments.
std::int64_t ReadTakenOver(ResultSource& source, std::int64_t experiment_id);

/// What captions say of it behind the origins, with a blank before: " 40 results were taken over from other
/// experiments." Empty for none.
std::string MentionTakenOver(std::int64_t results);

nlohmann::ordered_json OriginsJson(const std::vector<ResultOrigin>& origins);

/// "id", or ids with a blank between, each once.
std::string BuildIds(const std::vector<ResultOrigin>& origins);

}  // namespace legopt::client
