#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <mutex>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "client/report/result_source.h"
#include "client/service/server_connection.h"
#include "words/result.h"

namespace legopt::client {

/// How far the experiments of a server or a database are: what changes while a page is looked at (docs/page-data.md,
/// "Live"). Thread rule: one thread reads; text() may be called from any.
class LiveState {
 public:
  /// Failures are those of `rule`. Errors as of OpenResults.
  LiveState(const SourceOptions& source, Rule rule);

  /// Looks again; true when there is news. What cannot be read becomes the member "error" of the text, and is tried
  /// again next time. `now_s`: seconds of a clock that never falls.
  bool Read(double now_s);

  std::shared_ptr<const std::string> text() const;    ///< JSON in one line
  std::uint64_t version() const { return version_; }  ///< of the text

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
  std::unique_ptr<ServerConnection> server_;                           // null: a file
  std::map<std::int64_t, std::deque<Sample>> seen_;                    // by experiment, of the last minute
  nlohmann::ordered_json failures_ = nlohmann::ordered_json::array();  // newest first
  std::int64_t failures_until_us_ = 0;
  std::uint64_t version_ = 0;
  mutable std::mutex mutex_;
  std::shared_ptr<const std::string> text_;
};

}  // namespace legopt::client
