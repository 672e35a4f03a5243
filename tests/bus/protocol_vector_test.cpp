// This code sends the test vectors of lcmtypes/test-vectors.txt, so a worker in another language can be checked against
// the document alone.
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "bus/codec.h"
#include "bus/wire.h"
#include "tests/bus/protocol_vectors.h"
#include "tests/bus/test_bed.h"

namespace legopt::bus {
namespace {

// Returns the request of the vectors: the first probe of a caller.
FrameHeader Probe() {
  FrameHeader header;
  header.kind = FrameKind::kRequest;
  header.type = static_cast<std::int16_t>(MessageType::kProbe);
  header.deployment = 4711;
  header.sender = 0x123456789;
  header.destination = kServer;
  header.session = 0x0102030405060708;
  header.call_id = 1;
  header.completed_below = 1;
  header.nonce = 1;
  return header;
}

std::string ProbeBody() {
  legopt_msg::probe_request request{};
  request.nonce = 42;
  return Encode(request);
}

class ProtocolVector : public testing::Test {
 protected:
  void Expect(const std::string& name, const FrameHeader& header, const std::string& body, const MessageKey* key) {
    std::copy(body.begin(), body.end(), buffer_.begin() + kFrameHeaderBytes);
    EXPECT_EQ(Hex(vectors_[name]), Hex(SealFrame(header, body.size(), buffer_, key))) << name;
  }
  static std::string Challenge() {
    std::string bytes(kChallengeBytes, '\0');
    WriteChallenge(0x1122334455667788, reinterpret_cast<std::uint8_t*>(bytes.data()));
    return bytes;
  }

  std::map<std::string, std::vector<std::uint8_t>> vectors_ = ReadProtocolVectors();
  std::shared_ptr<const MessageKey> key_ = TestKey();
  DatagramBuffer buffer_{};
};

TEST_F(ProtocolVector, Key) { EXPECT_EQ(Hex(vectors_["key"]), Hex(key_->bytes())); }

TEST_F(ProtocolVector, RequestWithoutAndWithKey) {
  Expect("request", Probe(), ProbeBody(), nullptr);
  Expect("request-keyed", Probe(), ProbeBody(), key_.get());
}

TEST_F(ProtocolVector, KeysOfRoles) {
  for (const KeyRole role : kDerivedRoles) {
    const MessageKey& derived = *key_->ForRole(role);
    EXPECT_EQ(Hex(vectors_["key-" + std::string(ToString(role))]), Hex(derived.bytes()));
    EXPECT_EQ(derived.FileText(), std::string(ToString(role)) + " " + Hex(derived.bytes()) + "\n");
  }
  FrameHeader header = Probe();
  header.role = KeyRole::kWorker;
  Expect("request-worker", header, ProbeBody(), key_.get());
  Expect("request-worker", header, ProbeBody(), key_->ForRole(KeyRole::kWorker));
}

TEST_F(ProtocolVector, Challenge) {
  FrameHeader header = Probe();
  header.kind = FrameKind::kError;
  header.code = static_cast<std::int16_t>(ErrorCode::kProveSession);
  std::swap(header.sender, header.destination);
  header.completed_below = 0;
  header.nonce = 7;
  Expect("challenge", header, Challenge(), key_.get());
}

TEST_F(ProtocolVector, Proof) {
  FrameHeader header = Probe();
  header.kind = FrameKind::kProof;
  header.completed_below = 0;
  header.nonce = 2;
  Expect("proof", header, Challenge(), key_.get());
}

}  // namespace
}  // namespace legopt::bus
