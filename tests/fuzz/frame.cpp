// Frames, chunks, acknowledgements and challenges of arbitrary bytes, with and without a valid tag.
#include <array>

#include "bus/wire.h"
#include "tests/fuzz/fuzz_input.h"

namespace legopt::bus {
namespace {

void ReadPayload(std::span<const std::uint8_t> payload) {
  ChunkView chunk;
  if (ReadChunk(payload, std::size_t{64} << 20, chunk)) {
    fuzz::Require(chunk.data.size() <= kChunkBytes, "a chunk is at most 1,024 bytes");
    std::array<std::uint8_t, kChunkHeaderBytes + kChunkBytes> again{};
    const std::size_t size = WriteChunk(chunk, again.data());
    fuzz::Require(std::equal(payload.begin(), payload.end(), again.begin(), again.begin() + size), "chunk round trip");
  }
  ChunkAck ack;
  if (ReadAck(payload, ack)) {
    std::array<std::uint8_t, 64> again{};
    const std::size_t size = WriteAck(ack, again.data());
    fuzz::Require(std::equal(payload.begin(), payload.end(), again.begin(), again.begin() + size), "ack round trip");
  }
  fuzz::Require(ReadChallenge(payload) >= 0, "a challenge is positive or none");
}

void Open(std::span<const std::uint8_t> datagram, const MessageKey* key) {
  FrameView frame;
  if (OpenFrame(datagram, 4711, kServer, frame, key) == FrameFault::kNone) {
    fuzz::Require(frame.payload.size() <= kMaxPayloadBytes, "payload bound");
    ReadPayload(frame.payload);
  }
}

}  // namespace
}  // namespace legopt::bus

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace legopt::bus;
  PrepareHashing();
  std::array<std::uint8_t, MessageKey::kBytes> bytes{};
  const MessageKey key(bytes);
  const std::span<const std::uint8_t> input(data, size);
  Open(input, nullptr);
  Open(input, &key);
  ReadPayload(input);
  return 0;
}
