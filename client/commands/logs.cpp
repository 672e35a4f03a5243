#include <cstring>
#include <memory>

#include "app/checks.h"
#include "app/command_line.h"
#include "app/printable.h"
#include "client/client_error.h"
#include "client/commands/commands.h"
#include "client/commands/options.h"
#include "client/report/attempt_list.h"
#include "client/report/json_text.h"
#include "db/named_queries.h"
#include "legopt/input/json.h"
#include "legopt/types/job.h"

namespace legopt::client {
namespace {

struct LogsOptions {
  std::int64_t job = 0;
  bool json = false;
  SourceOptions source;
  OutputOptions output;
};

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

ExitCode Logs(const LogsOptions& options) {
  const auto source = OpenResults(options.source);
  const std::string id = std::to_string(options.job);
  const Listing job = source->Query(db::Sql(db::Query::kJobHeading, {{"job_id", options.job}}));
  if (job.rows.empty()) {
    throw ClientError(ExitCode::kUsage, "there is no job " + id + "; 'legopt list" + source->flags() + "' lists them");
  }
  const Listing attempts = ReadAttempts(*source, options.job);
  const Listing events = ReadEvents(*source, options.job);
  if (options.json) {
    auto json = ListingToJson(job).at(0);
    json["attempt_list"] = ListingToJson(attempts);
    json["events"] = ListingToJson(events);
    Print(JsonText(json) + "\n", options.output);
    return ExitCode::kOk;
  }
  const TextLayout layout = LayoutOf(options.output);
  std::string text = RenderFields(job, 0, layout);
  for (std::size_t i = 0; i < attempts.rows.size(); ++i) text += AttemptText(attempts, i);
  if (attempts.rows.empty()) text += "\nNo attempt has been begun.\n";
  if (!events.rows.empty()) text += "\nEvents\n" + RenderListing(events, ListingFormat::kText, layout);
  Print(text, options.output);
  return ExitCode::kOk;
}

}  // namespace

void AddLogsCommand(const app::Command& program, Invocation* invocation) {
  const auto command = program.AddCommand("logs", "Show the attempts of a job: causes, signals, logs");
  const auto options = std::make_shared<LogsOptions>();
  command.AddOption("JOB", options->job, "Job, as 'legopt list' shows it").Required().Check(app::WholeNumber(1));
  AddTextOrJsonOption(command, &options->json);
  AddOutputOptions(command, &options->output);
  AddSourceOptions(command, &options->source);
  command.WhenChosen([=] { invocation->body = [options] { return Logs(*options); }; });
}

}  // namespace legopt::client
