#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "legopt_msg/query_reply.hpp"
#include "legopt_msg/query_request.hpp"

namespace legopt::server {

/// Runs the SQL of clients on a read-only connection in a thread of its own, so that no query delays a lease.
///
/// Each query is bounded in rows, bytes and time: 30 s, unless its SQL begins with the comment
/// "/*+ MAX_EXECUTION_TIME(N) */" (N milliseconds, 1 .. 3,600,000). Three run at a time. One has a quarter of a second;
/// a query that needs more begins again behind the other slow ones, so that quick queries wait for quick ones only. One
/// has up to 30 s, and one the time that it asked for. At most `kMaxWaiting` of each kind wait. Thread rule: all
/// functions belong to the thread that made the service.
class QueryService {
 public:
  static constexpr std::size_t kMaxWaiting = 64;
  static constexpr std::chrono::milliseconds kDefaultLimit{30'000};
  static constexpr std::chrono::milliseconds kLongestLimit{3'600'000};

  /// `database` is opened at the first query, by the reader threads.
  explicit QueryService(std::filesystem::path database);
  /// Interrupts a running query.
  ~QueryService();
  QueryService(const QueryService&) = delete;
  QueryService& operator=(const QueryService&) = delete;

  /// False: too many are waiting.
  bool Start(std::int64_t ticket, legopt_msg::query_request request);

  struct Finished {
    std::int64_t ticket = 0;
    legopt_msg::query_reply reply;
  };
  /// Readable while TakeFinished has something to give.
  int descriptor() const;
  std::vector<Finished> TakeFinished();

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace legopt::server
