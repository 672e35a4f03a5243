// The chunk reassembler with valid, contradicting and foreign chunks in any order over time: a completed body matches
// its hash, and memory stays within the limit.
#include <array>
#include <string>

#include "bus/bulk_transfer.h"
#include "bus/wire.h"
#include "tests/fuzz/fuzz_input.h"

namespace legopt::bus {
namespace {

constexpr std::size_t kMaxIncoming = 64 * 1024;

// Bodies that the chunks are taken from: body n consists of bytes n.
std::string Body(std::size_t size, std::uint8_t fill) { return std::string(size, static_cast<char>(fill)); }

void Step(fuzz::FuzzInput& input, BulkReceiver& receiver, microseconds now) {
  const auto choice = static_cast<std::uint8_t>(input.Number(1));
  const std::size_t total = 1 + static_cast<std::size_t>(input.Number(2)) % (2 * kMaxIncoming);
  const std::string body = Body(total, choice & 3U);
  ChunkView chunk;
  chunk.total_bytes = static_cast<std::int64_t>(total);
  chunk.index = static_cast<std::int32_t>(input.Number(1));
  chunk.ack_requested = (choice & 4U) != 0;
  chunk.hash = HashObject({reinterpret_cast<const std::uint8_t*>(body.data()), body.size()});
  if ((choice & 8U) != 0) chunk.hash[0] ^= 1;
  const std::size_t offset = std::min(total, static_cast<std::size_t>(chunk.index) * kChunkBytes);
  std::string data = body.substr(offset, kChunkBytes);
  if ((choice & 16U) != 0 && !data.empty()) data[0] = static_cast<char>(data[0] ^ 1);
  chunk.data = {reinterpret_cast<const std::uint8_t*>(data.data()), data.size()};
  std::array<std::uint8_t, kChunkHeaderBytes + kChunkBytes> payload{};
  const std::size_t size = WriteChunk(chunk, payload.data());
  ChunkView read;
  if (!ReadChunk({payload.data(), size}, 2 * kMaxIncoming, read)) return;
  const ObjectKey key{1 + (choice >> 6U), 1, 1 + ((choice >> 5U) & 1), false};
  const auto outcome = receiver.Accept(key, read, now);
  if (!outcome.body) return;
  const auto* bytes = reinterpret_cast<const std::uint8_t*>(outcome.body->data());
  fuzz::Require(HashObject({bytes, outcome.body->size()}) == read.hash, "a body is what its hash says");
}

}  // namespace
}  // namespace legopt::bus

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace legopt::bus;
  PrepareHashing();
  Counters counters;
  BulkReceiver receiver(counters, {kMaxIncoming, std::chrono::milliseconds(100)}, 1);
  legopt::fuzz::FuzzInput input(data, size);
  microseconds now{0};
  while (!input.empty()) {
    Step(input, receiver, now);
    now += microseconds(input.Number(1) * 200);
    receiver.OnTimer(now);
    legopt::fuzz::Require(receiver.held_bytes() <= kMaxIncoming, "memory stays within the limit");
  }
  receiver.OnTimer(now + std::chrono::seconds(1));
  legopt::fuzz::Require(receiver.held_bytes() == 0, "nothing incomplete is kept");
  return 0;
}
