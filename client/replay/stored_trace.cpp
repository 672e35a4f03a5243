#include "client/replay/stored_trace.h"

#include <optional>
#include <span>
#include <string>

#include "client/client_error.h"
#include "db/named_queries.h"
#include "legopt/input/json.h"
#include "legopt/planning/trace.h"
#include "legopt/types/input_error.h"

namespace legopt::client {
namespace {

[[noreturn]] void RefuseTrace(std::int64_t job, const std::string& what) {
  throw ClientError(ExitCode::kUsage, "job " + std::to_string(job) + " " + what);
}

Listing HistoryOf(const std::string& text, std::int64_t job) {
  const auto json = TryParseJson(text).value_or(nullptr);
  Listing listing;
  const bool whole = json.is_object() && json.contains("columns") && json.contains("rows") &&
                     json.at("columns").is_array() && json.at("rows").is_array();
  if (!whole) RefuseTrace(job, "has an unreadable history: " + text.substr(0, 80));
  for (const auto& column : json.at("columns")) listing.columns.push_back(column.get<std::string>());
  for (const auto& row : json.at("rows")) {
    if (!row.is_array() || row.size() != listing.columns.size()) RefuseTrace(job, "has a history with a damaged row");
    listing.rows.emplace_back(row.begin(), row.end());
  }
  return listing;
}

}  // namespace

std::vector<IterationRecord> TraceRecords(const Listing& row, std::int64_t job) {
  if (row.At(0, "trace").is_null()) return {};
  const std::string source = "job " + std::to_string(job);
  const std::optional<std::string> bytes = BlobAt(row, 0, "trace");
  if (bytes && bytes->empty()) return {};
  try {
    if (!bytes) throw InputError({source, "trace", "", "is no BLOB", std::string(kCheckDatabase)});
    return DecodeTrace({reinterpret_cast<const std::uint8_t*>(bytes->data()), bytes->size()}, source);
  } catch (const InputError& error) {
    throw ClientError(ExitCode::kDatabaseUnusable, error.what());
  }
}

StoredTrace ReadTrace(ResultSource& source, std::int64_t job) {
  const std::string id = std::to_string(job);
  const Listing found = source.Query(db::Sql(db::Query::kTraceOfJob, {{"job_id", job}}));
  if (found.rows.empty()) RefuseTrace(job, "does not exist; 'legopt list" + source.flags() + "' lists those that do");
  if (found.At(0, "job_id").is_null()) {
    RefuseTrace(job, "is " + found.Text(0, "state") + " and has no result; 'legopt show " + id + source.flags() +
                         "' shows what happened");
  }
  StoredTrace trace;
  const auto& history = found.At(0, "history_json");
  trace.records = TraceRecords(found, job);
  if (trace.records.empty() && history.is_string()) {
    trace.history = HistoryOf(history.get<std::string>(), job);
  } else if (trace.records.empty()) {
    RefuseTrace(job, "has a result without a trace: its solver took no step, or tells none");
  }
  return trace;
}

Listing TraceListing(const std::vector<IterationRecord>& records) {
  Listing listing;
  listing.columns = {"step",     "window",      "restart",    "start", "penalty",  "trust_box",
                     "accepted", "evaluations", "elapsed_us", "cost",  "violation"};
  for (const IterationRecord& record : records) {
    listing.rows.push_back({record.step, record.window, record.restart, record.start, record.penalty, record.trust_box,
                            record.accepted ? 1 : 0, record.evaluations, record.elapsed_us, record.cost,
                            record.violation});
  }
  return listing;
}

}  // namespace legopt::client
