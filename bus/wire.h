#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "bus/message_key.h"
#include "bus/messages.h"
#include "bus/transport.h"

/// @file
/// Frames, chunks and acknowledgements as bytes, without allocation: the same encoding as the generated types frame,
/// chunk and chunk_ack (the tests compare them), written and read in place. For bus, and for who only listens
/// (`legopt tap`). Source: PROTOCOL.md, sections 3, 6.

namespace legopt::bus {

/// What a frame is: frame.kind, PROTOCOL.md, section 3.
enum class FrameKind : std::int16_t {
  kRequest = 1,       ///< small body
  kReply = 2,         ///< small body
  kError = 3,         ///< text of a refusal, or a challenge
  kRequestChunk = 4,  ///< piece of a large body
  kReplyChunk = 5,    ///< piece of a large body
  kChunkAck = 6,      ///< what has arrived of one
  kProof = 7,         ///< of a session, where a key is configured
};
/// The kinds are 1 .. kLastFrameKind.
inline constexpr std::int16_t kLastFrameKind = 7;

inline constexpr std::size_t kFrameHeaderBytes = 92;  ///< of every frame, before its payload
inline constexpr std::size_t kMaxPayloadBytes = kMaxDatagramBytes - kFrameHeaderBytes;  ///< what one datagram takes
inline constexpr std::size_t kChallengeBytes = 8;     ///< payload of a proof, and of the refusal that asks for one
inline constexpr std::size_t kChunkBytes = 1024;      ///< of a body, per chunk
inline constexpr std::size_t kChunkHeaderBytes = 57;  ///< of a chunk, before its data
/// Furthest chunk beyond the first missing one that an acknowledgement can name.
inline constexpr std::int32_t kAckReach = 64;
inline constexpr std::size_t kWindow = 32;           ///< chunks in flight to one receiver, at most
inline constexpr std::size_t kObjectHashBytes = 32;  ///< BLAKE2b-256
static_assert(kFrameHeaderBytes + kChunkHeaderBytes + kChunkBytes <= kMaxDatagramBytes);

/// Lets libsodium choose its fastest code for this machine. Idempotent, thread-safe; before any hashing or random draw.
/// Throws BusError (kNetworkUnusable).
void PrepareHashing();

/// Names the content of a body.
using ObjectHash = std::array<std::uint8_t, kObjectHashBytes>;
/// BLAKE2b-256 of all bytes. After PrepareHashing().
ObjectHash HashObject(std::span<const std::uint8_t> body);

/// The fields of a frame by their names in frame.lcm, without tag and payload.
struct FrameHeader {
  std::int16_t version = kProtocolVersion;  ///< of the protocol
  FrameKind kind{};                         ///< what the payload is
  std::int16_t type = 0;                    ///< MessageType of the call
  std::int16_t code = 0;                    ///< of a refusal, an ErrorCode; else 0
  std::int64_t deployment = 0;              ///< of the transport
  EndpointId sender = 0;                    ///< > 0
  EndpointId destination = 0;               ///< > 0
  std::int64_t session = 0;                 ///< of the caller, > 0
  std::int64_t call_id = 0;                 ///< within the session, from 1
  std::int64_t completed_below = 0;         ///< of requests and their chunks: calls with smaller ids are over; else 0
  std::int64_t nonce = 0;                   ///< counts the sender's frames in its life, from 1
  KeyRole role = KeyRole::kOperator;        ///< not a field: role of the key that the tag is made with
};

/// A frame in place.
struct FrameView {
  FrameHeader header;                     ///< as received
  std::span<const std::uint8_t> payload;  ///< within the datagram
  bool authentic = false;                 ///< the tag is right: under the key, or, where there is none, as a checksum
};

/// Why a frame is not taken.
enum class FrameFault {
  kNone,        ///< taken
  kSize,        ///< empty, or more than a datagram takes
  kMalformed,   ///< no frame, by its fingerprint or its lengths
  kDeployment,  ///< of another deployment
  kNotForUs,    ///< for another party; no fault of its sender
  kTag,         ///< damaged, or forged; or made with a key that does not follow from ours
  kUnsigned,    ///< the tag of somebody without the key
  kField,       ///< a field out of range
  kVersion      ///< another protocol version
};

/// Room for any datagram.
using DatagramBuffer = std::array<std::uint8_t, kMaxDatagramBytes>;

/// Writes a frame around a payload that already stands at buffer[kFrameHeaderBytes ...]; returns the whole datagram.
/// `payload_bytes` must be at most kMaxPayloadBytes. If there is a key, the tag is made with that of header.role, which
/// must follow from `key`. Aborts otherwise.
std::span<const std::uint8_t> SealFrame(const FrameHeader& header, std::size_t payload_bytes, DatagramBuffer& buffer,
                                        const MessageKey* key = nullptr);

inline constexpr EndpointId kAnybody = 0;  ///< as `self`: frames for every party are for us

/// Checks in this order: size, form, deployment, destination, tag, fields, version. The header's role names the key of
/// the tag: `key` or one derived from it; kUnsigned: the sender does not have that key. On kUnsigned and kVersion the
/// header is valid, so that an error reply is possible; except for kSize and kMalformed it is at least filled in.
/// `frame` points into `datagram`.
FrameFault OpenFrame(std::span<const std::uint8_t> datagram, std::int64_t deployment, EndpointId self, FrameView& frame,
                     const MessageKey* key = nullptr);

/// A challenge as payload.
void WriteChallenge(std::int64_t challenge, std::uint8_t* payload);
/// 0 when it is not exactly one positive challenge.
std::int64_t ReadChallenge(std::span<const std::uint8_t> payload);

/// A chunk in place: PROTOCOL.md, section 6.
struct ChunkView {
  std::int64_t total_bytes = 0;        ///< of the whole body
  ObjectHash hash{};                   ///< of the whole body
  std::int32_t index = 0;              ///< place among the chunks, from 0
  bool ack_requested = false;          ///< acknowledge at once
  std::span<const std::uint8_t> data;  ///< within the datagram; full but for the last chunk
};

/// Chunks that a body is cut into.
inline std::size_t NumChunks(std::size_t body_bytes) { return (body_bytes + kChunkBytes - 1) / kChunkBytes; }

/// Writes `chunk` at `payload` (room for kChunkHeaderBytes + data); returns the bytes written.
std::size_t WriteChunk(const ChunkView& chunk, std::uint8_t* payload);
/// False when it is not exactly one chunk whose index and size fit total_bytes, or total_bytes is above
/// `max_object_bytes`.
bool ReadChunk(std::span<const std::uint8_t> payload, std::size_t max_object_bytes, ChunkView& chunk);

/// What has arrived of a body: PROTOCOL.md, section 6. The fields are those of chunk_ack.lcm.
struct ChunkAck {
  bool of_reply = false;            ///< else of the request
  bool complete = false;            ///< the whole body is there and verified
  std::int64_t reassembly = 0;      ///< number of this attempt at the body
  std::int32_t received_below = 0;  ///< every chunk with a smaller index is here
  std::uint64_t received_mask = 0;  ///< bit i: chunk received_below + 1 + i is here
  std::int32_t credit = 1;          ///< chunks that may be in flight to this party, 1 .. kWindow
};
/// Writes `ack` at `payload` (room for 34 bytes); returns the bytes written.
std::size_t WriteAck(const ChunkAck& ack, std::uint8_t* payload);
/// False when it is not exactly one acknowledgement with its fields in range.
bool ReadAck(std::span<const std::uint8_t> payload, ChunkAck& ack);

}  // namespace legopt::bus
