#include "legopt/planning/internal/trace.h"

#include <zstd.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <iterator>
#include <map>
#include <memory>
#include <new>
#include <optional>
#include <type_traits>
#include <utility>

#include "legopt/types/input_error.h"
#include "legopt/types/invariant.h"

namespace legopt {
namespace {

using Bytes = std::vector<std::uint8_t>;

constexpr double kLargestTolerance = 1e-3;  // largest tolerance of a solver: docs/explanation/paper.md#solver-tolerance
constexpr int kCompressionLevel = 3;
constexpr std::size_t kMaxDecoded = std::size_t{16} << 20;  // bytes; EncodeTrace never writes more

bool SameDescent(const IterationRecord& a, const IterationRecord& b) {
  return a.window == b.window && a.restart == b.restart && a.start == b.start && a.penalty == b.penalty;
}

/// Best points of one window so far, for any tolerance of the solver.
class BestSoFar {
 public:
  /// Returns whether the record is better than all before it.
  bool Improves(const IterationRecord& record) {
    if (!std::isfinite(record.cost) || !std::isfinite(record.violation)) return false;
    const bool closer = !least_violation_ || record.violation < *least_violation_;
    if (closer) least_violation_ = record.violation;
    const bool cheaper = record.violation < kLargestTolerance && IsCheaper(record);
    return closer || cheaper;
  }

 private:
  /// Returns whether no record of at most this violation costs as little.
  bool IsCheaper(const IterationRecord& record) {
    const auto above = cost_by_violation_.upper_bound(record.violation);
    if (above != cost_by_violation_.begin() && std::prev(above)->second <= record.cost) return false;
    auto dominated = cost_by_violation_.insert_or_assign(record.violation, record.cost).first;
    for (++dominated; dominated != cost_by_violation_.end() && dominated->second >= record.cost;) {
      dominated = cost_by_violation_.erase(dominated);
    }
    return true;
  }

