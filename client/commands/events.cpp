#include <chrono>
#include <iostream>
#include <memory>
#include <string>
#include <thread>

#include "app/command_line.h"
#include "app/printable.h"
#include "app/value_list.h"
#include "client/client_error.h"
#include "client/commands/commands.h"
#include "client/commands/options.h"
#include "client/report/listing.h"
#include "client/service/interrupt.h"
#include "db/named_queries.h"
#include "legopt/input/json.h"

namespace legopt::client {
namespace {

using Clock = std::chrono::steady_clock;

struct EventsOptions {
  std::optional<std::int64_t> experiment;
  std::vector<std::string> kinds;
  std::int64_t limit = 20;
  bool follow = false;
  std::optional<double> give_up_s;
  ListingOptions listing;
  SourceOptions source;
};

// Allows only characters that are safe in SQL.
std::string CheckKind(const std::string& kind) {
  const bool word = !kind.empty() && kind.find_first_not_of("abcdefghijklmnopqrstuvwxyz_,") == std::string::npos;
  return word ? std::string() : "is no kind of event; kinds are words such as worker_lost (docs/how-to/monitoring.md)";
}

Listing Read(ResultSource& source, const EventsOptions& options, std::int64_t after, std::int64_t limit) {
  std::vector<std::string> kinds;
  for (const std::string& list : options.kinds) {
    for (const std::string& kind : app::SplitValues(list)) kinds.push_back(kind);
  }
  return source.Query(
      db::Sql(db::Query::kLatestEvents,
              {{"after", after}, {"experiment_id", options.experiment}, {"kinds", kinds}, {"limit", limit}}));
}

std::int64_t LastOf(const Listing& events, std::int64_t before) {
  return events.rows.empty() ? before : events.At(events.rows.size() - 1, "event_id").get<std::int64_t>();
}

std::string LineOf(const Listing& events, std::size_t row) {
  std::string line = events.Text(row, "utc") + "  " + events.Text(row, "kind");
  for (const char* of : {"experiment", "job", "worker"}) {
    if (!events.At(row, of).is_null()) line += ", " + std::string(of) + " " + Dump(events.At(row, of));
  }
  const std::string detail = events.Text(row, "detail");
  return app::Printable(detail.empty() ? line : line + ": " + detail);
}

void PrintLines(const Listing& events, TableFormat format) {
  const nlohmann::ordered_json objects =
      format == TableFormat::kJson ? ListingToJson(events) : nlohmann::ordered_json();
  for (std::size_t row = 0; row < events.rows.size(); ++row) {
    std::cout << (format == TableFormat::kJson ? Dump(objects.at(row)) : LineOf(events, row)) << std::endl;
  }
}

// Retries if a server does not answer for a while.
ExitCode Follow(ResultSource& source, const EventsOptions& options, std::int64_t last) {
  using namespace std::chrono_literals;
  constexpr std::int64_t kAtOnce = 1000;
  Clock::time_point moved = Clock::now();
  const auto give_up = GiveUpOf(options.give_up_s);
  while (!Interrupted()) {
    Listing news;
    try {
      news = Read(source, options, last, kAtOnce);
    } catch (const ClientError& error) {
      if (error.code() != ExitCode::kUnreachable) throw;
    }
    if (!news.rows.empty()) moved = Clock::now();
    PrintLines(news, options.listing.format);
    last = LastOf(news, last);
    if (give_up && Clock::now() - moved >= *give_up) {
      throw ClientError(ExitCode::kNoProgress, "no event for the time of --give-up");
    }
    for (int i = 0; i < 10 && !Interrupted(); ++i) std::this_thread::sleep_for(100ms);
  }
  return ExitCode::kInterrupted;
}

ExitCode Events(const EventsOptions& options) {
  const bool lines = options.listing.format == TableFormat::kText || options.listing.format == TableFormat::kJson;
  if (options.follow && !lines) {
    throw ClientError(ExitCode::kUsage, "--follow prints text or json, one event per line");
  }
  if (options.follow && !options.listing.rows.empty()) {
    throw ClientError(ExitCode::kUsage, "--rows selects rows of a finished table; give --limit N with --follow");
  }
  const InterruptGuard guard;
  const auto source = OpenResults(options.source);
  const Listing events = Read(*source, options, 0, options.limit);
  if (!options.follow) {
    PrintListing(events, options.listing);
    return ExitCode::kOk;
  }
  PrintLines(events, options.listing.format);
  return Follow(*source, options, LastOf(events, 0));
}

}  // namespace

void AddEventsCommand(const app::Command& program, Invocation* invocation) {
  constexpr std::int64_t kMost = 1'000'000;
  const auto command =
      program.AddCommand("events", "List events: workers lost, jobs dead, disk low, experiments finished");
  const auto options = std::make_shared<EventsOptions>();
  command.AddOption("ID", options->experiment, "Only events of this experiment").Check(app::WholeNumber(1));
  command.AddOption("--kind", options->kinds, "Only these kinds, with commas between them: docs/how-to/monitoring.md")
      .Check({CheckKind, ""});
  command.AddOption("--limit", options->limit, "Number of events, the newest ones (default 20)")
      .Check(app::WholeNumber(0, kMost));
  command.AddFlag("--follow", options->follow, "Print new events as they occur, one per line, until Ctrl-C");
  AddGiveUpOption(command, &options->give_up_s);
  AddListingOptions(command, &options->listing);
  AddSourceOptions(command, &options->source);
  command.WhenChosen([=] { invocation->body = [options] { return Events(*options); }; });
}

}  // namespace legopt::client
