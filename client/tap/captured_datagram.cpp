#include "client/tap/captured_datagram.h"

#include <array>
#include <cstddef>
#include <optional>
#include <tuple>
#include <utility>
#include <vector>

#include "bus/codec.h"
#include "bus/endpoint.h"
#include "bus/field_check.h"
#include "bus/message_fields.h"

namespace legopt::client {
namespace {

using Json = nlohmann::ordered_json;

template <class Message>
Json ToJson(const Message& message);

Json ValueToJson(const std::string& text) { return text; }
template <class Number>
requires std::is_arithmetic_v<Number> Json ValueToJson(Number number) { return number; }
template <class Message>
requires std::is_class_v<Message> Json ValueToJson(const Message& nested) { return ToJson(nested); }
template <class Value>
Json ValueToJson(const std::vector<Value>& values) {
  Json array = Json::array();
  for (const Value& value : values) array.push_back(ValueToJson(value));
  return array;
}

template <class Message>
Json ToJson(const Message& message) {
  Json object = Json::object();
  std::apply(
      [&](const auto&... field) { ((object[std::string(field.name)] = ValueToJson(message.*field.member)), ...); },
      bus::kFields<Message>);
  return object;
}

using Decoder = std::optional<Json> (*)(std::string_view body, std::string* why);

template <class Message>
std::optional<Json> DecodeToJson(std::string_view body, std::string* why) {
  const auto message = bus::Decode<Message>(body, why);
  if (!message) return std::nullopt;
  return ToJson(*message);
}

struct CallDecoders {
  Decoder request;
  Decoder reply;
};

template <class... Request>
constexpr std::array<CallDecoders, sizeof...(Request)> DecodersOf(bus::MessageList<Request...> /*all*/) {
  return {CallDecoders{&DecodeToJson<Request>, &DecodeToJson<typename bus::CallOf<Request>::Reply>}...};
}

constexpr std::array kDecoders = DecodersOf(bus::Requests());

}  // namespace

std::optional<nlohmann::ordered_json> BodyToJson(bus::MessageType type, bool of_reply, std::string_view body,
                                                 std::string* why) {
  const auto index = static_cast<std::int16_t>(type) - 1;
  if (index < 0 || index >= bus::kLastMessageType) {
    if (why != nullptr) *why = "no such message type";
    return std::nullopt;
  }
  const CallDecoders& decoders = kDecoders[static_cast<std::size_t>(index)];
  return (of_reply ? decoders.reply : decoders.request)(body, why);
}

namespace {

using bus::FrameFault;
using bus::FrameKind;
using Bytes = std::span<const std::uint8_t>;

constexpr std::array<std::string_view, bus::kLastFrameKind + 1> kKinds = {
    "unknown", "request", "reply", "error", "request_chunk", "reply_chunk", "chunk_ack", "proof"};

bool HasKind(const bus::FrameHeader& header) {
  const auto kind = static_cast<std::int16_t>(header.kind);
  return kind >= 1 && kind <= bus::kLastFrameKind;
}

bool HasType(const bus::FrameHeader& header) { return header.type >= 1 && header.type <= bus::kLastMessageType; }

// Names of bus/endpoint.h without "rejected_".
std::string_view CauseOf(FrameFault fault) {
  switch (fault) {
    case FrameFault::kSize:
      return "size";
    case FrameFault::kMalformed:
      return "malformed";
    case FrameFault::kDeployment:
      return "deployment";
    case FrameFault::kTag:
      return "tag";
    case FrameFault::kUnsigned:
      return "unsigned";
    case FrameFault::kField:
      return "field";
    case FrameFault::kVersion:
      return "version";
    case FrameFault::kNone:
    case FrameFault::kNotForUs:
      break;
  }
  return {};
}

std::string_view TagWord(FrameFault fault, bool authentic, bool have_key) {
  if (fault == FrameFault::kSize || fault == FrameFault::kMalformed || fault == FrameFault::kDeployment) return {};
  if (fault == FrameFault::kTag) return "wrong";
  return authentic && have_key ? "signed" : "unsigned";
}

std::string Text(Bytes bytes) { return {bytes.begin(), bytes.end()}; }

std::string Hexadecimal(Bytes bytes) {
  constexpr std::string_view kDigits = "0123456789abcdef";
  std::string text;
  for (const std::uint8_t byte : bytes) text += {kDigits[byte >> 4U], kDigits[byte & 15U]};
  return text;
}

std::optional<Json> ChunkToJson(Bytes payload) {
  bus::ChunkView chunk;
  if (!bus::ReadChunk(payload, bus::kMaxMessageBytes, chunk)) return std::nullopt;
  return Json{{"total_bytes", chunk.total_bytes},
              {"hash", Hexadecimal(chunk.hash)},
              {"index", chunk.index},
              {"num_chunks", bus::NumChunks(static_cast<std::size_t>(chunk.total_bytes))},
              {"ack_requested", chunk.ack_requested},
              {"data_bytes", chunk.data.size()}};
}

std::optional<Json> AckToJson(Bytes payload) {
  bus::ChunkAck ack;
  if (!bus::ReadAck(payload, ack)) return std::nullopt;
  return Json{{"of_reply", ack.of_reply},           {"complete", ack.complete},
              {"reassembly", ack.reassembly},       {"received_below", ack.received_below},
              {"received_mask", ack.received_mask}, {"credit", ack.credit}};
}

std::optional<Json> ChallengeToJson(Bytes payload) {
  const std::int64_t challenge = bus::ReadChallenge(payload);
  return challenge == 0 ? std::nullopt : std::optional<Json>(challenge);
}

std::optional<Json> ErrorToJson(const bus::FrameHeader& header, Bytes payload) {
  Json error = {{"code", header.code}, {"name", bus::ToString(static_cast<bus::ErrorCode>(header.code))}};
  if (header.code == static_cast<std::int16_t>(bus::ErrorCode::kProveSession)) {
    const auto challenge = ChallengeToJson(payload);
    if (!challenge) return std::nullopt;
    error["challenge"] = *challenge;
  } else {
    error["text"] = bus::CleanText(Text(payload), bus::kMaxPayloadBytes);
  }
  return error;
}

void Put(std::string_view name, std::optional<Json> value, std::string_view cause, CapturedDatagram* heard) {
  if (value) {
    heard->payload[std::string(name)] = std::move(*value);
  } else if (heard->rejected.empty()) {
    heard->rejected = cause;
  }
}

void ReadPayload(Bytes payload, CapturedDatagram* heard) {
  const bus::FrameHeader& header = heard->header;
  const auto type = static_cast<bus::MessageType>(header.type);
  switch (header.kind) {
    case FrameKind::kRequest:
    case FrameKind::kReply:
      Put("body", BodyToJson(type, header.kind == FrameKind::kReply, Text(payload), &heard->why),
          HasType(header) ? "body" : "type", heard);
      return;
    case FrameKind::kError:
      Put("error", ErrorToJson(header, payload), "field", heard);
      return;
    case FrameKind::kRequestChunk:
    case FrameKind::kReplyChunk:
      Put("chunk", ChunkToJson(payload), "field", heard);
      return;
    case FrameKind::kChunkAck:
      Put("ack", AckToJson(payload), "field", heard);
      return;
    case FrameKind::kProof:
      Put("challenge", ChallengeToJson(payload), "field", heard);
      return;
  }
}

}  // namespace

CapturedDatagram ReadDatagram(bus::Port port, std::span<const std::uint8_t> datagram, std::int64_t deployment,
                              const bus::MessageKey* key) {
  CapturedDatagram heard;
  heard.port = port;
  heard.bytes = datagram.size();
  bus::FrameView frame;
  const FrameFault fault = bus::OpenFrame(datagram, deployment, bus::kAnyDestination, frame, key);
  heard.fault = fault;
  heard.is_frame = fault != FrameFault::kSize && fault != FrameFault::kMalformed;
  heard.header = frame.header;
  heard.rejected = CauseOf(fault);
  heard.tag = TagWord(fault, frame.authentic, key != nullptr);
  // A frame from a sender without the key is not trusted, but its contents may help to identify the sender.
  if (fault == FrameFault::kNone || fault == FrameFault::kUnsigned) ReadPayload(frame.payload, &heard);
  return heard;
}

std::string_view KindName(const CapturedDatagram& heard) {
  if (!heard.is_frame) return "none";
  return kKinds[HasKind(heard.header) ? static_cast<std::size_t>(heard.header.kind) : 0];
}

std::string_view TypeName(const CapturedDatagram& heard) {
  return heard.is_frame ? bus::ToString(static_cast<bus::MessageType>(heard.header.type)) : "none";
}

nlohmann::ordered_json DatagramToJson(const CapturedDatagram& heard, std::int64_t wall_clock_us) {
  Json json = {{"wall_clock_us", wall_clock_us},
               {"port", heard.port == bus::Port::kControl ? "control" : "bulk"},
               {"bytes", heard.bytes}};
  if (!heard.rejected.empty()) json["rejected"] = heard.rejected;
  if (!heard.why.empty()) json["why"] = heard.why;
  if (!heard.is_frame) return json;
  const bus::FrameHeader& header = heard.header;
  json["kind"] = KindName(heard);
  json["type"] = TypeName(heard);
  // Numbers without a name in this build.
  if (!HasKind(header)) json["kind_number"] = static_cast<std::int16_t>(header.kind);
  if (!HasType(header)) json["type_number"] = header.type;
  if (heard.fault == FrameFault::kVersion) json["version"] = header.version;
  if (heard.fault == FrameFault::kDeployment) json["deployment"] = header.deployment;
  json["sender"] = header.sender;
  json["destination"] = header.destination;
  json["session"] = header.session;
  json["call_id"] = header.call_id;
  json["completed_below"] = header.completed_below;
  json["nonce"] = header.nonce;
  if (!heard.tag.empty()) json["tag"] = heard.tag;
  if (heard.payload.is_object()) json.update(heard.payload);
  return json;
}

}  // namespace legopt::client
