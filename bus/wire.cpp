#include "bus/wire.h"

#include <sodium.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <optional>

#include "bus/bus_error.h"
#include "bus/message_key.h"

namespace legopt::bus {
namespace {

constexpr std::size_t kTagOffset = 72;

FrameHeader ReadHeader(Reader& reader) {
  FrameHeader header;
  header.version = reader.Get<std::int16_t>();
  header.kind = static_cast<FrameKind>(reader.Get<std::int16_t>());
  header.type = reader.Get<std::int16_t>();
  header.code = reader.Get<std::int16_t>();
  header.deployment = reader.Get<std::int64_t>();
  header.sender = reader.Get<std::int64_t>();
  header.destination = reader.Get<std::int64_t>();
  header.session = reader.Get<std::int64_t>();
  header.call_id = reader.Get<std::int64_t>();
  header.completed_below = reader.Get<std::int64_t>();
  header.nonce = reader.Get<std::int64_t>();
  return header;
}

bool FieldsAreLegal(const FrameHeader& header) {
  const auto kind = static_cast<std::int16_t>(header.kind);
  return kind >= 1 && kind <= kLastFrameKind && header.type >= 1 && header.code >= 0 && header.sender >= 1 &&
         header.session >= 1 && header.call_id >= 1 && header.completed_below >= 0 &&
         header.completed_below <= header.call_id;
}

}  // namespace

void PrepareHashing() {
  if (sodium_init() < 0) throw BusError(BusErrorCode::kNetworkUnusable, "libsodium cannot initialise itself");
}

ObjectHash HashObject(std::span<const std::uint8_t> body) {
  ObjectHash hash;
  crypto_generichash(hash.data(), hash.size(), body.data(), body.size(), nullptr, 0);
  return hash;
}

std::span<const std::uint8_t> SealFrame(const FrameHeader& header, std::size_t payload_bytes, DatagramBuffer& buffer,
                                        const MessageKey* key) {
  if (payload_bytes > kMaxPayloadBytes) {
    std::fprintf(stderr, "legopt bus: broken invariant: payload of %zu bytes, limit %zu\n", payload_bytes,
                 kMaxPayloadBytes);
    std::abort();
  }
  Writer writer(buffer.data());
  writer.Put(legopt_msg::frame::getHash())
      .Put(header.version)
      .Put(static_cast<std::int16_t>(header.kind))
      .Put(header.type)
      .Put(header.code)
      .Put(header.deployment)
      .Put(header.sender)
      .Put(header.destination)
      .Put(header.session)
      .Put(header.call_id)
      .Put(header.completed_below)
      .Put(header.nonce);
  Writer(writer.at() + kTagBytes).Put(static_cast<std::int32_t>(payload_bytes));
  const std::span<const std::uint8_t> datagram(buffer.data(), kFrameHeaderBytes + payload_bytes);
  writer.Bytes(ComputeTag(datagram, kTagOffset, KeyOfRole(key, header.role)));
  return datagram;
}

FrameFault OpenFrame(std::span<const std::uint8_t> datagram, std::int64_t deployment, EndpointId self, FrameView& frame,
                     const MessageKey* key) {
  if (datagram.empty() || datagram.size() > kMaxDatagramBytes) return FrameFault::kSize;
  if (datagram.size() < kFrameHeaderBytes) return FrameFault::kMalformed;
  Reader reader(datagram.data());
  if (reader.Get<std::int64_t>() != legopt_msg::frame::getHash()) return FrameFault::kMalformed;
  frame.header = ReadHeader(reader);
  Tag tag;
  reader.Bytes(tag);  // checked below, in the datagram
  const auto payload_bytes = reader.Get<std::int32_t>();
  if (payload_bytes < 0 || static_cast<std::size_t>(payload_bytes) != datagram.size() - kFrameHeaderBytes) {
    return FrameFault::kMalformed;
  }
  frame.payload = datagram.subspan(kFrameHeaderBytes);
  if (frame.header.deployment != deployment) return FrameFault::kDeployment;
  if (self != kAnyDestination && frame.header.destination != self) return FrameFault::kNotForUs;
  const std::optional<KeyRole> role = RoleOfTag(datagram, kTagOffset, key);
  frame.authentic = role.has_value();
  frame.header.role = role.value_or(KeyRole::kOperator);
  const bool is_unsigned = !frame.authentic && key != nullptr && TagIsRight(datagram, kTagOffset, nullptr);
  if (!frame.authentic && !is_unsigned) return FrameFault::kTag;
  if (!FieldsAreLegal(frame.header)) return FrameFault::kField;
  if (is_unsigned) return FrameFault::kUnsigned;
  if (frame.header.version != kProtocolVersion) return FrameFault::kVersion;
  return FrameFault::kNone;
}

void WriteChallenge(std::int64_t challenge, std::uint8_t* payload) { Writer(payload).Put(challenge); }

std::int64_t ReadChallenge(std::span<const std::uint8_t> payload) {
  if (payload.size() != kChallengeBytes) return 0;
  return std::max<std::int64_t>(0, Reader(payload.data()).Get<std::int64_t>());
}

std::size_t WriteChunk(const ChunkView& chunk, std::uint8_t* payload) {
  Writer writer(payload);
  writer.Put(legopt_msg::chunk::getHash())
      .Put(chunk.total_bytes)
      .Bytes(chunk.hash)
      .Put(chunk.index)
      .Put(static_cast<std::int8_t>(chunk.ack_requested))
      .Put(static_cast<std::int32_t>(chunk.data.size()))
      .Bytes(chunk.data);
  return kChunkHeaderBytes + chunk.data.size();
}

bool ReadChunk(std::span<const std::uint8_t> payload, std::size_t max_object_bytes, ChunkView& chunk) {
  if (payload.size() < kChunkHeaderBytes) return false;
  Reader reader(payload.data());
  if (reader.Get<std::int64_t>() != legopt_msg::chunk::getHash()) return false;
  chunk.total_bytes = reader.Get<std::int64_t>();
  reader.Bytes(chunk.hash);
  chunk.index = reader.Get<std::int32_t>();
  const auto ack_requested = reader.Get<std::int8_t>();
  const auto data_bytes = reader.Get<std::int32_t>();
  if (chunk.total_bytes < 1 || static_cast<std::uint64_t>(chunk.total_bytes) > max_object_bytes) return false;
  if (ack_requested < 0 || ack_requested > 1) return false;
  chunk.ack_requested = ack_requested == 1;
  const auto chunks = NumChunks(static_cast<std::size_t>(chunk.total_bytes));
  if (chunk.index < 0 || static_cast<std::size_t>(chunk.index) >= chunks) return false;
  chunk.data = payload.subspan(kChunkHeaderBytes);
  const std::size_t offset = static_cast<std::size_t>(chunk.index) * kChunkBytes;
  const std::size_t expected = std::min(kChunkBytes, static_cast<std::size_t>(chunk.total_bytes) - offset);
  return data_bytes >= 0 && static_cast<std::size_t>(data_bytes) == expected && chunk.data.size() == expected;
}

std::size_t WriteAck(const ChunkAck& ack, std::uint8_t* payload) {
  Writer writer(payload);
  writer.Put(legopt_msg::chunk_ack::getHash())
      .Put(static_cast<std::int8_t>(ack.of_reply))
      .Put(static_cast<std::int8_t>(ack.complete))
      .Put(ack.reassembly)
      .Put(ack.received_below)
      .Put(ack.received_mask)
      .Put(ack.credit);
  return static_cast<std::size_t>(writer.at() - payload);
}

bool ReadAck(std::span<const std::uint8_t> payload, ChunkAck& ack) {
  constexpr std::size_t kAckBytes = 34;
  if (payload.size() != kAckBytes) return false;
  Reader reader(payload.data());
  if (reader.Get<std::int64_t>() != legopt_msg::chunk_ack::getHash()) return false;
  const auto of_reply = reader.Get<std::int8_t>();
  const auto complete = reader.Get<std::int8_t>();
  ack.reassembly = reader.Get<std::int64_t>();
  ack.received_below = reader.Get<std::int32_t>();
  ack.received_mask = reader.Get<std::uint64_t>();
  ack.credit = reader.Get<std::int32_t>();
  if (of_reply < 0 || of_reply > 1 || complete < 0 || complete > 1) return false;
  if (ack.received_below < 0 || ack.credit < 1 || ack.credit > static_cast<std::int32_t>(kWindow)) return false;
  ack.of_reply = of_reply == 1;
  ack.complete = complete == 1;
  return true;
}

}  // namespace legopt::bus
