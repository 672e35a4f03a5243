#include "client/report/result_origins.h"

#include <algorithm>
#include <cmath>

#include "db/named_queries.h"
#include "legopt/types/number_text.h"

namespace legopt::client {
namespace {

constexpr double kGibibyte = 1 << 30;

std::optional<std::int64_t> OptionalInteger(const nlohmann::json& value) {
  return value.is_number_integer() ? std::optional(value.get<std::int64_t>()) : std::nullopt;
}

// Returns the distinct texts, in the order of their first occurrence.
std::vector<std::string> Distinct(const std::vector<ResultProvenance>& origins,
                                  std::string (*text)(const ResultProvenance&)) {
  std::vector<std::string> distinct;
  for (const ResultProvenance& origin : origins) {
    const std::string mine = text(origin);
    if (std::find(distinct.begin(), distinct.end(), mine) == distinct.end()) distinct.push_back(mine);
  }
  return distinct;
}

std::string Joined(const std::vector<std::string>& texts, const char* between) {
  std::string joined;
  for (const std::string& text : texts) joined += (joined.empty() ? "" : between) + text;
  return joined;
}

std::string IdOf(const ResultProvenance& origin) { return origin.build_id.empty() ? "unknown" : origin.build_id; }

std::string BuildOf(const ResultProvenance& origin) { return IdOf(origin) + " (" + origin.build + ")"; }

std::string MachineOf(const ResultProvenance& origin) {
  std::string text = origin.processor.empty() ? "a machine that is not known" : origin.processor;
  if (origin.processors) {
    text += ", " + std::to_string(*origin.processors) + (*origin.processors == 1 ? " processor" : " processors");
  }
  if (origin.memory_bytes) {
    text += ", " + std::to_string(std::lround(static_cast<double>(*origin.memory_bytes) / kGibibyte)) + " GiB";
  }
  if (origin.load) text += ", load " + FormatFixed(*origin.load, 1);
  return text;
}

}  // namespace

std::vector<ResultProvenance> ReadOrigins(ResultSource& source, std::int64_t experiment_id) {
  const Listing listing =
      source.Query(db::Sql(db::Query::kResultOriginsOfExperiment, {{"experiment_id", experiment_id}}));
  std::vector<ResultProvenance> origins;
  for (std::size_t i = 0; i < listing.rows.size(); ++i) {
    const nlohmann::json& load = listing.At(i, "load");
    origins.push_back({listing.Text(i, "build_id"), listing.Text(i, "build"), listing.Text(i, "hostname"),
                       listing.Text(i, "processor"), OptionalInteger(listing.At(i, "processors")),
                       OptionalInteger(listing.At(i, "memory_bytes")),
                       load.is_number() ? std::optional(load.get<double>()) : std::nullopt,
                       listing.At(i, "workers").get<std::int64_t>(), listing.At(i, "results").get<std::int64_t>()});
  }
  return origins;
}

std::string DescribeOrigins(const std::vector<ResultProvenance>& origins) {
  if (origins.empty()) return {};
  const std::vector<std::string> builds = Distinct(origins, BuildOf);
  const std::string many = builds.size() == 1 ? "Build " : std::to_string(builds.size()) + " builds: ";
  return many + Joined(builds, ", ") + " on " + Joined(Distinct(origins, MachineOf), "; ") + ".";
}

std::int64_t CountReusedResults(ResultSource& source, std::int64_t experiment_id) {
  return source.Query(db::Sql(db::Query::kReusedResultCount, {{"experiment_id", experiment_id}}))
      .At(0, "n")
      .get<std::int64_t>();
}

std::string ReusedResultsSentence(std::int64_t results) {
  if (results == 0) return {};
  return " " + std::to_string(results) + (results == 1 ? " result was" : " results were") +
         " reused from other experiments.";
}

nlohmann::ordered_json OriginsJson(const std::vector<ResultProvenance>& origins) {
  const auto optional = [](const auto& value) {
    return value ? nlohmann::ordered_json(*value) : nlohmann::ordered_json();
  };
  auto json = nlohmann::ordered_json::array();
  for (const ResultProvenance& origin : origins) {
    json.push_back({{"build_id", origin.build_id},
                    {"build", origin.build},
                    {"hostname", origin.hostname},
                    {"processor", origin.processor},
                    {"processors", optional(origin.processors)},
                    {"memory_bytes", optional(origin.memory_bytes)},
                    {"load", optional(origin.load)},
                    {"workers", origin.workers},
                    {"results", origin.results}});
  }
  return json;
}

std::string BuildIds(const std::vector<ResultProvenance>& origins) { return Joined(Distinct(origins, IdOf), " "); }

}  // namespace legopt::client
