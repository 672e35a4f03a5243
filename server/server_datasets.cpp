// Storing and offering of datasets by Server.

#include <spdlog/spdlog.h>

#include <algorithm>
#include <utility>

#include "bus/codec.h"
#include "bus/message_limits.h"
#include "legopt/types/reply.h"
#include "server/budget.h"
#include "server/server.h"

namespace legopt::server {
namespace {

constexpr auto kMaxStoredDatasetBytes = static_cast<std::size_t>(bus::fields::kMaxStoredArchiveBytes);

}  // namespace

void Server::StoreDatasets(std::size_t first) {
  if (!options_.store_datasets || !options_.find_dataset) return;
  for (std::size_t i = first, end = ops_.size(); i < end; ++i) {
    const auto* created = std::get_if<db::CreateExperiment>(&ops_[i]);
    if (created == nullptr) continue;
    const std::string hash = created->experiment.dataset.hash;
    const std::string* archive = options_.find_dataset(hash);
    if (archive == nullptr || archive->empty()) continue;
    if (archive->size() > kMaxStoredDatasetBytes) {
      spdlog::warn("dataset {} is not stored with its results: its archive has {} bytes, more than {}", hash,
                   archive->size(), kMaxStoredDatasetBytes);
      continue;
    }
    ops_.emplace_back(db::StoreDataset{hash, *archive});
  }
}

std::string Server::ReasonNotToStore(const db::ArchiveFacts& facts, std::size_t bytes) const {
  if (!options_.store_datasets) return "the server was started with --no-dataset";
  if (!facts.has_experiment) return "no experiment of this server was made on this dataset";
  if (!store_healthy()) return "the database cannot be written at the moment: " + store_error_;
  if (watch_.disk_is_low()) return "the disk of the database is nearly full";
  if (const auto disk = options_.disk_space ? options_.disk_space() : std::nullopt) {
    const std::int64_t reserve = ReserveOf(*disk, options_.scheduler.disk_reserve_bytes);
    if (disk->free_bytes - static_cast<std::int64_t>(bytes) < reserve) {
      return "the disk of the database has " + std::to_string(disk->free_bytes) + " bytes free, of which " +
             std::to_string(reserve) + " are reserved for the results of accepted jobs";
    }
  }
  if (facts.stored_bytes + static_cast<std::int64_t>(bytes) > options_.most_dataset_bytes) {
    return "the stored datasets have " + std::to_string(facts.stored_bytes) + " bytes, and the server stores at most " +
           std::to_string(options_.most_dataset_bytes) + "; delete experiments ('legopt service delete')";
  }
  return {};
}

// An archive that cannot be written is discarded: the sender may send it again.
void Server::TakeDataset(const legopt_msg::store_dataset_request& request, bus::Responder responder) {
  legopt_msg::store_dataset_reply reply{};
  reply.status = EnumNumber(StoreDatasetStatus::kRefused);
  try {
    CommitNow();  // the store then knows the experiment, and an archive received just before
    const db::ArchiveFacts facts = store_.FindArchiveFacts(request.hash);
    if (!facts.stored) reply.message = ReasonNotToStore(facts, request.archive.size());
    if (facts.stored) {
      reply.status = EnumNumber(StoreDatasetStatus::kStored);
    } else if (reply.message.empty() && request.archive.empty()) {
      reply.status = EnumNumber(StoreDatasetStatus::kWanted);
    } else if (reply.message.empty()) {
      spdlog::info("dataset {}: received the archive, {} bytes", request.hash, request.archive.size());
      ops_.emplace_back(db::StoreDataset{request.hash, {request.archive.begin(), request.archive.end()}});
      reply.status = EnumNumber(StoreDatasetStatus::kStored);
      return Later(std::move(responder), bus::Encode(reply));
    }
  } catch (const db::StoreError& error) {
    if (!error.transient()) throw;
    StoreFailed(error);
    reply.message = std::string("the database cannot be read at the moment: ") + error.what();
  }
  responder.Reply(bus::Encode(reply));
}

const std::string* Server::FindArchive(const std::string& hash) {
  const std::string* archive = options_.find_dataset ? options_.find_dataset(hash) : nullptr;
  if (archive != nullptr) return archive;
  if (archive_.hash != hash || archive_.bytes.empty()) {
    archive_ = {};
    if (auto stored = store_.FindDatasetArchive(hash)) archive_ = {hash, std::move(*stored)};
  }
  return archive_.bytes.empty() ? nullptr : &archive_.bytes;
}

bool Server::OffersDataset(const std::string& hash) {
  return (options_.find_dataset && options_.find_dataset(hash) != nullptr) || store_.FindArchiveFacts(hash).stored;
}

legopt_msg::dataset_reply Server::ReadDatasetChunk(const legopt_msg::dataset_request& request) {
  legopt_msg::dataset_reply reply{};
  const std::string* archive = FindArchive(request.hash);
  reply.status = EnumNumber(archive != nullptr ? DatasetStatus::kFound : DatasetStatus::kUnknown);
  if (archive == nullptr) return reply;
  reply.archive_bytes = static_cast<std::int64_t>(archive->size());
  const auto offset = std::min(static_cast<std::size_t>(request.offset), archive->size());
  const auto begin = archive->begin() + static_cast<std::ptrdiff_t>(offset);
  const std::size_t bytes = std::min(archive->size() - offset, static_cast<std::size_t>(bus::fields::kMaxPieceBytes));
  reply.piece.assign(begin, begin + static_cast<std::ptrdiff_t>(bytes));
  reply.num_bytes = static_cast<std::int32_t>(bytes);
  return reply;
}

// Offers archives that have just been committed.
void Server::OfferStoredDatasets() {
  for (const db::StoreOp& op : ops_) {
    if (const auto* stored = std::get_if<db::StoreDataset>(&op)) scheduler_.SetDatasetOffered(stored->hash, true);
  }
}

}  // namespace legopt::server
