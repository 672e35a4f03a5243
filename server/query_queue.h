#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <list>
#include <map>
#include <optional>

#include "bus/transport.h"
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

}  // namespace legopt::server
