// Policy: a dataset fetched over the network is either the requested one or absent, for any behaviour of server, link
// and disk.
#include "worker/dataset_fetch.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <spdlog/sinks/ostream_sink.h>
#include <unistd.h>

#include <array>
#include <deque>
#include <fstream>
#include <sstream>
#include <utility>

#include "app/data_folder.h"
#include "bus/codec.h"
#include "legopt/dataset/internal/dataset_content.h"
#include "legopt/types/input_error.h"
#include "legopt/types/reply.h"
#include "legopt_msg/dataset_reply.hpp"
#include "legopt_msg/dataset_request.hpp"
#include "tests/dataset/synthetic_dataset.h"
#include "tests/temporary_folder.h"

namespace legopt::worker {
namespace {

namespace fs = std::filesystem;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using End = FetchedDataset::End;

/// A simulated server that sends one archive, in pieces, in virtual time.
class FakeServerLink final : public ServerLink {
 public:
  microseconds now() const override { return now_; }
  void Call(bus::MessageType type, std::string body, microseconds timeout,
            std::function<void(bus::CallResult&&)> callback) override {
    EXPECT_EQ(type, bus::MessageType::kDataset);
    ++calls;
    bus::CallResult result;
    if (silent-- > 0) {
      result.error = "timed out";
      now_ += timeout;
    } else if (refusal != bus::ErrorCode{}) {
      result.status = bus::CallResult::kRejected;
      result.code = refusal;
      result.error = "refused";
    } else {
      result.status = bus::CallResult::kOk;
      result.body = bus::Encode(Answer(bus::Decode<legopt_msg::dataset_request>(body).value()));
    }
    pending_ = [callback = std::move(callback), result]() mutable { callback(std::move(result)); };
  }
  void Wait(std::span<pollfd> extra, microseconds /*max_wait*/) override {
    poll(extra.data(), extra.size(), 0);
    if (pending_) std::exchange(pending_, {})();
  }

  std::string archive;
  bool known = true;
  int silent = 0, calls = 0, new_archive_after = -1;
  bus::ErrorCode refusal{};

 private:
  legopt_msg::dataset_reply Answer(const legopt_msg::dataset_request& request) {
    constexpr std::size_t kPiece = 1000;
    if (calls == new_archive_after) archive += "made anew";
    legopt_msg::dataset_reply reply{};
    reply.status = EnumNumber(known ? DatasetStatus::kFound : DatasetStatus::kUnknown);
    if (!known) return reply;
    const std::string piece = archive.substr(static_cast<std::size_t>(request.offset), kPiece);
    reply.archive_bytes = static_cast<std::int64_t>(archive.size());
    reply.num_bytes = static_cast<std::int32_t>(piece.size());
    reply.piece.assign(piece.begin(), piece.end());
    return reply;
  }

  microseconds now_{0};
  std::function<void()> pending_;
};

const std::string kHash(64, 'a');

TEST(DatasetFetch, PiecesBecomeTheArchive) {
  FakeServerLink link;
  for (int i = 0; i < 2500; ++i) link.archive += static_cast<char>(i);
  const FetchedDataset fetched = FetchDataset(link, kHash, {});
  EXPECT_EQ(fetched.end, End::kFetched);
  EXPECT_EQ(fetched.archive, link.archive);
  EXPECT_EQ(link.calls, 3);
}

TEST(DatasetFetch, AServerThatIsAwayForAWhileIsWaitedFor) {
  FakeServerLink link;
  link.archive = std::string(2500, 'x');
  link.silent = 2;
  int told = 0;
  DatasetFetchOptions options;
  options.tell = [&told](const std::string&) { ++told; };
  EXPECT_EQ(FetchDataset(link, kHash, options).archive, link.archive);
  EXPECT_EQ(told, 1);
}

TEST(DatasetFetch, AServerThatStaysAwayEndsIt) {
  FakeServerLink link;
  link.silent = 1000;
  DatasetFetchOptions options;
  options.wait_server = std::chrono::seconds(20);
  EXPECT_EQ(FetchDataset(link, kHash, options).end, End::kUnreachable);
  EXPECT_LE(link.now(), std::chrono::seconds(30));
}

TEST(DatasetFetch, AnArchiveThatWasMadeAnewIsFetchedFromItsBeginning) {
  FakeServerLink link;
  link.archive = std::string(2500, 'x');
  link.new_archive_after = 2;
  EXPECT_EQ(FetchDataset(link, kHash, {}).archive, std::string(2500, 'x') + "made anew");
}

TEST(DatasetFetch, WhatTheServerDoesNotHandOutIsSaid) {
  FakeServerLink link;
  link.known = false;
  const FetchedDataset fetched = FetchDataset(link, kHash, {});
  EXPECT_EQ(fetched.end, End::kUnknown);
  EXPECT_THAT(fetched.error, HasSubstr("legopt dataset pack"));
  link.refusal = bus::ErrorCode::kUnknownType;
  EXPECT_EQ(FetchDataset(link, kHash, {}).end, End::kUnknown) << "a server of before";
  link.refusal = bus::ErrorCode::kKeyNeeded;
  EXPECT_EQ(FetchDataset(link, kHash, {}).end, End::kUnreachable);
}

TEST(DatasetFetch, AnOrderToStopEndsIt) {
  FakeServerLink link;
  link.silent = 1000;
  std::array<int, 2> order{};
  ASSERT_EQ(pipe(order.data()), 0);
  ASSERT_EQ(write(order[1], "x", 1), 1);
  DatasetFetchOptions options;
  options.stop_fd = order[0];
  options.take_order = [] { return true; };
  EXPECT_EQ(FetchDataset(link, kHash, options).end, End::kStopped);
  for (const int end : order) close(end);
}

class DatasetCacheTest : public testing::Test {
 protected:
  test::TemporaryFolder folder_;
  test::SyntheticFolder source_{folder_ / "source"};
  std::string hash_ = HashOfDataset(source_.path(), {});
  std::string archive_ = PackDataset(source_.path(), {});
  DatasetCache cache_{folder_ / "cache", {}};
};

TEST_F(DatasetCacheTest, WhatWasAddedIsFound) {
  EXPECT_EQ(cache_.Find(hash_), std::nullopt);
  const fs::path added = cache_.Add(hash_, archive_);
  EXPECT_EQ(cache_.Find(hash_), added);
  EXPECT_EQ(cache_.Add(hash_, archive_), added) << "by another worker, at the same time";
  EXPECT_EQ(HashOfDataset(added, {}), hash_);
}

TEST_F(DatasetCacheTest, AnotherContentIsRefusedAndNothingOfItKept) {
  try {
    cache_.Add(kHash, archive_);
    FAIL();
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), HasSubstr("another content"));
    EXPECT_THAT(error.what(), HasSubstr(hash_));
  }
  EXPECT_THROW(cache_.Add(hash_, archive_.substr(1)), InputError);
  EXPECT_TRUE(fs::is_empty(folder_ / "cache"));
}

