#include "client/report/result_source.h"

#include <chrono>
#include <cmath>
#include <utility>

#include "client/client_error.h"
#include "db/read_only_database.h"

namespace legopt::client {
namespace {

int HexDigit(char c) {
  constexpr int kTen = 10;
  if (c >= '0' && c <= '9') return c - '0';
  return c >= 'A' && c <= 'F' ? c - 'A' + kTen : -1;
}

std::string Hex(const std::string& bytes) {
  constexpr char kDigits[] = "0123456789ABCDEF";
  constexpr unsigned kNibble = 4, kMask = 15;
  std::string text;
  text.reserve(bytes.size() * 2);
  for (const char c : bytes) {
    const auto byte = static_cast<unsigned char>(c);
    text += kDigits[byte >> kNibble];
    text += kDigits[byte & kMask];
  }
  return text;
}

struct ToJson {
  nlohmann::json operator()(std::monostate) const { return nullptr; }
  nlohmann::json operator()(std::int64_t value) const { return value; }
  nlohmann::json operator()(double value) const { return value; }
  nlohmann::json operator()(const std::string& value) const { return value; }
  nlohmann::json operator()(const db::Blob& value) const { return Hex(value.bytes); }
};

class FileSource final : public ResultSource {
 public:
  explicit FileSource(const std::string& file) : file_(file), database_(file) {}

  using ResultSource::Query;
  Listing Query(const std::string& sql, int max_rows, double limit_s) override {
    db::QueryLimits limits;
    limits.max_rows = max_rows;
    limits.time_limit = std::chrono::milliseconds(std::llround(limit_s * 1e3));
    auto result = database_.Query(sql, {}, limits);
    Listing listing;
    listing.columns = std::move(result.columns);
    listing.truncated = result.truncated;
    listing.rows.reserve(result.rows.size());
    for (const auto& row : result.rows) {
      auto& line = listing.rows.emplace_back();
      line.reserve(row.size());
      for (const auto& value : row) line.push_back(std::visit(ToJson{}, value));
    }
    return listing;
  }

  std::string flags() const override { return " --db " + file_; }

 private:
  std::string file_;
  db::ReadOnlyDatabase database_;
};

class ServerSource final : public ResultSource {
 public:
  explicit ServerSource(const NetworkOptions& options) : options_(options), server_(options) {}

  using ResultSource::Query;
  Listing Query(const std::string& sql, int max_rows, double limit_s) override {
    auto json = server_.Query(sql, max_rows, limit_s);
    Listing listing;
    listing.columns = json.at("columns").get<std::vector<std::string>>();
    listing.rows = json.at("rows").get<std::vector<std::vector<nlohmann::json>>>();
    listing.truncated = json.value("truncated", false);
    for (const auto& row : listing.rows) {
      if (row.size() != listing.columns.size()) {
        throw ClientError(ExitCode::kInternal, "the server's query result is not rectangular");
      }
    }
    return listing;
  }

  std::string flags() const override {
    return options_.port ? " --port " + std::to_string(*options_.port) : std::string();
  }

 private:
  NetworkOptions options_;
  ServerConnection server_;
};

}  // namespace

std::unique_ptr<ResultSource> OpenResults(const SourceOptions& options) {
  if (options.db) return std::make_unique<FileSource>(*options.db);
  return std::make_unique<ServerSource>(options.network);
}

std::optional<std::string> BytesOfBlob(std::string_view hex) {
  constexpr int kBase = 16;
  if (hex.size() % 2 != 0) return std::nullopt;
  std::string bytes;
  bytes.reserve(hex.size() / 2);
  for (std::size_t i = 0; i < hex.size(); i += 2) {
    const int high = HexDigit(hex[i]), low = HexDigit(hex[i + 1]);
    if (high < 0 || low < 0) return std::nullopt;
    bytes.push_back(static_cast<char>(high * kBase + low));
  }
  return bytes;
}

std::string SqlText(const std::string& text) {
  std::string literal = "'";
  for (const char c : text) {
    if (c == '\'') literal += '\'';
    literal += c;
  }
  return literal + "'";
}

ExperimentInfo FindExperiment(ResultSource& source, std::optional<std::int64_t> id) {
  const std::string where = id ? " WHERE e.experiment_id = " + std::to_string(*id) : "";
  const Listing found = source.Query(
      "SELECT e.experiment_id, e.name, e.state, d.name AS dataset, d.hash, coalesce(json_extract(e.spec_json, "
      "'$.split'), 'all') AS split FROM experiments AS e JOIN datasets AS d USING (dataset_id)" +
      where + " ORDER BY e.experiment_id DESC LIMIT 1");
  if (found.rows.empty()) {
    throw ClientError(ExitCode::kUsage, id ? "there is no experiment " + std::to_string(*id) + "; 'legopt status" +
                                                 source.flags() + "' lists them"
                                           : "there is no experiment yet; submit one with 'legopt submit SUITE'");
  }
  return {found.At(0, "experiment_id").get<std::int64_t>(), found.At(0, "name").get<std::string>(),
          found.WordAt<ExperimentState>(0, "state"),        found.At(0, "dataset").get<std::string>(),
          found.At(0, "hash").get<std::string>(),           found.WordAt<Split>(0, "split")};
}

}  // namespace legopt::client
