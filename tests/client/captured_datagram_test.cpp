// Policy: the tap reports each datagram like a party, shows every kind of frame, never throws, and makes no
// claims that it could not check.
#include "client/tap/captured_datagram.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>

#include "bus/codec.h"
#include "bus/endpoint.h"

namespace legopt::client {
namespace {

using bus::FrameHeader;
using bus::FrameKind;
using Bytes = std::vector<std::uint8_t>;

constexpr std::int64_t kDeployment = 4711;
constexpr bus::EndpointId kCaller = 0x123456789;

std::array<std::uint8_t, bus::MessageKey::kBytes> KeyBytes(std::uint8_t fill) {
  std::array<std::uint8_t, bus::MessageKey::kBytes> bytes{};
  bytes.fill(fill);
  return bytes;
}

class IsResponsive : public testing::Test {
 protected:
  IsResponsive() : key_(KeyBytes(1)), other_key_(KeyBytes(2)) { bus::PrepareHashing(); }

  static FrameHeader Header(FrameKind kind, bus::MessageType type = bus::MessageType::kProbe) {
    FrameHeader header;
    header.kind = kind;
    header.type = static_cast<std::int16_t>(type);
    header.deployment = kDeployment;
    header.sender = kCaller;
    header.destination = bus::kServer;
    header.session = 7;
    header.call_id = 3;
    header.nonce = 9;
    return header;
  }
  static Bytes Seal(const FrameHeader& header, const Bytes& payload, const bus::MessageKey* key = nullptr) {
    bus::DatagramBuffer buffer{};
    std::copy(payload.begin(), payload.end(), buffer.begin() + bus::kFrameHeaderBytes);
    const auto frame = bus::SealFrame(header, payload.size(), buffer, key);
    return {frame.begin(), frame.end()};
  }
  static Bytes ProbeBody() {
    legopt_msg::probe_request request{};
    request.nonce = 42;
    const std::string body = bus::Encode(request);
    return {body.begin(), body.end()};
  }
  static Bytes Probe(const bus::MessageKey* key = nullptr) {
    return Seal(Header(FrameKind::kRequest), ProbeBody(), key);
  }
  static CapturedDatagram Read(const Bytes& datagram, const bus::MessageKey* key = nullptr) {
    return ReadDatagram(bus::Port::kControl, datagram, kDeployment, key);
  }
  static nlohmann::ordered_json Json(const CapturedDatagram& heard) { return DatagramToJson(heard, 1'000'000); }

