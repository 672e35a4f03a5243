// Policy: the senders of queries take turns, a sender at its limit is skipped, and no data are kept of senders without
// queries.

#include <gtest/gtest.h>

#include "server/query_service.h"

namespace legopt::server {
namespace {

WaitingQuery QueryOf(std::int64_t ticket, bus::EndpointId sender) {
  WaitingQuery query;
  query.ticket = ticket;
  query.sender = sender;
  query.request.sql = "SELECT 1";
  return query;
}

bool Any(bus::EndpointId /*sender*/) { return true; }

TEST(RoundRobinQueryQueue, SendersTakeTurns) {
  RoundRobinQueryQueue lane;
  for (std::int64_t i = 0; i < 3; ++i) lane.Put(QueryOf(10 + i, 1));
  lane.Put(QueryOf(20, 2));
  lane.Put(QueryOf(30, 3));
  std::vector<std::int64_t> order;
  while (const auto query = lane.Take(Any)) order.push_back(query->ticket);
  EXPECT_EQ(order, (std::vector<std::int64_t>{10, 20, 30, 11, 12}));
  EXPECT_EQ(lane.size(), 0U);
}

TEST(RoundRobinQueryQueue, ASenderThatMayNotRunIsPassedOver) {
  RoundRobinQueryQueue lane;
  lane.Put(QueryOf(10, 1));
  const auto not_first = [](bus::EndpointId sender) { return sender != 1; };
  EXPECT_FALSE(lane.HasNext(not_first));
  EXPECT_FALSE(lane.Take(not_first));
  lane.Put(QueryOf(20, 2));
  EXPECT_TRUE(lane.HasNext(not_first));
  EXPECT_EQ(lane.Take(not_first)->ticket, 20);
  EXPECT_EQ(lane.Take(Any)->ticket, 10);
}

TEST(QueryCounts, CountsWhatIsHeldAndRuns) {
  QueryCounts counts;
  const WaitingQuery query = QueryOf(1, 5);
  counts.Add(query);
  counts.Add(query);
  counts.Begin(5);
  EXPECT_EQ(counts.Of(5).held, 2U);
  EXPECT_EQ(counts.Of(5).running, 1U);
  EXPECT_EQ(counts.Of(6).held, 0U);
  EXPECT_EQ(counts.bytes(), 16U);
  counts.End(5);
  counts.Remove(query);
  counts.Remove(query);
  EXPECT_EQ(counts.Of(5).held, 0U);
  EXPECT_EQ(counts.bytes(), 0U);
}

}  // namespace
}  // namespace legopt::server
