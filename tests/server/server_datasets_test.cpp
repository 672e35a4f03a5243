// Datasets that the server hands out and stores, on a simulated network.
#include <gtest/gtest.h>

#include <optional>
#include <string>

#include "bus/message_limits.h"
#include "tests/server/server_on_bus.h"

namespace legopt::server {
namespace {

using namespace std::chrono_literals;

TEST_F(ServerOnBus, DatasetsAreHandedOutInPieces) {
  dataset_ = std::string(bus::fields::kMaxPieceBytes + 10, 'x') + "end";
  const auto ask = [this](char digit, std::int64_t offset) {
    legopt_msg::dataset_request request{};
    request.hash = HashOf(digit);
    request.offset = offset;
    std::optional<legopt_msg::dataset_reply> answer;
    client_.Call<legopt_msg::dataset_reply>(bus::MessageType::kDataset, request,
                                            [&](const auto& reply) { answer = reply; });
    EXPECT_TRUE(RunUntil([&] { return answer.has_value(); }));
    return answer.value_or(legopt_msg::dataset_reply{});
  };
  const auto whole = static_cast<std::int64_t>(dataset_.size());
  const auto first = ask('a', 0);
  EXPECT_EQ(StatusOf(first), DatasetStatus::kFound);
  EXPECT_EQ(first.archive_bytes, whole);
  EXPECT_EQ(first.num_bytes, bus::fields::kMaxPieceBytes);
  const auto last = ask('a', first.num_bytes);
  EXPECT_EQ(std::string(last.piece.begin(), last.piece.end()), "xxxxxxxxxxend");
  EXPECT_EQ(ask('a', whole).num_bytes, 0);
  EXPECT_EQ(ask('a', bus::fields::kMaxArchiveBytes).num_bytes, 0) << "beyond its end";
  EXPECT_EQ(StatusOf(ask('f', 0)), DatasetStatus::kUnknown);
}

class StoredDatasets : public ServerOnBus {
 protected:
  // Without an archive: asks whether the server wants it.
  legopt_msg::store_dataset_reply Store(const std::string& archive, char digit = 'd') {
    legopt_msg::store_dataset_request request{};
    request.hash = HashOf(digit);
    request.archive.assign(archive.begin(), archive.end());
    request.num_bytes = static_cast<std::int32_t>(archive.size());
    std::optional<legopt_msg::store_dataset_reply> answer;
    client_.Call<legopt_msg::store_dataset_reply>(bus::MessageType::kStoreDataset, request,
                                                  [&](const auto& reply) { answer = reply; });
    EXPECT_TRUE(RunUntil([&] { return answer.has_value(); }));
    return answer.value_or(legopt_msg::store_dataset_reply{});
  }
  void SubmitOne(const std::string& id = "s1", char digit = 'd') {
    submitted_.reset();
    nlohmann::json spec = SampleSpec(1);
    spec["dataset"] = {{"name", std::string("set-") + digit}, {"hash", HashOf(digit)}};
    Submit(spec, id);
    EXPECT_TRUE(RunUntil([&] { return submitted_.has_value(); }));
  }
  // Submits something to commit, so that the server encounters the error of its store.
  void SubmitInVain() {
    Submit(SampleSpec(2), "in vain");
    RunUntil([] { return false; }, 1s);
  }
  std::string HandedOut(char digit = 'd') {
    legopt_msg::dataset_request request{};
    request.hash = HashOf(digit);
    std::optional<std::string> piece;
    client_.Call<legopt_msg::dataset_reply>(bus::MessageType::kDataset, request, [&](const auto& reply) {
      piece = std::string(reply.piece.begin(), reply.piece.end());
    });
    EXPECT_TRUE(RunUntil([&] { return piece.has_value(); }));
    return piece.value_or("");
  }
};

TEST_F(StoredDatasets, AnArchiveOfAnExperimentIsStoredOnceAndHandedOut) {
  EXPECT_EQ(StatusOf(Store("packed")), StoreDatasetStatus::kRefused) << "no experiment has the dataset";
  EXPECT_EQ(store_.FindDatasetArchive(HashOf('d')), std::nullopt);
  SubmitOne();
  EXPECT_EQ(StatusOf(Store("")), StoreDatasetStatus::kWanted);
  EXPECT_EQ(HandedOut(), "");
  EXPECT_EQ(StatusOf(Store("packed")), StoreDatasetStatus::kStored);
  EXPECT_EQ(store_.FindDatasetArchive(HashOf('d')), "packed") << "on disk before the answer";
  EXPECT_EQ(StatusOf(Store("another")), StoreDatasetStatus::kStored);
  EXPECT_EQ(StatusOf(Store("")), StoreDatasetStatus::kStored);
  EXPECT_EQ(HandedOut(), "packed");
  StartServer();
  EXPECT_EQ(HandedOut(), "packed");
}

TEST_F(StoredDatasets, StoredArchivesHaveABudgetTogether) {
  SubmitOne("s1", 'd');
  SubmitOne("s2", 'e');
  EXPECT_EQ(StatusOf(Store(std::string(600, 'x'), 'd')), StoreDatasetStatus::kStored);
  const auto refused = Store(std::string(600, 'x'), 'e');
  EXPECT_EQ(StatusOf(refused), StoreDatasetStatus::kRefused);
  EXPECT_NE(refused.message.find("at most 1000"), std::string::npos) << refused.message;
  EXPECT_EQ(StatusOf(Store(std::string(400, 'x'), 'e')), StoreDatasetStatus::kStored);
}

TEST_F(StoredDatasets, AServerWithoutDatasetsOrDiskRefusesAndKeepsNothing) {
  SubmitOne();
  store_.FailWith(db::StoreErrorCode::kFull);
  SubmitInVain();
  const auto unhealthy = Store("packed");
  EXPECT_EQ(StatusOf(unhealthy), StoreDatasetStatus::kRefused);
  EXPECT_NE(unhealthy.message.find("cannot be written"), std::string::npos) << unhealthy.message;
  store_.FailWith(std::nullopt);
  store_datasets_ = false;
  StartServer();
  const auto refused = Store("");
  EXPECT_EQ(StatusOf(refused), StoreDatasetStatus::kRefused);
  EXPECT_NE(refused.message.find("--no-dataset"), std::string::npos) << refused.message;
  EXPECT_EQ(StatusOf(Store("packed")), StoreDatasetStatus::kRefused);
  EXPECT_EQ(store_.FindDatasetArchive(HashOf('d')), std::nullopt);
}

TEST_F(StoredDatasets, ArchivesLeaveTheReserveOfTheDisk) {
  SubmitOne();
  disk_ = db::DiskSpace{1'000'000'003, 100'000'000'000};
  const auto refused = Store("packed");
  EXPECT_EQ(StatusOf(refused), StoreDatasetStatus::kRefused);
  EXPECT_NE(refused.message.find("1000000000 are reserved"), std::string::npos) << refused.message;
  disk_->free_bytes = 99'000'000'000;
  EXPECT_EQ(StatusOf(Store("packed")), StoreDatasetStatus::kStored);
}

}  // namespace
}  // namespace legopt::server
