// Writes the seeds of the binary formats into a corpus folder: make_seeds tests/fuzz/corpus. Run it again after
// protocol changes; the seeds are committed.
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "bus/codec.h"
#include "bus/wire.h"
#include "tests/bus/sample_messages.h"

namespace legopt::bus {
namespace {

void Write(const std::filesystem::path& file, const std::string& bytes) {
  std::filesystem::create_directories(file.parent_path());
  std::ofstream(file, std::ios::binary) << bytes;
}

std::string AsText(std::span<const std::uint8_t> bytes) { return {bytes.begin(), bytes.end()}; }

// Same choice as in messages.cpp.
template <class... Message>
void WriteMessages(const std::filesystem::path& folder, MessageList<Message...> /*all*/) {
  (Write(folder / Message::getTypeName(),
         std::string(1, static_cast<char>(kMessageIndex<Message>)) + Encode(Sample<Message>())),
   ...);
}

FrameHeader Header(FrameKind kind) {
  FrameHeader header;
  header.kind = kind;
  header.type = static_cast<std::int16_t>(MessageType::kQuery);
  header.deployment = 4711;
  header.sender = 1000;
  header.destination = kServer;
  header.session = 7;
  header.call_id = 1;
  header.nonce = 1;
  return header;
}

void WriteFrames(const std::filesystem::path& folder) {
  const std::array<std::uint8_t, MessageKey::kBytes> zeros{};
  const MessageKey key(zeros);
  for (std::int16_t kind = 1; kind <= kLastFrameKind; ++kind) {
    DatagramBuffer buffer{};
    std::size_t size = 16;
    if (kind == 4 || kind == 5) {
      const std::vector<std::uint8_t> data(976, 3);
      ChunkView chunk;
      chunk.total_bytes = 2000;
      chunk.index = 1;
      chunk.data = data;
      size = WriteChunk(chunk, buffer.data() + kFrameHeaderBytes);
    } else if (kind == 6) {
      size = WriteAck({}, buffer.data() + kFrameHeaderBytes);
    } else if (kind == 7) {
      WriteChallenge(5, buffer.data() + kFrameHeaderBytes);
      size = kChallengeBytes;
    }
    const auto header = Header(static_cast<FrameKind>(kind));
    Write(folder / ("kind" + std::to_string(kind)), AsText(SealFrame(header, size, buffer)));
    Write(folder / ("kind" + std::to_string(kind) + "-keyed"), AsText(SealFrame(header, size, buffer, &key)));
  }
}

}  // namespace
}  // namespace legopt::bus

int main(int argc, char** argv) {
  using namespace legopt::bus;
  if (argc != 2) return 2;
  const std::filesystem::path corpus = argv[1];
  PrepareHashing();
  WriteMessages(corpus / "messages", AllMessages());
  WriteFrames(corpus / "frame");
  // Steps of reassembler.cpp: choice, size of the body, index, time. Two complete bodies, in and out of order.
  Write(corpus / "reassembler" / "in-order",
        std::string("\x04\x0b\xb8\x00\x01\x04\x0b\xb8\x01\x01\x04\x0b\xb8\x02\x01", 15));
  Write(corpus / "reassembler" / "backwards",
        std::string("\x45\x0b\xb8\x02\x01\x41\x0b\xb8\x01\x01\x45\x0b\xb8\x00\x01", 15));
  Write(corpus / "reassembler" / "contradicting",
        std::string("\x04\x0b\xb8\x00\x01\x0c\x0b\xb8\x01\x01\x14\x0f\xb8\x01\xff", 15));
  // Steps of endpoint.cpp: a request, its repetition, a proof by the key's holder, a request chunk, noise.
  const std::string request("\x10\x00\x05\x00\x01\x09\x00\x00\x01\x01\x00\x01\x00\x00\x01hello", 20);
  const std::string proof("\x10\x00\x00\x00\x07\x09\x00\x00\x01\x01\x00\x00\x00\x02", 14);
  for (const char key : {'\0', '\1'}) {
    Write(corpus / "endpoint" / (key == 0 ? "without-key" : "with-key"),
          std::string(1, key) + request + request + proof + request + std::string("\x12\x00\x04noise", 8));
  }
  return 0;
}
