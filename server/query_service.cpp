#include "server/query_service.h"

#include <sys/eventfd.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <condition_variable>
#include <mutex>
#include <optional>
#include <string_view>
#include <system_error>
#include <thread>
#include <utility>

#include "db/query_json.h"
#include "db/read_only_database.h"
#include "legopt/types/reply.h"

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

namespace {

// Execution time of the first lanes; in the last two lanes a query may use its whole limit. Each lane has ten times the
// time of the previous one, so restarting costs a query a ninth of its time.
constexpr std::array<std::chrono::milliseconds, 3> kSlices{
    std::chrono::milliseconds(10), std::chrono::milliseconds(100), std::chrono::milliseconds(1000)};
constexpr std::size_t kUsualLane = kSlices.size(), kLongLane = kUsualLane + 1, kNumLanes = kLongLane + 1;
constexpr std::size_t kMaxAnswerBytes = std::size_t{48} << 20;  // limit for query_reply.json

// Returns the execution time requested by the first comment of the statement, or the default.
std::chrono::milliseconds LimitOf(std::string_view sql) {
  constexpr std::string_view kHint = "/*+ MAX_EXECUTION_TIME(";
  if (!sql.starts_with(kHint)) return QueryService::kDefaultLimit;
  sql.remove_prefix(kHint.size());
  std::int64_t limit_ms = 0;
  const auto [end, error] = std::from_chars(sql.data(), sql.data() + sql.size(), limit_ms);
  const bool whole = error == std::errc() && sql.substr(static_cast<std::size_t>(end - sql.data())).starts_with(") */");
  if (!whole || limit_ms < 1) return QueryService::kDefaultLimit;
  return std::min(std::chrono::milliseconds(limit_ms), QueryService::kLongestLimit);
}

legopt_msg::query_reply Failure(const std::string& message, QueryStatus status = QueryStatus::kRefused) {
  legopt_msg::query_reply reply{};
  reply.status = EnumNumber(status);
  reply.message = message;
  return reply;
}

// JSON may be larger than the values in memory, which QueryLimits::max_bytes limits: a BLOB has two digits per byte.
legopt_msg::query_reply Answer(const db::QueryResult& result) {
  legopt_msg::query_reply reply{};
  reply.json = db::WriteJsonRows(db::ToJsonRows(result), kMaxAnswerBytes);
  return reply;
}

}  // namespace

