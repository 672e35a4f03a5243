#include "server/query_service.h"

#include <sys/eventfd.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <condition_variable>
#include <deque>
#include <mutex>
#include <optional>
#include <string_view>
#include <system_error>
#include <thread>
#include <utility>

#include "db/query_json.h"
#include "db/read_only_database.h"
#include "words/reply.h"

namespace legopt::server {
namespace {

constexpr std::chrono::milliseconds kQuickSlice{250};
constexpr std::size_t kMaxAnswerBytes = std::size_t{48} << 20;  // query_reply.json

// What the statement asks for by its first comment, the default else.
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
  reply.status = NumberOf(status);
  reply.message = message;
  return reply;
}

legopt_msg::query_reply Answer(const db::QueryResult& result) {
  legopt_msg::query_reply reply{};
  reply.json = db::WriteJsonRows(db::ToJsonRows(result));
  if (reply.json.size() > kMaxAnswerBytes) {
    return Failure("the answer has " + std::to_string(reply.json.size() >> 20U) +
                   " MiB, more than the 48 that one reply may have; ask for fewer rows or columns");
  }
  return reply;
}

}  // namespace

class QueryService::Impl {
 public:
  explicit Impl(std::filesystem::path database)
      : path_(std::move(database)), event_(eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)) {
    if (event_ < 0) throw std::system_error(errno, std::generic_category(), "eventfd");
    for (Lane& lane : lanes_) lane.thread = std::thread([this, &lane] { Read(lane); });
  }

  ~Impl() {
    {
      const std::lock_guard lock(mutex_);
      stopping_ = true;
      for (Lane& lane : lanes_) {
        if (lane.running != nullptr) lane.running->Interrupt();
      }
    }
    wake_.notify_all();
    for (Lane& lane : lanes_) lane.thread.join();
    close(event_);
  }

  bool Start(std::int64_t ticket, legopt_msg::query_request request) {
    const std::lock_guard lock(mutex_);
    const std::chrono::milliseconds limit = LimitOf(request.sql);
    Lane& lane = lanes_[limit > kDefaultLimit ? kLong : kQuick];
    if (lane.waiting.size() >= kMaxWaiting) return false;
    lane.waiting.push_back({ticket, std::move(request), limit});
    wake_.notify_all();
    return true;
  }

  int descriptor() const { return event_; }

  std::vector<Finished> TakeFinished() {
    std::uint64_t count = 0;
    if (read(event_, &count, sizeof(count)) < 0) return {};
    const std::lock_guard lock(mutex_);
    return std::exchange(finished_, {});
  }

 private:
  struct Waiting {
    std::int64_t ticket = 0;
    legopt_msg::query_request request;
    std::chrono::milliseconds limit{};
  };
  // A reader with a connection of its own.
  struct Lane {
    std::deque<Waiting> waiting;
    db::ReadOnlyDatabase* running = nullptr;  // what Interrupt may reach, under the mutex
    std::thread thread;
  };

  enum LaneIndex : std::size_t { kQuick, kUsual, kLong, kNumLanes };

  // Takes the query up again behind those that are not quick either. False: too many wait there.
  bool PutOff(Waiting&& query) {
    const std::lock_guard lock(mutex_);
    Lane& usual = lanes_[kUsual];
    if (stopping_ || usual.waiting.size() >= kMaxWaiting) return false;
    usual.waiting.push_back(std::move(query));
    wake_.notify_all();
    return true;
  }

  void Read(Lane& lane) {
    std::optional<db::ReadOnlyDatabase> database;
    while (true) {
      Waiting next;
      {
        std::unique_lock lock(mutex_);
        lane.running = nullptr;
        wake_.wait(lock, [&] { return stopping_ || !lane.waiting.empty(); });
        if (stopping_) return;
        next = std::move(lane.waiting.front());
        lane.waiting.pop_front();
      }
      const bool sliced = &lane == &lanes_[kQuick] && next.limit > kQuickSlice;
      legopt_msg::query_reply reply = Run(lane, database, next, sliced ? kQuickSlice : next.limit);
      if (sliced && QueryStatus{reply.status} == QueryStatus::kStopped) {
        const std::int64_t ticket = next.ticket;
        if (PutOff(std::move(next))) continue;
        next.ticket = ticket;
        reply = Failure("too many queries wait; try again");
      }
      const std::lock_guard lock(mutex_);
      finished_.push_back({next.ticket, std::move(reply)});
      const std::uint64_t one = 1;
      // Fails only when the counter is full: then the descriptor is readable already.
      [[maybe_unused]] const ssize_t written = write(event_, &one, sizeof(one));
    }
  }

  legopt_msg::query_reply Run(Lane& lane, std::optional<db::ReadOnlyDatabase>& database, const Waiting& query,
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
  std::array<Lane, kNumLanes> lanes_;  // last: their threads use everything above
};

QueryService::QueryService(std::filesystem::path database) : impl_(std::make_unique<Impl>(std::move(database))) {}
QueryService::~QueryService() = default;
bool QueryService::Start(std::int64_t ticket, legopt_msg::query_request request) {
  return impl_->Start(ticket, std::move(request));
}
int QueryService::descriptor() const { return impl_->descriptor(); }
std::vector<QueryService::Finished> QueryService::TakeFinished() { return impl_->TakeFinished(); }

}  // namespace legopt::server