TEST_F(DatasetCacheTest, AFileThatWasChangedOnTheDiskIsNotUsed) {
  const fs::path added = cache_.Add(hash_, archive_);
  std::ofstream(added / "robot.urdf", std::ios::app) << " ";
  EXPECT_EQ(cache_.Find(hash_), std::nullopt);
  EXPECT_FALSE(fs::exists(added));
  EXPECT_EQ(cache_.Add(hash_, archive_), added);
  fs::remove(added / "robot.urdf");
  EXPECT_EQ(cache_.Find(hash_), std::nullopt) << "nor is half of one";
}

TEST_F(DatasetCacheTest, HashesAreNoFolders) {
  EXPECT_TRUE(app::IsDatasetHash(hash_));
  EXPECT_FALSE(app::IsDatasetHash("garage-easier"));
  EXPECT_FALSE(app::IsDatasetHash(std::string(64, 'A')));
  EXPECT_FALSE(app::IsDatasetHash(std::string(63, 'a')));
}

class FetchedDatasetsTest : public DatasetCacheTest {
 protected:
  bool Fetch(const std::string& hash) { return datasets_.Fetch(hash, link_, {}, {stop_, *logger_, "nowhere"}); }

  FakeServerLink link_;
  app::StopSignals stop_;
  std::ostringstream log_;
  std::shared_ptr<spdlog::logger> logger_ =
      std::make_shared<spdlog::logger>("test", std::make_shared<spdlog::sinks::ostream_sink_st>(log_));
  FetchedDatasets datasets_{{"own"}, cache_};
};

TEST_F(FetchedDatasetsTest, WhatTheServerHasIsAddedAndFoundInTheCacheLater) {
  link_.archive = archive_;
  EXPECT_TRUE(Fetch(hash_));
  EXPECT_THAT(datasets_.folders(), ElementsAre("own", folder_ / "cache" / hash_));
  EXPECT_THAT(datasets_.unfetched(), IsEmpty());
  FetchedDatasets others({}, cache_);
  const int calls = link_.calls;
  EXPECT_TRUE(others.Fetch(hash_, link_, {}, {stop_, *logger_, "nowhere"}));
  EXPECT_EQ(others.folders().size(), 1U);
  EXPECT_EQ(link_.calls, calls);
}

TEST_F(FetchedDatasetsTest, AWrongArchiveOrNoneIsRememberedAndTheWorkerGoesOn) {
  link_.archive = archive_;
  EXPECT_TRUE(Fetch(kHash));
  EXPECT_THAT(log_.str(), HasSubstr("another content"));
  link_.known = false;
  EXPECT_TRUE(Fetch(hash_));
  EXPECT_THAT(datasets_.folders(), ElementsAre("own"));
  EXPECT_THAT(datasets_.unfetched(), ElementsAre(kHash, hash_));
  EXPECT_FALSE(datasets_.DropLast(*logger_));
}

TEST_F(FetchedDatasetsTest, ASilentServerChangesNothing) {
  link_.silent = 1000;
  EXPECT_TRUE(Fetch(hash_));
  EXPECT_THAT(datasets_.folders(), ElementsAre("own"));
  EXPECT_THAT(datasets_.unfetched(), IsEmpty()) << "it may be tried again";
}

TEST_F(FetchedDatasetsTest, WhatProcessesCannotLoadIsLeftOut) {
  link_.archive = archive_;
  EXPECT_TRUE(Fetch(hash_));
  EXPECT_TRUE(datasets_.DropLast(*logger_));
  EXPECT_THAT(datasets_.folders(), ElementsAre("own"));
  EXPECT_THAT(datasets_.unfetched(), ElementsAre(hash_));
  FetchedDatasets again({}, cache_);
  for (int i = 0; i < 2; ++i) EXPECT_TRUE(again.Fetch(hash_, link_, {}, {stop_, *logger_, "nowhere"}));
  EXPECT_THAT(again.folders(), IsEmpty()) << "asked for again: the processes did not announce it";
  EXPECT_THAT(again.unfetched(), ElementsAre(hash_));
}

}  // namespace
}  // namespace legopt::worker
