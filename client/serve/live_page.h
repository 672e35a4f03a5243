#pragma once

#include <chrono>
#include <cstdint>
#include <deque>
#include <list>
#include <map>
#include <memory>
#include <mutex>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "client/page/page.h"
#include "client/report/result_source.h"
#include "client/serve/http_server.h"
#include "client/service/server_connection.h"
#include "legopt/judge/internal/waypoint_inspector.h"
#include "legopt/types/check.h"

namespace legopt::client {

/// The blocks of a page (docs/reference/page-data.md), created on request of a browser: figures of experiments,
/// geometry, and one solution at a time. Thread rule: any thread.
class LiveBlocks {
 public:
  /// `request.sources`: experiments shown by default; all must be in the same server or file.
  /// `rule`: the rule of all figures; nullopt: PageRule of the shown experiments, in place of `request.rule`.
  explicit LiveBlocks(FigureRequest request, std::optional<Rule> rule = {});

  /// Returns the page, its script, or an available block; nullopt for slow requests. Never waits for Make.
  std::optional<HttpReply> TryAnswer(const HttpRequest& request);
  /// Creates the requested block; status 404 if it does not exist.
  HttpReply Make(const HttpRequest& request);

 private:
  struct Figures {
    HttpReply reply;
    std::string progress;  // state of the experiments at that time
    std::chrono::steady_clock::time_point made;
    std::chrono::steady_clock::duration took{};
  };

  HttpReply MakeFigures(const std::string& experiments);
  HttpReply MakeSolution(const std::string& block, std::int64_t job);
  HttpReply MakePlayback(const std::string& block, std::int64_t job);
  std::shared_ptr<const Dataset> DatasetOf(const ViewedJob& viewed) const;  ///< null if it was not found
  std::vector<PageSource> SourcesOf(const std::string& experiments) const;
  HttpReply Keep(const std::string& name, const std::string& bytes);
  HttpReply BlockReply(const std::string& bytes);

  FigureRequest request_;
  std::optional<Rule> rule_;
  std::string start_;  // part of every ETag: another process has other blocks

  std::mutex figures_mutex_;  // held while figures are computed
  std::map<std::string, Figures> figures_;

  std::mutex playback_mutex_;  // held while a time law is computed; locked before solutions_mutex_

  std::mutex solutions_mutex_;  // held while a solution is judged
  std::unique_ptr<ResultSource> source_;
  std::map<std::string, std::unique_ptr<WaypointInspector>> listers_;  // key: dataset hash

  std::mutex kept_mutex_;  // held only briefly
  std::map<std::string, HttpReply> kept_;
  std::list<std::string> order_;  // keys of kept_, oldest first
  std::size_t kept_bytes_ = 0;
  std::uint64_t serial_ = 0;
};

/// The changing state of the experiments of a server or database (docs/reference/page-data.md, "Live"). Thread rule:
/// one thread calls Read; text() may be called from any thread.
class LiveState {
 public:
  /// Failures are judged by `rule`. Throws the errors of OpenResults.
  LiveState(const SourceOptions& source, Rule rule);

  /// Reads the state again; returns true if it has changed. A read error is stored in the member "error" of the text,
  /// and the next call retries. `now_s`: seconds of a monotonic clock.
  bool Read(double now_s);

  std::shared_ptr<const std::string> text() const;    ///< JSON on one line
  std::uint64_t version() const { return version_; }  ///< version of the text

 private:
  struct Sample {
    double at_s = 0;
    std::int64_t finished = 0;
  };

  nlohmann::ordered_json ReadAll(double now_s);
  nlohmann::ordered_json ExperimentsOfFile();
  nlohmann::ordered_json WorkersOfFile();
  void ReadFailures();
  nlohmann::ordered_json ReadEvents();
  void AddRates(double now_s, nlohmann::ordered_json* experiments);

  SourceOptions options_;
  Rule rule_;
  std::unique_ptr<ResultSource> source_;
  std::unique_ptr<ServerConnection> server_;                           // nullptr if the source is a file
  std::map<std::int64_t, std::deque<Sample>> seen_;                    // samples of the last minute; key: experiment
  nlohmann::ordered_json failures_ = nlohmann::ordered_json::array();  // newest first
  std::int64_t failures_until_us_ = 0;
  std::uint64_t version_ = 0;
  mutable std::mutex mutex_;
  std::shared_ptr<const std::string> text_;
};

}  // namespace legopt::client
