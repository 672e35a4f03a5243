#include "worker/dataset_fetch.h"

#include <array>
#include <memory>
#include <utility>

#include "bus/codec.h"
#include "legopt/types/reply.h"
#include "legopt_msg/dataset_reply.hpp"
#include "legopt_msg/dataset_request.hpp"

namespace legopt::worker {
namespace {

using End = FetchedDataset::End;

constexpr microseconds kCallTimeout = std::chrono::seconds(5);
constexpr microseconds kLongestWait = std::chrono::seconds(1);

struct Answer {
  std::optional<legopt_msg::dataset_reply> reply;
  std::optional<bus::ErrorCode> refused;  // set if the refusal is permanent
  std::string error;
};

/// One fetch of a dataset.
class Fetch {
 public:
  Fetch(ServerLink& link, std::string hash, const DatasetFetchOptions& options)
      : link_(link), hash_(std::move(hash)), options_(options), heard_(link.now()) {}

  FetchedDataset Run() {
    for (;;) {
      const std::optional<Answer> answer = Ask();
      if (!answer) return {End::kStopped, {}, "the worker stops"};
      if (answer->reply) {
        heard_ = link_.now();
        if (DatasetStatus{answer->reply->status} == DatasetStatus::kUnknown) return Unknown();
        if (Take(*answer->reply)) return {End::kFetched, std::move(archive_), {}};
      } else if (answer->refused == bus::ErrorCode::kUnknownType) {
        return {End::kUnknown, {}, "the server hands out no datasets: " + answer->error};
      } else if (answer->refused || link_.now() - heard_ >= options_.wait_server) {
        return {End::kUnreachable, {}, answer->error};
      } else if (!std::exchange(told_, true)) {
        options_.tell(answer->error);
      }
    }
  }

 private:
  FetchedDataset Unknown() const {
    return {End::kUnknown,
            {},
            "the server does not hand out the dataset " + hash_ +
                "; 'legopt dataset pack' puts it into the folder that legopt-server --datasets names"};
  }

  // Requests the next piece; returns nothing after an order to stop.
  std::optional<Answer> Ask() {
    legopt_msg::dataset_request request{};
    request.hash = hash_;
    request.offset = static_cast<std::int64_t>(archive_.size());
    const auto answer = std::make_shared<std::optional<Answer>>();
    link_.Call(bus::MessageType::kDataset, bus::Encode(request), kCallTimeout, [answer](bus::CallResult&& result) {
      Answer& given = answer->emplace();
      given.error = result.error;
      const bool rejected = result.status == bus::CallResult::kRejected;
      if (rejected && result.code != bus::ErrorCode::kReplyGone) given.refused = result.code;
      if (result.status == bus::CallResult::kOk) {
        given.reply = bus::Decode<legopt_msg::dataset_reply>(result.body, &given.error);
      }
    });
    std::array<pollfd, 1> stop{pollfd{options_.stop_fd, POLLIN, 0}};
    while (!*answer) {
      link_.Wait(stop, kLongestWait);
      if ((stop[0].revents & POLLIN) != 0 && options_.take_order && options_.take_order()) return std::nullopt;
    }
    return std::move(*answer);
  }

  // Stores a piece. Returns true if it was the last one.
  bool Take(const legopt_msg::dataset_reply& reply) {
    if (reply.archive_bytes != archive_bytes_) {
      archive_bytes_ = reply.archive_bytes;
      const bool made_anew = !archive_.empty();
      archive_.clear();
      if (made_anew) return false;
    }
    archive_.append(reply.piece.begin(), reply.piece.end());
    return reply.num_bytes == 0 || static_cast<std::int64_t>(archive_.size()) >= archive_bytes_;
  }

  ServerLink& link_;
  std::string hash_;
  const DatasetFetchOptions& options_;
  microseconds heard_;
  bool told_ = false;
  std::int64_t archive_bytes_ = 0;
  std::string archive_;
};

}  // namespace

FetchedDataset FetchDataset(ServerLink& link, const std::string& hash, const DatasetFetchOptions& options) {
  return Fetch(link, hash, options).Run();
}

}  // namespace legopt::worker