class QueryService::Impl {
 public:
  explicit Impl(std::filesystem::path database)
      : path_(std::move(database)), event_(eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)) {
    if (event_ < 0) throw std::system_error(errno, std::generic_category(), "eventfd");
    try {
      for (std::size_t lane = 0; lane < kNumLanes; ++lane) {
        lanes_[lane].thread = std::thread([this, lane] { Read(lane); });
      }
    } catch (...) {  // no memory for another thread: stop the started threads before their lanes are destroyed
      Stop();
      throw;
    }
  }

  ~Impl() { Stop(); }

  std::string Start(std::int64_t ticket, bus::EndpointId sender, legopt_msg::query_request request) {
    const std::lock_guard lock(mutex_);
    if (counts_.Of(sender).held >= kMaxOfSender) {
      return "this sender has " + std::to_string(kMaxOfSender) +
             " unanswered queries, which is the most; wait for their answers";
    }
    if (lanes_[0].waiting.size() >= kMaxWaiting || counts_.bytes() + request.sql.size() > kMaxWaitingBytes) {
      return kTooMany;
    }
    const std::chrono::milliseconds limit = LimitOf(request.sql);
    WaitingQuery query{ticket, sender, std::move(request), limit};
    counts_.Add(query);
    lanes_[0].waiting.Put(std::move(query));
    wake_.notify_all();
    return {};
  }

  int descriptor() const { return event_; }

  std::vector<Finished> TakeFinished() {
    std::uint64_t count = 0;
    if (read(event_, &count, sizeof(count)) < 0) return {};
    const std::lock_guard lock(mutex_);
    return std::exchange(finished_, {});
  }

 private:
  void Stop() {
    {
      const std::lock_guard lock(mutex_);
      stopping_ = true;
      for (Lane& lane : lanes_) {
        if (lane.running != nullptr) lane.running->Interrupt();
      }
    }
    wake_.notify_all();
    for (Lane& lane : lanes_) {
      if (lane.thread.joinable()) lane.thread.join();
    }
    close(event_);
  }

  static constexpr const char* kTooMany = "too many queries wait; try again";

  // A reader thread with its own connection.
  struct Lane {
    RoundRobinQueryQueue waiting;
    db::ReadOnlyDatabase* running = nullptr;  // used by Interrupt, protected by the mutex
    std::thread thread;
  };

  bool MayRun(bus::EndpointId sender) const { return counts_.Of(sender).running < kMaxRunningOfSender; }

  // Returns the execution time of a query in this lane.
  static std::chrono::milliseconds TimeIn(std::size_t lane, const WaitingQuery& query) {
    return lane < kSlices.size() ? std::min(kSlices[lane], query.limit) : query.limit;
  }

  // Waits for the next query of the lane; nullopt if the service stops.
  std::optional<WaitingQuery> Next(Lane& lane) {
    const auto may_run = [this](bus::EndpointId sender) { return MayRun(sender); };
    std::unique_lock lock(mutex_);
    wake_.wait(lock, [&] { return stopping_ || lane.waiting.HasNext(may_run); });
    if (stopping_) return std::nullopt;
    std::optional<WaitingQuery> query = lane.waiting.Take(may_run);
    counts_.Begin(query->sender);
    return query;
  }

  void Read(std::size_t lane) {
    std::optional<db::ReadOnlyDatabase> database;
    while (std::optional<WaitingQuery> query = Next(lanes_[lane])) {
      const std::chrono::milliseconds time = TimeIn(lane, *query);
      legopt_msg::query_reply reply = Run(lanes_[lane], database, *query, time);
      const bool unfinished = QueryStatus{reply.status} == QueryStatus::kStopped && time < query->limit;
      const std::lock_guard lock(mutex_);
      lanes_[lane].running = nullptr;
      counts_.End(query->sender);
      if (unfinished && MoveToNextLane(lane, *query)) continue;
      Finish(*query, unfinished ? Failure(kTooMany) : std::move(reply));
    }
  }

  // Moves the query to the next lane. Returns false if the lane is full. The mutex must be held.
  bool MoveToNextLane(std::size_t lane, WaitingQuery& query) {
    const std::size_t last = query.limit > kDefaultLimit ? kLongLane : kUsualLane;
    RoundRobinQueryQueue& next = lanes_[lane + 1 < kSlices.size() ? lane + 1 : last].waiting;
    if (next.size() >= kMaxWaiting) return false;
    next.Put(std::move(query));
    wake_.notify_all();
    return true;
  }

  // The mutex must be held.
  void Finish(const WaitingQuery& query, legopt_msg::query_reply reply) {
    counts_.Remove(query);
    finished_.push_back({query.ticket, std::move(reply)});
    const std::uint64_t one = 1;
    // Fails only if the counter is full; then the descriptor is readable already.
    [[maybe_unused]] const ssize_t written = write(event_, &one, sizeof(one));
    wake_.notify_all();  // other lanes may have waiting queries of the sender
  }

  legopt_msg::query_reply Run(Lane& lane, std::optional<db::ReadOnlyDatabase>& database, const WaitingQuery& query,
                              std::chrono::milliseconds limit) {
    try {
      if (!database) database.emplace(path_, db::Log::kTrusted);
      {
        const std::lock_guard lock(mutex_);
        if (stopping_) return Failure("the server is stopping");
        lane.running = &*database;
      }
      db::QueryLimits limits;
      limits.max_rows = query.request.max_rows;
      limits.max_bytes = kMaxAnswerBytes;
      limits.time_limit = limit;
      return Answer(database->Query(query.request.sql, {}, limits));
    } catch (const db::StoreError& error) {
      const std::lock_guard lock(mutex_);
      if (stopping_) return Failure("the server is stopping");
      return Failure(error.what(),
                     error.code() == db::StoreErrorCode::kInterrupted ? QueryStatus::kStopped : QueryStatus::kRefused);
    } catch (const std::exception& error) {
      return Failure(error.what());
    }
  }

  std::filesystem::path path_;
  int event_;
  std::mutex mutex_;
  std::condition_variable wake_;
  bool stopping_ = false;
  std::vector<Finished> finished_;
  QueryCounts counts_;
  std::array<Lane, kNumLanes> lanes_;  // last member: the threads use all members above
};

QueryService::QueryService(std::filesystem::path database) : impl_(std::make_unique<Impl>(std::move(database))) {}
QueryService::~QueryService() = default;
std::string QueryService::Start(std::int64_t ticket, bus::EndpointId sender, legopt_msg::query_request request) {
  return impl_->Start(ticket, sender, std::move(request));
}
int QueryService::descriptor() const { return impl_->descriptor(); }
std::vector<QueryService::Finished> QueryService::TakeFinished() { return impl_->TakeFinished(); }

}  // namespace legopt::server
