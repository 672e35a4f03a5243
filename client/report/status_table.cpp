#include "client/report/status_table.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <utility>
#include <vector>

#include "app/printable.h"
#include "client/report/progress.h"
#include "client/report/text_layout.h"
#include "legopt/input/json.h"
#include "legopt/types/number_text.h"

namespace legopt::client {
namespace {

constexpr double kPercent = 100;
constexpr std::size_t kLongestName = 20, kLongestSubmitter = 12, kLongestMethods = 40;

// A column of a text table. It is omitted if no row has a value.
struct Column {
  std::string title;
  bool right_aligned = false;
  std::vector<std::string> cells;
};

std::string Cut(const std::string& text, std::size_t width) {
  if (DisplayWidth(text) <= width) return text;
  constexpr std::size_t kDots = 3;
  std::string cut;
  // Whole characters only: bytes 10xxxxxx continue a character.
  for (std::size_t i = 0; i < text.size();) {
    std::size_t end = i + 1;
    while (end < text.size() && (static_cast<unsigned char>(text[end]) & 0xC0U) == 0x80U) ++end;
    if (DisplayWidth(cut) + kDots >= width) break;
    cut.append(text, i, end - i);
    i = end;
  }
  return cut + "...";
}

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

template <class Rows, class Cell>
Column MakeColumn(const std::string& title, bool right_aligned, const Rows& rows, const Cell& cell) {
  Column column{title, right_aligned, {}};
  for (const auto& row : rows) column.cells.push_back(app::Printable(cell(row)));
  return column;
}

// Returns one text per line of the table, titles first; columns without any value are omitted, missing values are "-".
std::vector<std::string> Lines(std::vector<Column> columns) {
  std::erase_if(columns, [](const Column& column) {
    return std::all_of(column.cells.begin(), column.cells.end(), [](const std::string& cell) { return cell.empty(); });
  });
  std::vector<std::vector<std::string>> rows(columns.empty() ? 0 : columns.front().cells.size() + 1);
  std::vector<bool> right;
  for (const Column& column : columns) {
    rows[0].push_back(column.title);
    for (std::size_t i = 0; i < column.cells.size(); ++i) {
      rows[i + 1].push_back(column.cells[i].empty() ? "-" : column.cells[i]);
    }
    right.push_back(column.right_aligned);
  }
  const std::string text = AlignColumns(rows, right);
  std::vector<std::string> lines;
  for (std::size_t from = 0; from < text.size();) {
    const std::size_t end = text.find('\n', from);
    lines.push_back(text.substr(from, end - from));
    from = end + 1;
  }
  return lines;
}

bool Fit(const std::vector<std::string>& lines, std::size_t width) {
  return width == 0 || std::all_of(lines.begin(), lines.end(),
                                   [width](const std::string& line) { return DisplayWidth(line) <= width; });
}

// Returns an empty text for the default rule, so that the column appears only for other rules.
std::string WeakerRule(const ExperimentStatus& status) {
  return status.rule == Rule::kSolid ? "" : std::string(ToString(status.rule));
}

std::vector<std::string> WideExperiments(std::span<const ExperimentStatus> list) {
  using S = const ExperimentStatus&;
  return Lines({MakeColumn("ID", true, list, [](S s) { return std::to_string(s.id); }),
                MakeColumn("NAME", false, list, [](S s) { return s.name; }),
                MakeColumn("BY", false, list, [](S s) { return s.submitter; }),
                MakeColumn("DATASET", false, list, [](S s) { return s.dataset; }),
                MakeColumn("METHODS", false, list, ShortMethods),
                MakeColumn("TAGS", false, list, [](S s) { return Joined(s.tags); }),
                MakeColumn("PRIORITY", true, list,
                           [](S s) { return s.priority == 0 ? std::string() : std::to_string(s.priority); }),
                MakeColumn("JOBS", true, list, Jobs),
                MakeColumn("SOLVED", true, list, [](S s) { return std::to_string(s.solved); }),
                MakeColumn("RULE", false, list, WeakerRule), MakeColumn("TAKEN", true, list, TakenOver),
                MakeColumn("SHARE", true, list, Share), MakeColumn("ETA", true, list, Eta),
                MakeColumn("STATE", false, list, StateOrReason)});
}

// Returns the properties that do not fit on the narrow line of an experiment.
std::string Details(const ExperimentStatus& status) {
  std::vector<std::string> parts;
  if (!status.dataset.empty()) parts.push_back(status.dataset);
  if (!status.methods.empty()) parts.push_back(ShortMethods(status));
  if (!status.tags.empty()) parts.push_back("tags " + Joined(status.tags));
  if (status.priority != 0) parts.push_back("priority " + std::to_string(status.priority));
  std::string text;
  for (const std::string& part : parts) text += (text.empty() ? "" : "; ") + part;
  return text;
}

std::vector<std::string> NarrowExperiments(std::span<const ExperimentStatus> list) {
  using S = const ExperimentStatus&;
  return Lines({MakeColumn("ID", true, list, [](S s) { return std::to_string(s.id); }),
                MakeColumn("NAME", false, list, [](S s) { return Cut(s.name, kLongestName); }),
                MakeColumn("BY", false, list, [](S s) { return Cut(s.submitter, kLongestSubmitter); }),
                MakeColumn("JOBS", true, list, Jobs),
                MakeColumn("SOLVED", true, list, [](S s) { return std::to_string(s.solved); }),
                MakeColumn("RULE", false, list, WeakerRule), MakeColumn("TAKEN", true, list, TakenOver),
                MakeColumn("SHARE", true, list, Share), MakeColumn("ETA", true, list, Eta),
                MakeColumn("STATE", false, list, StateOrReason)});
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

std::string RenderExperiments(std::span<const ExperimentStatus> experiments, std::size_t width) {
  constexpr std::size_t kLeast = 40;
  const std::size_t limit = width == 0 ? 0 : std::max(width, kLeast);
  std::string text;
  if (const auto wide = WideExperiments(experiments); Fit(wide, limit)) {
    for (const std::string& line : wide) text += line + "\n";
    return text;
  }
  const auto lines = NarrowExperiments(experiments);
  for (std::size_t i = 0; i < lines.size(); ++i) {
    text += Cut(lines[i], limit) + "\n";
    if (i == 0 || experiments[i - 1].over()) continue;
    if (const std::string details = Details(experiments[i - 1]); !details.empty()) {
      text += Cut("      " + app::Printable(details), limit) + "\n";
    }
  }
  return text;
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

std::string RenderWorkers(const nlohmann::json& workers, std::size_t width) {
  using W = const nlohmann::json&;
  const auto field = [](const char* key) { return [key](W worker) { return Field(worker, key); }; };
  std::vector<Column> columns = {
      MakeColumn("WORKER", true, workers, field("id")),         MakeColumn("NAME", false, workers, field("name")),
      MakeColumn("HOST", false, workers, field("hostname")),    MakeColumn("SLOTS", true, workers, field("slots")),
      MakeColumn("JOBS", true, workers, field("leases")),       MakeColumn("STATE", false, workers, WorkerState),
      MakeColumn("DATASETS", false, workers, field("datasets"))};
  std::vector<Column> all = columns;
  all.push_back(MakeColumn("PID", true, workers, field("pid")));
  all.push_back(MakeColumn("BUILD", false, workers, field("build_id")));
  all.push_back(MakeColumn("LOAD", true, workers, Load));
  all.push_back(MakeColumn("PROCESSOR", false, workers, Processor));
  std::vector<std::string> lines = Lines(std::move(all));
  if (!Fit(lines, width)) lines = Lines(std::move(columns));
  std::string text;
  for (const std::string& line : lines) text += (width == 0 ? line : Cut(line, width)) + "\n";
  return text;
}

}  // namespace legopt::client
