#include "server/query_queue.h"

#include <algorithm>
#include <utility>

namespace legopt::server {

void RoundRobinQueryQueue::Put(WaitingQuery query) {
  ++size_;
  const auto turn = std::ranges::find(turns_, query.sender, &Turn::sender);
  if (turn != turns_.end()) {
    turn->queries.push_back(std::move(query));
    return;
  }
  const bus::EndpointId sender = query.sender;
  turns_.push_back({sender, {}});
  turns_.back().queries.push_back(std::move(query));
}

bool RoundRobinQueryQueue::HasNext(const std::function<bool(bus::EndpointId)>& may_run) const {
  return std::ranges::any_of(turns_, may_run, &Turn::sender);
}

std::optional<WaitingQuery> RoundRobinQueryQueue::Take(const std::function<bool(bus::EndpointId)>& may_run) {
  const auto turn = std::ranges::find_if(turns_, may_run, &Turn::sender);
  if (turn == turns_.end()) return std::nullopt;
  WaitingQuery query = std::move(turn->queries.front());
  turn->queries.pop_front();
  --size_;
  if (turn->queries.empty()) {
    turns_.erase(turn);
  } else {
    turns_.splice(turns_.end(), turns_, turn);
  }
  return query;
}

QueryCounts::Counts QueryCounts::Of(bus::EndpointId sender) const {
  const auto found = of_sender_.find(sender);
  return found == of_sender_.end() ? Counts{} : found->second;
}

void QueryCounts::Add(const WaitingQuery& query) {
  ++of_sender_[query.sender].held;
  bytes_ += query.request.sql.size();
}

void QueryCounts::Remove(const WaitingQuery& query) {
  bytes_ -= query.request.sql.size();
  const auto found = of_sender_.find(query.sender);
  if (--found->second.held == 0) of_sender_.erase(found);
}

}  // namespace legopt::server
