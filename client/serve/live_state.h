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
#include "legopt/types/check.h"

namespace legopt::client {

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
