#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <functional>
#include <list>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "bus/transport.h"
#include "legopt_msg/query_reply.hpp"
#include "legopt_msg/query_request.hpp"

namespace legopt::server {

/// A client's query that waits for a reader.
struct WaitingQuery {
  std::int64_t ticket = 0;
  bus::EndpointId sender = 0;
  legopt_msg::query_request request;
  std::chrono::milliseconds limit{};  ///< execution time limit
};

/// A round-robin queue of queries: the queries of a sender stay in order, and after each query the next sender is
/// served. Memory: no state is kept for senders without waiting queries.
///
/// Thread rule: one thread at a time.
class RoundRobinQueryQueue {
 public:
  std::size_t size() const { return size_; }
  void Put(WaitingQuery query);
  /// Returns whether Take would return a query.
  bool HasNext(const std::function<bool(bus::EndpointId)>& may_run) const;
  /// Removes and returns the next query of a sender for which `may_run` is true; nullopt if there is none.
  std::optional<WaitingQuery> Take(const std::function<bool(bus::EndpointId)>& may_run);

 private:
  struct Turn {
    bus::EndpointId sender = 0;
    std::deque<WaitingQuery> queries;  // never empty
  };
  std::list<Turn> turns_;  // next sender first
  std::size_t size_ = 0;
};

/// Number and size of each sender's waiting and running queries. No state is kept for senders without queries.
///
/// Thread rule: one thread at a time.
class QueryCounts {
 public:
  struct Counts {
    std::size_t held = 0;  ///< waiting and running
    std::size_t running = 0;
  };
  Counts Of(bus::EndpointId sender) const;
  std::size_t bytes() const { return bytes_; }  ///< SQL text of all waiting and running queries

  void Add(const WaitingQuery& query);
  void Remove(const WaitingQuery& query);
  void Begin(bus::EndpointId sender) { ++of_sender_[sender].running; }  ///< counts a waiting query as running
  void End(bus::EndpointId sender) { --of_sender_[sender].running; }

 private:
  std::map<bus::EndpointId, Counts> of_sender_;
  std::size_t bytes_ = 0;
};

/// Runs clients' SQL on read-only connections in separate threads, so that queries do not delay leases.
///
/// Each query is bounded in rows, bytes and time: 30 s, unless its SQL begins with the comment
/// "/*+ MAX_EXECUTION_TIME(N) */" (N milliseconds, 1 .. 3,600,000).
///
/// There are five lanes with one thread each, for queries of up to 10 ms, 100 ms, 1 s, 30 s and more than 30 s. A query
/// starts in the first lane. A query that exceeds the time of its lane is restarted in the next lane. Thus a query
/// waits only for queries of similar duration.
///
/// In each lane, senders take turns. At most `kMaxRunningOfSender` queries of a sender run at once, and at most
/// `kMaxOfSender` wait or run. At most `kMaxWaiting` queries wait in a lane, and their SQL has at most
/// `kMaxWaitingBytes` in total.
///
/// Thread rule: all functions must be called by the thread that created the service.
class QueryService {
 public:
  static constexpr std::size_t kMaxWaiting = 64;                         ///< waiting queries in a lane
  static constexpr std::size_t kMaxOfSender = 16;                        ///< waiting and running queries of a sender
  static constexpr std::size_t kMaxRunningOfSender = 2;                  ///< running queries of a sender
  static constexpr std::size_t kMaxWaitingBytes = std::size_t{4} << 20;  ///< SQL text of all waiting and running
                                                                         ///< queries
  static constexpr std::chrono::milliseconds kDefaultLimit{30'000};
  static constexpr std::chrono::milliseconds kLongestLimit{3'600'000};

  /// The reader threads open `database` at the first query.
  explicit QueryService(std::filesystem::path database);
  /// Interrupts the running queries.
  ~QueryService();
  QueryService(const QueryService&) = delete;
  QueryService& operator=(const QueryService&) = delete;

  /// Accepts a query. Returns an empty string, or why the query is refused, with the exceeded limit.
  std::string Start(std::int64_t ticket, bus::EndpointId sender, legopt_msg::query_request request);

  struct Finished {
    std::int64_t ticket = 0;
    legopt_msg::query_reply reply;
  };
  /// Readable while TakeFinished would return results.
  int descriptor() const;
  std::vector<Finished> TakeFinished();

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace legopt::server
