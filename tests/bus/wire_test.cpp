// The hand-written coders of wire.h write and read the same bytes as the generated ones.
#include "bus/wire.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "bus/codec.h"

namespace legopt::bus {
namespace {

FrameHeader Header() {
  FrameHeader header;
  header.kind = FrameKind::kRequest;
  header.type = 3;
  header.code = 0;
  header.deployment = 0x0102030405060708;
  header.sender = 6;
  header.destination = 7;
  header.session = 8;
  header.call_id = 10;
  header.completed_below = 9;
  header.nonce = 11;
  return header;
}

std::string AsText(std::span<const std::uint8_t> bytes) { return {bytes.begin(), bytes.end()}; }

TEST(Wire, FrameIsTheGeneratedFrame) {
  DatagramBuffer buffer{};
  const std::string payload = "payload";
  std::copy(payload.begin(), payload.end(), buffer.begin() + kFrameHeaderBytes);
  const auto datagram = SealFrame(Header(), payload.size(), buffer);
  std::string why;
  const auto frame = Decode<legopt_msg::frame>(AsText(datagram), &why);
  ASSERT_TRUE(frame.has_value()) << why;
  EXPECT_EQ(frame->version, kProtocolVersion);
  EXPECT_EQ(frame->kind, 1);
  EXPECT_EQ(frame->type, 3);
  EXPECT_EQ(frame->deployment, 0x0102030405060708);
  EXPECT_EQ(frame->sender, 6);
  EXPECT_EQ(frame->destination, 7);
  EXPECT_EQ(frame->session, 8);
  EXPECT_EQ(frame->call_id, 10);
  EXPECT_EQ(frame->completed_below, 9);
  EXPECT_EQ(frame->nonce, 11);
  EXPECT_EQ(std::string(frame->payload.begin(), frame->payload.end()), payload);
  EXPECT_EQ(Encode(*frame), AsText(datagram));

  FrameView view;
  ASSERT_EQ(OpenFrame(datagram, 0x0102030405060708, 7, view), FrameFault::kNone);
  EXPECT_EQ(view.header.call_id, 10);
  EXPECT_EQ(AsText(view.payload), payload);
}

TEST(Wire, EveryChangedByteIsNoticed) {
  DatagramBuffer buffer{};
  const auto datagram = SealFrame(Header(), 20, buffer);
  FrameView view;
  for (std::size_t at = 0; at < datagram.size(); ++at) {
    std::vector<std::uint8_t> changed(datagram.begin(), datagram.end());
    changed[at] ^= 0x10;
    EXPECT_NE(OpenFrame(changed, 0x0102030405060708, 7, view), FrameFault::kNone) << at;
  }
}

TEST(Wire, FaultsAreToldApart) {
  DatagramBuffer buffer{};
  FrameView view;
  const auto open = [&](const FrameHeader& header) {
    return OpenFrame(SealFrame(header, 0, buffer), 0x0102030405060708, 7, view);
  };
  EXPECT_EQ(OpenFrame({}, 1, 7, view), FrameFault::kSize);
  EXPECT_EQ(OpenFrame(std::vector<std::uint8_t>(kMaxDatagramBytes + 1), 1, 7, view), FrameFault::kSize);
  EXPECT_EQ(OpenFrame(std::vector<std::uint8_t>(200), 1, 7, view), FrameFault::kMalformed);
  FrameHeader header = Header();
  header.deployment = 1;
  EXPECT_EQ(open(header), FrameFault::kDeployment);
  header = Header();
  header.destination = 8;
  EXPECT_EQ(open(header), FrameFault::kNotForUs);
  header = Header();
  header.version = kProtocolVersion + 1;
  EXPECT_EQ(open(header), FrameFault::kVersion);
  header = Header();
  header.kind = static_cast<FrameKind>(kLastFrameKind + 1);
  EXPECT_EQ(open(header), FrameFault::kField);
  header = Header();
  header.completed_below = 11;  // beyond the call itself
  EXPECT_EQ(open(header), FrameFault::kField);
  header = Header();
  header.session = 0;
  EXPECT_EQ(open(header), FrameFault::kField);
}

TEST(Wire, ChunkIsTheGeneratedChunk) {
  std::vector<std::uint8_t> data(kChunkBytes, 7);
  ChunkView chunk;
  chunk.total_bytes = 3 * kChunkBytes;
  chunk.hash.fill(9);
  chunk.index = 2;
  chunk.ack_requested = true;
  chunk.data = data;
  std::vector<std::uint8_t> bytes(kChunkHeaderBytes + data.size());
  ASSERT_EQ(WriteChunk(chunk, bytes.data()), bytes.size());
  const auto generated = Decode<legopt_msg::chunk>(AsText(bytes));
  ASSERT_TRUE(generated.has_value());
  EXPECT_EQ(Encode(*generated), AsText(bytes));
  ChunkView read;
  ASSERT_TRUE(ReadChunk(bytes, kMaxMessageBytes, read));
  EXPECT_EQ(read.index, 2);
  EXPECT_EQ(read.hash, chunk.hash);
  EXPECT_TRUE(read.ack_requested);
  EXPECT_EQ(read.data.size(), kChunkBytes);
  EXPECT_FALSE(ReadChunk(bytes, 2 * kChunkBytes, read));  // above the receiver's limit
}

TEST(Wire, AcknowledgementIsTheGeneratedOne) {
  ChunkAck ack;
  ack.of_reply = true;
  ack.reassembly = 77;
  ack.received_below = 5;
  ack.received_mask = 0x8000000000000001;
  ack.credit = 30;
  std::vector<std::uint8_t> bytes(64);
  bytes.resize(WriteAck(ack, bytes.data()));
  const auto generated = Decode<legopt_msg::chunk_ack>(AsText(bytes));
  ASSERT_TRUE(generated.has_value());
  EXPECT_EQ(Encode(*generated), AsText(bytes));
  ChunkAck read;
  ASSERT_TRUE(ReadAck(bytes, read));
  EXPECT_EQ(read.received_mask, ack.received_mask);
  EXPECT_EQ(read.reassembly, 77);
  bytes.pop_back();
  EXPECT_FALSE(ReadAck(bytes, read));
}

TEST(WireDeathTest, APayloadAboveTheLimitIsABrokenInvariant) {
  DatagramBuffer buffer{};
  EXPECT_DEATH(SealFrame(Header(), kMaxPayloadBytes + 1, buffer), "payload of 1109 bytes");
}

}  // namespace
}  // namespace legopt::bus
