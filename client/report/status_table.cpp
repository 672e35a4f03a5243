#include "client/report/status_table.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "client/report/progress.h"
#include "legopt/input/json.h"
#include "legopt/types/number_text.h"

namespace legopt::client {
namespace {

constexpr double kPercent = 100;
constexpr std::size_t kLongestMethods = 40;

std::string Joined(const std::vector<std::string>& words) {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "" : ", ") + word;
  return text;
}

// Returns e.g. "SQP, Adam, +3": rows with the same method name count once.
std::string ShortMethods(const ExperimentStatus& status) {
  std::vector<std::string> names, shown;
  for (const std::string& name : status.methods) {
    if (std::find(names.begin(), names.end(), name) == names.end()) names.push_back(name);
  }
  for (const std::string& name : names) {
    if (!shown.empty() && DisplayWidth(Joined(shown)) + DisplayWidth(name) > kLongestMethods) break;
    shown.push_back(name);
  }
  const std::size_t left = names.size() - shown.size();
  return Joined(shown) + (left > 0 ? ", +" + std::to_string(left) : "");
}

std::string Jobs(const ExperimentStatus& status) {
  std::string text = std::to_string(status.finished()) + "/" + std::to_string(status.total);
  if (!status.over() && status.total > 0) {
    const double share = static_cast<double>(status.finished()) / static_cast<double>(status.total);
    text += " " + std::to_string(static_cast<int>(std::floor(share * kPercent))) + " %";
  }
  return text;
}

std::string StateOrReason(const ExperimentStatus& status) {
  std::string text = status.over() || status.waiting_for.empty() ? StateText(status) : status.waiting_for;
  text = text.substr(0, text.find(';'));
  if (status.dead > 0) text += ", " + std::to_string(status.dead) + " dead";
  if (status.failed > 0) text += ", " + std::to_string(status.failed) + " cannot run";
  return text;
}

// Returns the number of results reused from other experiments.
std::string TakenOver(const ExperimentStatus& status) {
  return status.taken_over > 0 ? std::to_string(status.taken_over) : "";
}

std::string Share(const ExperimentStatus& status) {
  return status.share > 0 ? std::to_string(std::lround(status.share * kPercent)) + " %" : "";
}

std::string Eta(const ExperimentStatus& status) {
  return status.eta_s ? FormatDuration(Seconds(*status.eta_s)) : std::string();
}

// Adds a column with a cell for each of `rows`; omits it if no row has a value.
template <class Rows, class Text>
void AddColumn(const std::string& heading, Alignment alignment, const Rows& rows, const Text& text, Table* table) {
  std::vector<std::string> texts;
  for (const auto& row : rows) texts.push_back(text(row));
  if (std::ranges::all_of(texts, &std::string::empty)) return;
  table->columns.push_back({heading, "", "", alignment});
  table->rows.resize(texts.size());
  for (std::size_t i = 0; i < texts.size(); ++i) {
    table->rows[i].cells.push_back(texts[i].empty() ? MissingCell() : TextCell(texts[i]));
  }
}

// Returns an empty text for the default rule, so that the column appears only for other rules.
std::string WeakerRule(const ExperimentStatus& status) {
  return status.rule == Rule::kSolid ? "" : std::string(ToString(status.rule));
}

std::string Field(const nlohmann::json& worker, const char* key) {
  const auto found = worker.find(key);
  if (found == worker.end() || found->is_null()) return {};
  return found->is_string() ? found->get<std::string>() : Dump(*found);
}

std::string WorkerState(const nlohmann::json& worker) {
  constexpr double kUsualSilence_s = 3;
  const auto silent = worker.find("silent_s");
  if (!worker.value("online", false)) {
    return silent != worker.end() && silent->is_number()
               ? "offline, heard " + FormatDuration(Seconds(silent->get<double>())) + " ago"
               : "offline";
  }
  if (silent != worker.end() && silent->is_number() && silent->get<double>() > kUsualSilence_s) {
    return "silent for " + FormatDuration(Seconds(silent->get<double>()));
  }
  if (worker.value("draining", false)) return "draining";
  return Field(worker, "datasets").empty() ? "loads its dataset" : "online";
}

std::string Load(const nlohmann::json& worker) {
  const auto load = worker.find("load");
  if (load == worker.end() || !load->is_number()) return "-";
  return FormatFixed(load->get<double>(), 1);
}

// Returns e.g. "2 x AMD EPYC 7B13".
std::string Processor(const nlohmann::json& worker) {
  const std::string model = Field(worker, "processor");
  return model.empty() ? "-" : Field(worker, "processors") + " x " + model;
}

}  // namespace

