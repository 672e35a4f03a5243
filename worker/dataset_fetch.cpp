#include "worker/dataset_fetch.h"

#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <optional>
#include <string>
#include <system_error>
#include <utility>

#include "app/data_folder.h"
#include "app/isolated_call.h"
#include "app/printable.h"
#include "bus/codec.h"
#include "legopt/dataset/internal/dataset_content.h"
#include "legopt/types/input_error.h"
#include "legopt/types/reply.h"
#include "legopt_msg/dataset_reply.hpp"
#include "legopt_msg/dataset_request.hpp"

namespace legopt::worker {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void Refuse(const fs::path& folder, const std::string& message, const std::string& fix) {
  throw InputError({folder.string(), "", "", message, fix});
}

// Creates a folder that only this user can write to. In the folder for temporary files another user may already have
// created it.
void CreatePrivateFolder(const fs::path& folder) {
  const std::string fix = "set XDG_CACHE_HOME to a folder of your own with free space";
  std::error_code error;
  fs::create_directories(folder, error);
  struct stat status {};
  if (error || stat(folder.c_str(), &status) != 0) Refuse(folder, "cannot be made: " + error.message(), fix);
  if (status.st_uid != geteuid()) Refuse(folder, "belongs to another user", fix);
  chmod(folder.c_str(), S_IRWXU);
}

// Folder for unpacking. The destructor removes it with its content unless it has been moved.
class UnpackFolder {
 public:
  explicit UnpackFolder(const fs::path& cache) {
    std::string name = (cache / ".unpacking-XXXXXX").string();
    if (mkdtemp(name.data()) == nullptr) {
      Refuse(cache, std::string("cannot be written: ") + std::strerror(errno), "set XDG_CACHE_HOME to another folder");
    }
    path_ = name;
  }
  ~UnpackFolder() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }
  UnpackFolder(const UnpackFolder&) = delete;
  UnpackFolder& operator=(const UnpackFolder&) = delete;
  const fs::path& path() const { return path_; }

 private:
  fs::path path_;
};

}  // namespace

DatasetCache::DatasetCache(fs::path folder, ReadGuard guard) : folder_(std::move(folder)), guard_(std::move(guard)) {}

std::optional<fs::path> DatasetCache::Find(const std::string& hash) const {
  const fs::path folder = folder_ / hash;
  if (!fs::exists(folder)) return std::nullopt;
  try {
    if (HashOfDataset(folder, guard_) == hash) return folder;
  } catch (const InputError&) {  // no longer a dataset: treated like different content
  }
  std::error_code ignored;
  fs::remove_all(folder, ignored);
  return std::nullopt;
}

fs::path DatasetCache::Add(const std::string& hash, const std::string& archive) const {
  CreatePrivateFolder(folder_);
  const UnpackFolder unpacked(folder_);
  UnpackDataset(archive, unpacked.path(), guard_);
  if (const std::string found = HashOfDataset(unpacked.path(), guard_); found != hash) {
    throw InputError({"dataset " + hash, "", found, "what came over the network has another content",
                      "run 'legopt dataset pack' again for legopt-server --datasets, or delete the experiments of the "
                      "database that stores it and submit them again"});
  }
  std::error_code error;
  fs::rename(unpacked.path(), folder_ / hash, error);
  // Another worker may have added the same content first.
  if (error) {
    if (const auto other = Find(hash)) return *other;
    Refuse(folder_ / hash, "cannot be made: " + error.message(), "set XDG_CACHE_HOME to another folder");
  }
  return folder_ / hash;
}

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

namespace {

std::optional<fs::path> FindEmbedded(const std::string& hash) {
  try {
    for (const fs::path& folder : app::EmbeddedDatasetFolders()) {
      if (HashOfDataset(folder, CallIsolated) == hash) return folder;
    }
  } catch (const InputError&) {  // the program was installed without data
  }
  return std::nullopt;
}

ExitCode EndOf(const FetchedFolder& found, const DatasetSearchContext& around) {
  switch (found.end) {
    case FetchedDataset::End::kUnknown:
      around.logger.error(found.error);
      return ExitCode::kDatasetMismatch;
    case FetchedDataset::End::kUnreachable:
      around.logger.error("no answer from a server at {}: {}", around.server_address, found.error);
      return ExitCode::kUnreachable;
    case FetchedDataset::End::kFetched:
    case FetchedDataset::End::kStopped:
      break;
  }
  return ExitCode::kOk;
}

}  // namespace

