#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "bus/transport.h"
#include "legopt_msg/query_reply.hpp"
#include "legopt_msg/query_request.hpp"

namespace legopt::server {

/// Runs the SQL of clients on read-only connections in threads of its own, so that no query delays a lease.
///
/// Each query is bounded in rows, bytes and time: 30 s, unless its SQL begins with the comment
/// "/*+ MAX_EXECUTION_TIME(N) */" (N milliseconds, 1 .. 3,600,000).
///
/// Queries move through five lanes, each with one thread: 10 ms, 100 ms, 1 s, up to 30 s, and more than 30 s. A query
/// starts in the first lane. A query that needs more time than its lane gives starts again in the next one. So a query
/// waits only for queries that take about as long as itself.
///
/// Senders take turns in each lane. At most `kMostRunningOfSender` queries of one sender run at once, and at most
/// `kMostOfSender` wait or run; in all, at most `kMostWaiting` queries wait in a lane and `kMostWaitingBytes` of SQL.
///
/// Thread rule: all functions belong to the thread that made the service.
class QueryService {
 public:
  static constexpr std::size_t kMostWaiting = 64;         ///< queries waiting in one lane
  static constexpr std::size_t kMostOfSender = 16;        ///< queries of one sender, waiting and running
  static constexpr std::size_t kMostRunningOfSender = 2;  ///< queries of one sender that run at once
  static constexpr std::size_t kMostWaitingBytes = std::size_t{4} << 20;  ///< SQL of all queries, waiting and running
  static constexpr std::chrono::milliseconds kDefaultLimit{30'000};
  static constexpr std::chrono::milliseconds kLongestLimit{3'600'000};

  /// `database` is opened at the first query, by the reader threads.
  explicit QueryService(std::filesystem::path database);
  /// Interrupts the running queries.
  ~QueryService();
  QueryService(const QueryService&) = delete;
  QueryService& operator=(const QueryService&) = delete;

  /// Takes a query. Returns why it is refused, with the limit that it exceeds; empty: taken.
  std::string Start(std::int64_t ticket, bus::EndpointId sender, legopt_msg::query_request request);

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
