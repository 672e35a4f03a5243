#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "bus/message_key.h"
#include "bus/messages.h"
#include "bus/transport.h"

/// Frames, chunks and acknowledgements as bytes, without allocation: the same encoding as the generated types frame,
/// chunk and chunk_ack (the tests compare them), written and read in place. For bus, and for who only listens
/// (`legopt tap`). Source: PROTOCOL.md, sections 3, 6.
namespace legopt::bus {

enum class FrameKind : std::int16_t {
  kRequest = 1,
  kReply = 2,
  kError = 3,
  kRequestChunk = 4,
  kReplyChunk = 5,
  kChunkAck = 6,
  kProof = 7,  ///< of a session, where a key is configured
};
inline constexpr std::int16_t kLastFrameKind = 7;

inline constexpr std::size_t kFrameHeaderBytes = 92;
inline constexpr std::size_t kMaxPayloadBytes = kMaxDatagramBytes - kFrameHeaderBytes;
inline constexpr std::size_t kChallengeBytes = 8;  ///< payload of a proof, and of the refusal that asks for one
inline constexpr std::size_t kChunkBytes = 1024;   ///< of a body, per chunk
inline constexpr std::size_t kChunkHeaderBytes = 57;
inline constexpr std::size_t kWindow = 32;  ///< chunks in flight to one receiver, at most
inline constexpr std::size_t kObjectHashBytes = 32;
static_assert(kFrameHeaderBytes + kChunkHeaderBytes + kChunkBytes <= kMaxDatagramBytes);

/// Lets libsodium choose its fastest code for this machine. Idempotent, thread-safe; before any hashing or random draw.
/// Throws BusError (kNetworkUnusable).
void PrepareHashing();

using ObjectHash = std::array<std::uint8_t, kObjectHashBytes>;
ObjectHash HashObject(std::span<const std::uint8_t> body);

struct FrameHeader {
  std::int16_t version = kProtocolVersion;
  FrameKind kind{};
  std::int16_t type = 0;
  std::int16_t code = 0;
  std::int64_t deployment = 0;
  EndpointId sender = 0;
  EndpointId destination = 0;
  std::int64_t session = 0;
  std::int64_t call_id = 0;
  std::int64_t completed_below = 0;
  std::int64_t nonce = 0;
};

struct FrameView {
  FrameHeader header;
  std::span<const std::uint8_t> payload;
  bool authentic = false;  ///< the tag is right: under the key, or, where there is none, as a checksum
};

enum class FrameFault { kNone, kSize, kMalformed, kDeployment, kNotForUs, kTag, kUnsigned, kField, kVersion };

using DatagramBuffer = std::array<std::uint8_t, kMaxDatagramBytes>;

/// Writes a frame around a payload that already stands at buffer[kFrameHeaderBytes ...]; returns the whole datagram.
/// `payload_bytes` must be at most kMaxPayloadBytes (aborts otherwise). The tag is made with `key`, if there is one.
std::span<const std::uint8_t> SealFrame(const FrameHeader& header, std::size_t payload_bytes, DatagramBuffer& buffer,
                                        const MessageKey* key = nullptr);

inline constexpr EndpointId kAnybody = 0;  ///< as `self`: frames for every party are for us

/// Checks in this order: size, form, deployment, destination, tag (kUnsigned: the tag of somebody without the key),
/// fields, version. On kUnsigned and kVersion the header is legal, so that the sender can be told; but for kSize and
/// kMalformed it is at least filled in. `frame` points into `datagram`.
FrameFault OpenFrame(std::span<const std::uint8_t> datagram, std::int64_t deployment, EndpointId self, FrameView& frame,
                     const MessageKey* key = nullptr);

/// A challenge as payload.
void WriteChallenge(std::int64_t challenge, std::uint8_t* payload);
/// 0 when it is not exactly one positive challenge.
std::int64_t ReadChallenge(std::span<const std::uint8_t> payload);

struct ChunkView {
  std::int64_t total_bytes = 0;
  ObjectHash hash{};
  std::int32_t index = 0;
  bool ack_requested = false;
  std::span<const std::uint8_t> data;
};

inline std::size_t NumChunks(std::size_t body_bytes) { return (body_bytes + kChunkBytes - 1) / kChunkBytes; }

/// Writes `chunk` at `payload` (room for kChunkHeaderBytes + data); returns the bytes written.
std::size_t WriteChunk(const ChunkView& chunk, std::uint8_t* payload);
/// False when it is not exactly one chunk whose index and size fit total_bytes, or total_bytes is above
/// `max_object_bytes`.
bool ReadChunk(std::span<const std::uint8_t> payload, std::size_t max_object_bytes, ChunkView& chunk);

struct ChunkAck {
  bool of_reply = false;
  bool complete = false;
  std::int64_t reassembly = 0;
  std::int32_t received_below = 0;
  std::uint64_t received_mask = 0;
  std::int32_t credit = 1;
};
std::size_t WriteAck(const ChunkAck& ack, std::uint8_t* payload);
bool ReadAck(std::span<const std::uint8_t> payload, ChunkAck& ack);

}  // namespace legopt::bus
