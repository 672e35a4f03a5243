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

/// A query of a client that waits for a reader.
struct WaitingQuery {
  std::int64_t ticket = 0;
  bus::EndpointId sender = 0;
  legopt_msg::query_request request;
  std::chrono::milliseconds limit{};  ///< execution time that the query may take
};

/// A queue of queries in which the senders take turns: each sender's own queries stay in order, and after each query
/// the next sender is served. Memory: nothing is kept of a sender without waiting queries.
///
/// Thread rule: one thread at a time.
class QueryLane {
 public:
  std::size_t size() const { return size_; }  ///< number of waiting queries
  void Put(WaitingQuery query);
  /// Whether Take would return a query.
  bool HasNext(const std::function<bool(bus::EndpointId)>& may_run) const;
  /// Removes the next query of a sender for which `may_run` is true; empty: there is none.
  std::optional<WaitingQuery> Take(const std::function<bool(bus::EndpointId)>& may_run);

 private:
  struct Turn {
    bus::EndpointId sender = 0;
    std::deque<WaitingQuery> queries;  // never empty
  };
  std::list<Turn> turns_;  // next sender first
  std::size_t size_ = 0;
};

/// Number and size of the queries that each sender has waiting and running. Keeps nothing of senders without queries.
///
/// Thread rule: one thread at a time.
class QueryCounts {
 public:
  struct Counts {
    std::size_t held = 0;     ///< waiting and running
    std::size_t running = 0;  ///< running
  };
  Counts Of(bus::EndpointId sender) const;
  std::size_t bytes() const { return bytes_; }  ///< SQL of all held queries

  void Add(const WaitingQuery& query);
  void Remove(const WaitingQuery& query);
  void Begin(bus::EndpointId sender) { ++of_sender_[sender].running; }  ///< counts a waiting query as running
  void End(bus::EndpointId sender) { --of_sender_[sender].running; }

 private:
  std::map<bus::EndpointId, Counts> of_sender_;
  std::size_t bytes_ = 0;
};

}  // namespace legopt::server
