#include "client/commands/show.h"

#include <cstdint>
#include <cstring>
#include <iostream>
#include <limits>
#include <memory>

#include "app/command_line.h"
#include "app/printable.h"
#include "client/client_error.h"
#include "client/commands/commands.h"
#include "client/commands/options.h"
#include "client/replay/stored_job.h"
#include "client/report/escaped_text.h"
#include "client/report/result_source.h"
#include "client/report/violation_list.h"
#include "db/named_queries.h"
#include "db/result_record.h"
#include "legopt/dataset/internal/text_file.h"
#include "legopt/input/json.h"
#include "legopt/types/input_error.h"
#include "legopt/types/job.h"

namespace legopt::client {
namespace {

// Parses a column that contains JSON as text.
nlohmann::ordered_json ParseText(const nlohmann::json& cell) {
  if (!cell.is_string()) return nullptr;
  try {
    return ParseOrderedJson(cell.get<std::string>(), "");
  } catch (const InputError&) {
    return nlohmann::ordered_json(cell);
  }
}

std::string RenderText(const Listing& job, const Listing& result, const Listing& violations, const Listing& attempts,
                       const TextLayout& layout) {
  std::string text = RenderFields(job, 0, layout);
  text += "\nResult\n" + (result.rows.empty() ? "none\n" : RenderFields(result, 0, layout));
  if (!violations.rows.empty()) text += "\nChecks\n" + RenderListing(violations, TableFormat::kText, layout);
  Listing table = attempts;
  table.columns.pop_back();
  for (auto& row : table.rows) row.pop_back();
  text += "\nAttempts\n" + (table.rows.empty() ? "none\n" : RenderListing(table, TableFormat::kText, layout));
  for (std::size_t i = 0; i < attempts.rows.size(); ++i) {
    const auto& tail = attempts.At(i, "log_tail");
    if (!tail.is_string() || tail.get<std::string>().empty()) continue;
    text += "\nLog of attempt " + Dump(attempts.At(i, "attempt")) + "\n" +
            app::PrintableLines(tail.get<std::string>()) + "\n";
  }
  return text;
}

ExitCode ShowJob(const ShowOptions& options) {
  const auto source = OpenResults(options.source);
  const std::string id = std::to_string(options.job);
  const Listing job = source->Query(db::Sql(db::Query::kJobDetails, {{"job_id", options.job}}));
  if (job.rows.empty()) {
    throw ClientError(ExitCode::kUsage, "there is no job " + id + "; 'legopt list" + source->flags() + "' lists them");
  }
  const Listing result = source->Query("SELECT " + db::ShownResultColumns() + " FROM results WHERE job_id = " + id);
  const Listing violations = ReadViolations(*source, options.job);
  const Listing attempts = ReadAttempts(*source, options.job);
  if (options.listing.format != TableFormat::kJson) {
    Print(RenderText(job, result, violations, attempts, LayoutOf(options.listing.output)), options.listing.output);
    return ExitCode::kOk;
  }
  auto json = ListingToJson(job).at(0);
  for (const char* column : {"method_options", "joint_names"}) json[column] = ParseText(job.At(0, column));
  json["result"] = result.rows.empty() ? nlohmann::ordered_json() : ListingToJson(result).at(0);
  json["violations"] = ListingToJson(violations);
  json["attempt_list"] = ListingToJson(attempts);
  Print(JsonText(json) + "\n", options.listing.output);
  return ExitCode::kOk;
}

// Refuses options that only --trace uses.
void RequireTrace(const ShowOptions& options) {
  const auto refuse = [](const std::string& option) {
    throw ClientError(ExitCode::kUsage, option + " is possible only with --trace");
  };
  if (options.out) refuse("--out");
  if (!options.listing.rows.empty()) refuse("--rows");
  if (!options.listing.columns.empty()) refuse("--columns");
  if (options.listing.format == TableFormat::kMarkdown) refuse("--format markdown");
  if (options.listing.format == TableFormat::kCsv) refuse("--format csv");
}

// Returns the job that is named, or that the options choose.
std::int64_t JobOf(const ShowOptions& options) {
  const JobChoice& choice = options.choice;
  const bool chooses = choice.experiment || choice.problem || !choice.filter.empty();
  if (options.named.has_value() == chooses) {
    throw ClientError(
        ExitCode::kUsage,
        "name a job or choose one by options: 'legopt show 12' or 'legopt show --methods SQP --problem 3'");
  }
  return options.named ? *options.named : ChooseJob(*OpenResults(options.source), choice);
}

ExitCode Show(ShowOptions options) {
  options.job = JobOf(options);
  if (options.trace) return ShowTrace(options);
  RequireTrace(options);
  return options.logs ? ShowLogs(options) : ShowJob(options);
}

}  // namespace

void AddShowCommand(const app::Command& program, Invocation* invocation) {
  const auto command = program.AddCommand("show", "Show one job: result, verdicts, attempts, logs, convergence");
  const auto options = std::make_shared<ShowOptions>();
  command.AddOption("JOB", options->named, "Job, as 'legopt list' shows it").Check(app::WholeNumber(1));
  AddJobChoiceOptions(command, &options->choice);
  command.AddOption("--problem", options->choice.problem, "Choose a job of this problem").Check(app::WholeNumber(0));
  const auto logs = command.AddFlag("--logs", options->logs, "Show only the attempts: causes, signals, logs, events");
  command.AddFlag("--trace", options->trace, "Show only how the solve converged, step by step").Excludes(logs);
  command.AddOption("--out", options->out, "Write the trace to this file, replacing an existing one");
  AddListingOptions(command, &options->listing);
  AddSourceOptions(command, &options->source);
  command.SetFooter("--out, --rows, --columns and the formats markdown and csv are for --trace.");
  command.WhenChosen([=] { invocation->body = [options] { return Show(*options); }; });
}

namespace {

// Returns e.g. "crashed by signal 11 (Segmentation fault) after 3.2 s".
std::string CauseOf(const Listing& attempts, std::size_t row) {
  std::string text(ToString(attempts.EnumAt<AttemptOutcome>(row, "outcome")));
  if (const auto& number = attempts.At(row, "exit_signal"); !number.is_null()) {
    text += " by signal " + Dump(number) + " (" + ::strsignal(number.get<int>()) + ")";
  }
  if (const auto& seconds = attempts.At(row, "seconds"); !seconds.is_null())
    text += " after " + ShownValue(seconds) + " s";
  return text;
}

std::string Indented(const std::string& lines) {
  std::string text;
  std::size_t begin = 0;
  while (begin < lines.size()) {
    const std::size_t end = std::min(lines.find('\n', begin), lines.size());
    text += "  | " + lines.substr(begin, end - begin) + "\n";
    begin = end + 1;
  }
  return text;
}

std::string AttemptText(const Listing& attempts, std::size_t row) {
  std::string text = "\nAttempt " + Dump(attempts.At(row, "attempt")) + ": " + CauseOf(attempts, row) + "\n";
  text += "  begun " + attempts.Text(row, "leased_utc") + " UTC by " + attempts.Text(row, "worker") + " on " +
          attempts.Text(row, "hostname") + ", build " + ShownValue(attempts.At(row, "build")) + "\n";
  if (const std::string message = attempts.Text(row, "message"); !message.empty()) text += "  " + message + "\n";
  const std::string log = attempts.Text(row, "log_tail");
  return app::PrintableLines(text) +
         (log.empty() ? "  wrote nothing to its log\n" : Indented(app::PrintableLines(log)));
}

Listing ReadEvents(ResultSource& source, std::int64_t job_id) {
  return source.Query(db::Sql(db::Query::kEventsOfJob, {{"job_id", job_id}}));
}

}  // namespace

ExitCode ShowLogs(const ShowOptions& options) {
  const auto source = OpenResults(options.source);
  const std::string id = std::to_string(options.job);
  const Listing job = source->Query(db::Sql(db::Query::kJobHeading, {{"job_id", options.job}}));
  if (job.rows.empty()) {
    throw ClientError(ExitCode::kUsage, "there is no job " + id + "; 'legopt list" + source->flags() + "' lists them");
  }
  const Listing attempts = ReadAttempts(*source, options.job);
  const Listing events = ReadEvents(*source, options.job);
  if (options.listing.format == TableFormat::kJson) {
    auto json = ListingToJson(job).at(0);
    json["attempt_list"] = ListingToJson(attempts);
    json["events"] = ListingToJson(events);
    Print(JsonText(json) + "\n", options.listing.output);
    return ExitCode::kOk;
  }
  const TextLayout layout = LayoutOf(options.listing.output);
  std::string text = RenderFields(job, 0, layout);
  for (std::size_t i = 0; i < attempts.rows.size(); ++i) text += AttemptText(attempts, i);
  if (attempts.rows.empty()) text += "\nNo attempt has been begun.\n";
  if (!events.rows.empty()) text += "\nEvents\n" + RenderListing(events, TableFormat::kText, layout);
  Print(text, options.listing.output);
  return ExitCode::kOk;
}

ExitCode ShowTrace(const ShowOptions& options) {
  const StoredTrace trace = ReadTrace(*OpenResults(options.source), options.job);
  const Listing listing = trace.records.empty() ? trace.history : TraceListing(trace.records);
  if (options.out) {
    const Table kept = SelectedPart(TableOf(listing), options.listing);
    WriteTextFile(*options.out, RenderTable(kept, options.listing.format));
    std::cerr << kept.rows.size() << " records written to " << app::Printable(*options.out) << "\n";
  } else {
    PrintListing(listing, options.listing);
  }
  if (trace.records.empty()) {
    std::cerr << "legopt: this result is older than traces: a row per penalty value, without times and evaluations\n";
  }
  return ExitCode::kOk;
}

}  // namespace legopt::client