FetchedFolder FindOrFetch(const std::string& hash, const DatasetCache& cache, ServerLink& link,
                          microseconds wait_server, const DatasetSearchContext& around) {
  if (const auto folder = cache.Find(hash)) return {FetchedDataset::End::kFetched, *folder, {}};
  DatasetFetchOptions options;
  options.wait_server = wait_server;
  options.stop_fd = around.stop.descriptor();
  options.take_order = [&around] { return around.stop.Take(); };
  options.tell = [&](const std::string& error) {
    around.logger.warn("no answer from a server at {} yet: {}", around.server_address, error);
  };
  const FetchedDataset fetched = FetchDataset(link, hash, options);
  if (fetched.end != FetchedDataset::End::kFetched) return {fetched.end, {}, fetched.error};
  const fs::path folder = cache.Add(hash, fetched.archive);
  std::printf("legopt-worker: dataset %s came from the server: %zu bytes, now in %s\n", hash.c_str(),
              fetched.archive.size(), app::Printable(folder.string()).c_str());
  std::fflush(stdout);
  return {FetchedDataset::End::kFetched, folder, {}};
}

std::optional<ExitCode> FindDatasets(std::vector<fs::path>& datasets, const DatasetCache& cache, ServerLink& link,
                                     const PoolOptions& pool, const DatasetSearchContext& around) {
  for (fs::path& dataset : datasets) {
    const std::string hash = dataset.string();
    if (!app::IsDatasetHash(hash)) {
      dataset = app::NamedDatasetFolder(hash);
      continue;
    }
    if (const auto embedded = FindEmbedded(hash)) {
      dataset = *embedded;
      continue;
    }
    const FetchedFolder found = FindOrFetch(hash, cache, link, pool.wait_server, around);
    if (found.end != FetchedDataset::End::kFetched) return EndOf(found, around);
    dataset = found.folder;
  }
  return std::nullopt;
}

namespace {

constexpr microseconds kFetchPatience = std::chrono::seconds(60);

}  // namespace

FetchedDatasets::FetchedDatasets(std::vector<fs::path> own, const DatasetCache& cache)
    : own_(std::move(own)), cache_(cache) {}

std::vector<fs::path> FetchedDatasets::folders() const {
  std::vector<fs::path> folders = own_;
  for (const Fetched& fetched : fetched_) folders.push_back(fetched.folder);
  return folders;
}

void FetchedDatasets::NoteFailure(const std::string& hash) {
  unfetched_.push_back(hash);
  if (unfetched_.size() > kMaxUnfetched) unfetched_.erase(unfetched_.begin());
}

bool FetchedDatasets::DropLast(spdlog::logger& logger) {
  if (fetched_.empty()) return false;
  logger.warn("dataset {} cannot be loaded; the worker continues without it", fetched_.back().hash);
  NoteFailure(fetched_.back().hash);
  fetched_.pop_back();
  return true;
}

bool FetchedDatasets::Fetch(const std::string& hash, ServerLink& link, const PoolOptions& pool,
                            const DatasetSearchContext& around) {
  const auto is_it = [&](const Fetched& fetched) { return fetched.hash == hash; };
  if (std::any_of(fetched_.begin(), fetched_.end(), is_it)) {
    around.logger.warn("dataset {} was fetched, but the job processes have not loaded it", hash);
    std::erase_if(fetched_, is_it);
    NoteFailure(hash);
    return true;
  }
  try {
    const FetchedFolder found = FindOrFetch(hash, cache_, link, std::min(pool.wait_server, kFetchPatience), around);
    if (found.end == FetchedDataset::End::kStopped) return false;
    if (found.end == FetchedDataset::End::kFetched) {
      if (fetched_.size() == kMaxFetched) fetched_.erase(fetched_.begin());
      fetched_.push_back({hash, found.folder});
      return true;
    }
    around.logger.warn("dataset {} could not be fetched: {}", hash, found.error);
    if (found.end == FetchedDataset::End::kUnknown) NoteFailure(hash);
  } catch (const InputError& error) {
    around.logger.warn("dataset {} could not be fetched: {}", hash, error.what());
    NoteFailure(hash);
  }
  return true;
}

}  // namespace legopt::worker