Table ExperimentTable(std::span<const ExperimentStatus> experiments) {
  using S = const ExperimentStatus&;
  Table table;
  const auto left = [&](const char* heading, const auto& text) {
    AddColumn(heading, Alignment::kLeft, experiments, text, &table);
  };
  const auto right = [&](const char* heading, const auto& text) {
    AddColumn(heading, Alignment::kRight, experiments, text, &table);
  };
  right("ID", [](S s) { return std::to_string(s.id); });
  left("NAME", [](S s) { return s.name; });
  left("BY", [](S s) { return s.submitter; });
  left("DATASET", [](S s) { return s.dataset; });
  left("METHODS", ShortMethods);
  left("TAGS", [](S s) { return Joined(s.tags); });
  right("PRIORITY", [](S s) { return s.priority == 0 ? std::string() : std::to_string(s.priority); });
  right("JOBS", Jobs);
  right("SOLVED", [](S s) { return std::to_string(s.solved); });
  left("RULE", WeakerRule);
  right("TAKEN", TakenOver);
  right("SHARE", Share);
  right("ETA", Eta);
  left("STATE", StateOrReason);
  return table;
}

Listing ExperimentListing(std::span<const ExperimentStatus> experiments) {
  Listing listing;
  listing.columns = {"experiment", "name",  "state",     "priority",    "jobs",       "queued",  "leased",  "done",
                     "failed",     "dead",  "cancelled", "solved",      "submitter",  "dataset", "methods", "tags",
                     "share",      "eta_s", "elapsed_s", "waiting_for", "taken_over", "rule"};
  for (const auto& e : experiments) {
    listing.rows.push_back({e.id,
                            e.name,
                            StateText(e),
                            e.priority,
                            e.total,
                            e.queued,
                            e.leased,
                            e.done,
                            e.failed,
                            e.dead,
                            e.cancelled,
                            e.solved,
                            e.submitter,
                            e.dataset,
                            Joined(e.methods),
                            Joined(e.tags),
                            e.share,
                            e.eta_s ? nlohmann::json(*e.eta_s) : nlohmann::json(),
                            e.elapsed_s,
                            e.waiting_for,
                            e.taken_over,
                            ToString(e.rule)});
  }
  return listing;
}

Table WorkerTable(const nlohmann::json& workers) {
  Table table;
  const auto add = [&](const char* heading, Alignment alignment, const auto& text) {
    AddColumn(heading, alignment, workers, text, &table);
  };
  const auto field = [](const char* key) { return [key](const nlohmann::json& worker) { return Field(worker, key); }; };
  add("WORKER", Alignment::kRight, field("id"));
  add("NAME", Alignment::kLeft, field("name"));
  add("HOST", Alignment::kLeft, field("hostname"));
  add("SLOTS", Alignment::kRight, field("slots"));
  add("JOBS", Alignment::kRight, field("leases"));
  add("STATE", Alignment::kLeft, WorkerState);
  add("DATASETS", Alignment::kLeft, field("datasets"));
  add("PID", Alignment::kRight, field("pid"));
  add("BUILD", Alignment::kLeft, field("build_id"));
  add("LOAD", Alignment::kRight, Load);
  add("PROCESSOR", Alignment::kLeft, Processor);
  return table;
}

std::string UnlistedWorkers(const nlohmann::json& status) {
  const auto unlisted = status.value(nlohmann::json::json_pointer("/server/workers_not_listed"), std::int64_t{0});
  if (unlisted <= 0) return {};
  return "and " + std::to_string(unlisted) + (unlisted == 1 ? " worker" : " workers") + " that took no job yet\n";
}

}  // namespace legopt::client
