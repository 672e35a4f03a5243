#include <cstring>

#include "app/printable.h"
#include "client/client_error.h"
#include "client/commands/show.h"
#include "client/report/attempt_list.h"
#include "client/report/json_text.h"
#include "db/named_queries.h"
#include "legopt/input/json.h"
#include "legopt/types/job.h"

namespace legopt::client {
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

}  // namespace legopt::client
