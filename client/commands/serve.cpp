#include <chrono>
#include <iostream>
#include <memory>
#include <thread>

#include "app/checks.h"
#include "app/command_line.h"
#include "app/isolated_call.h"
#include "app/printable.h"
#include "client/client_error.h"
#include "client/commands/commands.h"
#include "client/commands/options.h"
#include "client/commands/page_datasets.h"
#include "client/serve/http_server.h"
#include "client/serve/live_blocks.h"
#include "client/serve/live_state.h"
#include "client/serve/monitoring.h"
#include "client/service/interrupt.h"
#include "client/suite/chosen_files.h"
#include "legopt/types/number_text.h"

namespace legopt::client {
namespace {

constexpr int kDefaultPort = 8711;
constexpr int kLargestPort = 65535;
constexpr char kState[] = "/state";

struct ServeOptions {
  std::vector<std::string> experiments, datasets;
  std::string address = "127.0.0.1";
  int port = kDefaultPort;
  std::vector<std::string> hosts;
  std::optional<Rule> rule;
  SourceOptions source;
  app::BuildFacts build;
};

FigureRequest FiguresOf(const ServeOptions& options) {
  FigureRequest request;
  request.build = options.build;
  for (const std::string& experiment : options.experiments) {
    request.sources.push_back({options.source, *ParseInteger<std::int64_t>(experiment)});
  }
  if (request.sources.empty()) request.sources.push_back({options.source, std::nullopt});
  request.datasets = LoadPageDatasets(request.sources, options.datasets);
  request.rule = PageRule(request.sources, options.rule);
  return request;
}

HttpReply StateReply(const LiveState& state) {
  HttpReply reply;
  reply.type = "application/json";
  reply.body = state.text();
  return reply;
}

// Reads the state while it is watched, using at most a twentieth of the time. A request counts as watching for 10 s.
class Watching {
 public:
  Watching(LiveState* state, HttpServer* server) : state_(state), server_(server) {}

  void Step() {
    using namespace std::chrono_literals;
    const auto now = Clock::now();
    if (server_->requests() != requests_) {
      requests_ = server_->requests();
      last_request_ = now;
    }
    const bool watched = server_->streams() > 0 || now - last_request_ < 10s;
    if (watched && now >= next_read_) {
      const double now_s = std::chrono::duration<double>(now.time_since_epoch()).count();
      if (state_->Read(now_s)) server_->Publish(state_->version(), *state_->text());
      const auto took = Clock::now() - now;
      next_read_ = now + std::max<Clock::duration>(1s, 20 * took);
    }
    if (now >= next_beat_) {
      server_->Beat();
      next_beat_ = now + 15s;
    }
  }

 private:
  using Clock = std::chrono::steady_clock;
  LiveState* state_;
  HttpServer* server_;
  std::uint64_t requests_ = 0;
  Clock::time_point last_request_{}, next_read_{}, next_beat_{};
};

ExitCode Serve(const ServeOptions& options) {
  using namespace std::chrono_literals;
  const InterruptGuard guard;
  const FigureRequest figures = FiguresOf(options);
  LiveState state(options.source, figures.rule);
  state.Read(0);
  LiveBlocks blocks(figures);
  HttpOptions http;
  http.address = options.address;
  http.port = static_cast<std::uint16_t>(options.port);
  http.hosts = options.hosts;
  HttpServer server(
      http,
      [&](const HttpRequest& request) {
        if (Monitoring::Answers(request.path)) return std::optional<HttpReply>();  // slow: calls the server
        return request.path == kState ? std::optional(StateReply(state)) : blocks.TryAnswer(request);
      },
      [&](const HttpRequest& request) {
        return Monitoring::Answers(request.path) ? Monitoring(options.source).Answer(request) : blocks.Make(request);
      });
  server.Publish(state.version(), *state.text());
  std::cout << server.url() << std::endl;
  std::cerr << "legopt: serves " << (options.source.db ? app::Printable(*options.source.db) : "the server")
            << " until interrupted (Ctrl-C)\n";
  Watching watching(&state, &server);
  while (!Interrupted()) {
    watching.Step();
    std::this_thread::sleep_for(100ms);
  }
  return ExitCode::kOk;
}

}  // namespace

void AddServeCommand(const app::Command& program, Invocation* invocation) {
  const auto command = program.AddCommand("serve", "Serve the page of 'legopt report' to browsers, with live data");
  const auto options = std::make_shared<ServeOptions>();
  command.AddOption("EXPERIMENT", options->experiments, "Shown first, beside each other (default: the newest)")
      .Check(app::WholeNumber(1));
  command
      .AddOption("--http-port", options->port, "TCP port (default " + std::to_string(kDefaultPort) + "; 0: a free one)")
      .Check(app::WholeNumber(0, kLargestPort));
  command.AddOption(
      "--http-address", options->address,
      "Address to listen on (default 127.0.0.1: only this machine). Any host that can reach it can read all results");
  command.AddList(
      "--http-host", options->hosts,
      "Host names that browsers may use in addition to the address and localhost; repeat it, or use commas");
  command.AddList("--dataset", options->datasets,
                  "Dataset folder for the 3D view (default: the embedded one); several: repeat it, or use commas",
                  app::IsExistingPath);
  AddRuleOption(command, &options->rule);
  AddSourceOptions(command, &options->source);
  command.SetFooter(
      "Prints its address; Ctrl-C ends it with exit code 0. How to read the page: docs/how-to/page.md. /healthz and "
      "/metrics are for monitoring: docs/how-to/monitoring.md");
  command.WhenChosen([=] {
    options->build = invocation->build;
    invocation->body = [options] { return Serve(*options); };
  });
}

}  // namespace legopt::client