  std::optional<double> least_violation_;
  std::map<double, double> cost_by_violation_;  ///< costs decrease as violations increase
};

/// Reduces the records to `most` evenly spaced ones; the last accepted one replaces the next one in place.
void ThinEvenly(std::size_t most, std::vector<IterationRecord>& records) {
  std::vector<std::size_t> places(most);
  for (std::size_t i = 0; i < most; ++i) places[i] = i * (records.size() - 1) / (most - 1);
  const auto accepted = std::find_if(records.rbegin(), records.rend(), [](const auto& r) { return r.accepted; });
  if (accepted != records.rend()) {
    const auto last = static_cast<std::size_t>(records.rend() - accepted) - 1;
    *std::lower_bound(places.begin(), places.end(), last) = last;
  }
  std::vector<IterationRecord> kept;
  for (const std::size_t place : places) kept.push_back(records[place]);
  records = std::move(kept);
}

// --- Bytes -----------------------------------------------------------------------------------------------------------

template <class Value>
void AppendColumn(std::span<const IterationRecord> records, Value IterationRecord::*member, Bytes& bytes) {
  for (const IterationRecord& record : records) {
    const Value value = record.*member;
    std::uint8_t raw[sizeof value];
    std::memcpy(raw, &value, sizeof value);
    bytes.insert(bytes.end(), raw, raw + sizeof value);
  }
}

template <class Value>
void TakeColumn(const std::uint8_t*& from, Value IterationRecord::*member, std::vector<IterationRecord>& records) {
  for (IterationRecord& record : records) {
    if constexpr (std::is_same_v<Value, bool>) {
      record.*member = *from != 0;
    } else {
      std::memcpy(&(record.*member), from, sizeof(Value));
    }
    from += sizeof(Value);
  }
}

/// Calls `visit` with each member that is identical in every repetition, in the order of the bytes.
template <class Visit>
void ForEachMember(const Visit& visit) {
  visit(&IterationRecord::step);
  visit(&IterationRecord::window);
  visit(&IterationRecord::restart);
  visit(&IterationRecord::start);
  visit(&IterationRecord::accepted);
  visit(&IterationRecord::evaluations);
  visit(&IterationRecord::penalty);
  visit(&IterationRecord::trust_box);
  visit(&IterationRecord::cost);
  visit(&IterationRecord::violation);
}

std::size_t BytesPerRecord() {
  std::size_t size = 0;
  ForEachMember([&size](auto member) { size += sizeof(IterationRecord{}.*member); });
  return size;
}

/// Shared by both parts: creating one takes as long as compressing a short trace.
using Compressor = std::unique_ptr<ZSTD_CCtx, decltype(&ZSTD_freeCCtx)>;

Bytes Compressed(const Compressor& compressor, const Bytes& plain) {
  Bytes packed(ZSTD_compressBound(plain.size()));
  const std::size_t size =
      ZSTD_compressCCtx(compressor.get(), packed.data(), packed.size(), plain.data(), plain.size(), kCompressionLevel);
  CheckInvariant(ZSTD_isError(size) == 0, "compressed data fit the bound of the compressor");
  packed.resize(size);
  return packed;
}

std::optional<Bytes> Decompressed(std::span<const std::uint8_t> packed) {
  const unsigned long long size = ZSTD_getFrameContentSize(packed.data(), packed.size());
  if (size > kMaxDecoded) return std::nullopt;  // errors and "unknown" are larger than any size
  Bytes plain(size);
  const std::size_t got = ZSTD_decompress(plain.data(), plain.size(), packed.data(), packed.size());
  return ZSTD_isError(got) == 0 && got == size ? std::optional(std::move(plain)) : std::nullopt;
}

using Length = std::uint32_t;  // length of the first compressed part, stored in front of it

}  // namespace

std::vector<IterationRecord> CondenseTrace(std::span<const IterationRecord> history, std::size_t most) {
  CheckInvariant(most >= 2, "a trace has a first and a last record");
  std::vector<IterationRecord> kept;
  BestSoFar best;
  for (std::size_t first = 0, end = 0; first < history.size(); first = end) {
    std::size_t last_accepted = history.size();
    for (end = first; end < history.size() && SameDescent(history[first], history[end]); ++end) {
      if (history[end].accepted) last_accepted = end;
    }
    if (first > 0 && history[first].window != history[first - 1].window) best = BestSoFar();
    for (std::size_t i = first; i < end; ++i) {
      if (best.Improves(history[i]) || i == last_accepted) kept.push_back(history[i]);
    }
  }
  if (kept.size() > most) ThinEvenly(most, kept);
  return kept;
}

std::vector<std::uint8_t> EncodeTrace(std::span<const IterationRecord> records) {
  if (records.empty()) return {};
  Bytes plain, times;
  plain.reserve(records.size() * BytesPerRecord());
  ForEachMember([&](auto member) { AppendColumn(records, member, plain); });
  AppendColumn(records, &IterationRecord::elapsed_us, times);
  const Compressor compressor(ZSTD_createCCtx(), &ZSTD_freeCCtx);
  if (compressor == nullptr) throw std::bad_alloc();
  const Bytes first = Compressed(compressor, plain), second = Compressed(compressor, times);
  const auto length = static_cast<Length>(first.size());
  Bytes bytes(sizeof length);
  std::memcpy(bytes.data(), &length, sizeof length);
  bytes.insert(bytes.end(), first.begin(), first.end());
  bytes.insert(bytes.end(), second.begin(), second.end());
  return bytes;
}

std::vector<IterationRecord> DecodeTrace(std::span<const std::uint8_t> bytes, const std::string& source) {
  if (bytes.empty()) return {};
  const auto refuse = [&source](const char* what) -> InputError {
    return InputError({source, "trace", "", what, "the database or the worker that wrote it is damaged"});
  };
  Length length = 0;
  if (bytes.size() < sizeof length) throw refuse("ends before it begins");
  std::memcpy(&length, bytes.data(), sizeof length);
  const std::span<const std::uint8_t> packed = bytes.subspan(sizeof length);
  if (length > packed.size()) throw refuse("is cut off");
  const std::optional<Bytes> plain = Decompressed(packed.first(length)), times = Decompressed(packed.subspan(length));
  if (!plain || !times) throw refuse("cannot be decompressed");
  const std::size_t count = times->size() / sizeof(IterationRecord::elapsed_us);
  if (count * sizeof(IterationRecord::elapsed_us) != times->size() || count * BytesPerRecord() != plain->size()) {
    throw refuse("has columns of different lengths");
  }
  std::vector<IterationRecord> records(count);
  const std::uint8_t* from = plain->data();
  ForEachMember([&](auto member) { TakeColumn(from, member, records); });
  from = times->data();
  TakeColumn(from, &IterationRecord::elapsed_us, records);
  return records;
}

}  // namespace legopt