  bus::MessageKey key_;
  bus::MessageKey other_key_;
};

TEST_F(IsResponsive, ARequestIsShownWithHeaderAndBody) {
  EXPECT_EQ(Json(Read(Probe())).dump(),
            R"({"wall_clock_us":1000000,"port":"control","bytes":108,"kind":"request","type":"probe",)"
            R"("sender":4886718345,"destination":1,"session":7,"call_id":3,"completed_below":0,"nonce":9,)"
            R"("tag":"unsigned","body":{"nonce":42}})");
}

TEST_F(IsResponsive, FramesForEverybodyAreRead) {
  FrameHeader header = Header(FrameKind::kRequest);
  header.destination = 99;
  EXPECT_EQ(Read(Seal(header, ProbeBody())).rejected, "");
}

TEST_F(IsResponsive, TheTagIsCheckedUnderTheKeyAndWithout) {
  EXPECT_EQ(Read(Probe()).tag, "unsigned");
  EXPECT_EQ(Read(Probe(&key_), &key_).tag, "signed");
  const auto stranger = Read(Probe(), &key_);
  EXPECT_EQ(stranger.tag, "unsigned");
  EXPECT_EQ(stranger.rejected, "unsigned");
  for (const auto& wrong : {Read(Probe(&key_)), Read(Probe(&other_key_), &key_)}) {
    EXPECT_EQ(wrong.tag, "wrong");
    EXPECT_EQ(wrong.rejected, "tag");
    EXPECT_TRUE(wrong.payload.is_null());
    EXPECT_EQ(Json(wrong).at("type"), "probe");  // the header is shown although unverified
  }
}

TEST_F(IsResponsive, EveryCauseOfRejectionHasItsName) {
  EXPECT_EQ(Read({}).rejected, "size");
  EXPECT_EQ(Read(Bytes(1201)).rejected, "size");
  EXPECT_EQ(Read(Bytes(50)).rejected, "malformed");
  FrameHeader header = Header(FrameKind::kRequest);
  header.deployment = 1;
  const auto foreign = Read(Seal(header, ProbeBody()));
  EXPECT_EQ(foreign.rejected, "deployment");
  EXPECT_EQ(Json(foreign).at("deployment"), 1);
  header = Header(FrameKind::kRequest);
  header.version = 1;
  const auto old = Read(Seal(header, ProbeBody()));
  EXPECT_EQ(old.rejected, "version");
  EXPECT_EQ(Json(old).at("version"), 1);
  header = Header(FrameKind::kRequest);
  header.session = 0;
  EXPECT_EQ(Read(Seal(header, ProbeBody())).rejected, "field");
  header = Header(FrameKind::kRequest);
  header.type = 77;
  const auto unknown = Read(Seal(header, ProbeBody()));
  EXPECT_EQ(unknown.rejected, "type");
  EXPECT_EQ(Json(unknown).at("type_number"), 77);
  const auto body = Read(Seal(Header(FrameKind::kReply), ProbeBody()));
  EXPECT_EQ(body.rejected, "body");
  EXPECT_THAT(body.why, testing::HasSubstr("probe_reply"));
  for (const FrameKind kind :
       {FrameKind::kRequestChunk, FrameKind::kReplyChunk, FrameKind::kChunkAck, FrameKind::kProof}) {
    EXPECT_EQ(Read(Seal(Header(kind), {1, 2, 3})).rejected, "field");
  }
}

TEST_F(IsResponsive, ChunksAndAcknowledgementsAreDescribedNotPutTogether) {
  const Bytes data(1000, 250);
  bus::ChunkView chunk;
  chunk.total_bytes = 2024;
  chunk.index = 1;
  chunk.data = data;
  chunk.hash.fill(0xAB);
  bus::ChunkView whole = chunk;
  const Bytes full(bus::kChunkBytes, 250);
  whole.index = 0;
  whole.data = full;
  whole.ack_requested = true;
  Bytes payload(bus::kMaxPayloadBytes);
  payload.resize(bus::WriteChunk(whole, payload.data()));
  const auto shown = Json(Read(Seal(Header(FrameKind::kReplyChunk), payload)));
  EXPECT_EQ(shown.at("kind"), "reply_chunk");
  EXPECT_EQ(shown.at("chunk").at("num_chunks"), 2);
  EXPECT_EQ(shown.at("chunk").at("data_bytes"), 1024);
  EXPECT_EQ(shown.at("chunk").at("ack_requested"), true);
  EXPECT_EQ(shown.at("chunk").at("hash").get<std::string>().substr(0, 4), "abab");
  payload.assign(bus::kMaxPayloadBytes, 0);
  bus::ChunkAck ack;
  ack.received_below = 5;
  ack.credit = 8;
  payload.resize(bus::WriteAck(ack, payload.data()));
  EXPECT_EQ(Json(Read(Seal(Header(FrameKind::kChunkAck), payload))).at("ack").at("received_below"), 5);
}

TEST_F(IsResponsive, RefusalsAndChallengesAreShown) {
  FrameHeader header = Header(FrameKind::kError);
  header.code = static_cast<std::int16_t>(bus::ErrorCode::kBusy);
  const auto busy = Json(Read(Seal(header, {'n', 'o', 0xFF})));
  EXPECT_EQ(busy.at("error").at("name"), "busy");
  EXPECT_EQ(busy.at("error").at("text"), "no?");
  header.code = static_cast<std::int16_t>(bus::ErrorCode::kProveSession);
  Bytes payload(bus::kChallengeBytes);
  bus::WriteChallenge(12345, payload.data());
  EXPECT_EQ(Json(Read(Seal(header, payload))).at("error").at("challenge"), 12345);
  EXPECT_EQ(Read(Seal(header, {1})).rejected, "field");
  EXPECT_EQ(Json(Read(Seal(Header(FrameKind::kProof), payload))).at("challenge"), 12345);
}

TEST_F(IsResponsive, NothingThatIsHeardIsTooOdd) {
  std::mt19937_64 random(3);
  constexpr int kTries = 20'000;
  for (int i = 0; i < kTries; ++i) {
    FrameHeader header = Header(static_cast<FrameKind>(random() % 9), static_cast<bus::MessageType>(random() % 15));
    header.code = static_cast<std::int16_t>(random());
    Bytes payload(random() % 200);
    for (auto& byte : payload) byte = static_cast<std::uint8_t>(random());
    Bytes datagram = Seal(header, payload);
    if (random() % 4 == 0) datagram[random() % datagram.size()] ^= 1;
    const auto heard = Read(datagram, random() % 2 == 0 ? &key_ : nullptr);
    EXPECT_NE(Json(heard).dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::strict), "");
  }
}

}  // namespace
}  // namespace legopt::client
