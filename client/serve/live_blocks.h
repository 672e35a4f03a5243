#pragma once

#include <chrono>
#include <cstdint>
#include <list>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "client/page/page_figures.h"
#include "client/serve/http_server.h"
#include "legopt/judge/waypoint_inspector.h"

namespace legopt::client {

/// The blocks of a page (docs/reference/page-data.md), created on request of a browser: figures of experiments,
/// geometry, and one solution at a time. Thread rule: any thread.
class LiveBlocks {
 public:
  /// `request.sources`: experiments shown by default; all must be in the same server or file.
  explicit LiveBlocks(FigureRequest request);

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
  std::vector<PageSource> SourcesOf(const std::string& experiments) const;
  HttpReply Keep(const std::string& name, const std::string& bytes);
  HttpReply BlockReply(const std::string& bytes);

  FigureRequest request_;
  std::string start_;  // part of every ETag: another process has other blocks

  std::mutex figures_mutex_;  // held while figures are computed
  std::map<std::string, Figures> figures_;

  std::mutex solutions_mutex_;  // held while a solution is judged
  std::unique_ptr<ResultSource> source_;
  std::map<std::string, std::unique_ptr<WaypointInspector>> listers_;  // key: dataset hash

  std::mutex kept_mutex_;  // held only briefly
  std::map<std::string, HttpReply> kept_;
  std::list<std::string> order_;  // keys of kept_, oldest first
  std::size_t kept_bytes_ = 0;
  std::uint64_t serial_ = 0;
};

}  // namespace legopt::client
