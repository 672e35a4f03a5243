// The envelope as printed in PROTOCOL.md, section 14, and malformed envelopes.
#include <gtest/gtest.h>

#include <map>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "bus/bridge/link.h"
#include "tests/bus/protocol_vectors.h"

namespace legopt::bridge {
namespace {

class EnvelopeTest : public testing::Test {
 protected:
  static EnvelopeHeader Knock() {
    EnvelopeHeader header;
    header.kind = EnvelopeKind::kKnock;
    header.deployment = 4711;
    header.link = 0x1112131415161718;
    header.nonce = 1;
    return header;
  }
  std::string Sealed(const EnvelopeHeader& header, std::span<const std::uint8_t> frame) {
    return bus::Hex(SealEnvelope(header, frame, buffer_, key_.get()));
  }
  EnvelopeFault Open(std::span<const std::uint8_t> bytes) {
    EnvelopeView view;
    return OpenEnvelope(bytes, 4711, key_.get(), view);
  }

  std::map<std::string, std::vector<std::uint8_t>> vectors_ = bus::ReadProtocolVectors();
  std::shared_ptr<const bus::MessageKey> key_ = std::make_shared<const bus::MessageKey>(
      std::span<const std::uint8_t, bus::MessageKey::kBytes>(vectors_.at("key")));
  EnvelopeBuffer buffer_{};
};

TEST_F(EnvelopeTest, IsWhatTheProtocolPrints) {
  EXPECT_EQ(Sealed(Knock(), {}), bus::Hex(vectors_["knock-keyed"]));
  EnvelopeHeader frame = Knock();
  frame.kind = EnvelopeKind::kFrame;
  frame.port = bus::Port::kBulk;
  frame.nonce = 3;
  EXPECT_EQ(Sealed(frame, vectors_["request-keyed"]), bus::Hex(vectors_["envelope-keyed"]));
}

TEST_F(EnvelopeTest, EveryByteIsUnderTheTag) {
  const auto& whole = vectors_["envelope-keyed"];
  ASSERT_EQ(Open(whole), EnvelopeFault::kNone);
  for (std::size_t i = 0; i < whole.size(); ++i) {
    auto damaged = whole;
    damaged[i] ^= 1;
    EXPECT_NE(Open(damaged), EnvelopeFault::kNone) << "byte " << i;
  }
  for (std::size_t size = 0; size < whole.size(); ++size) {
    EXPECT_NE(Open(std::span(whole).first(size)), EnvelopeFault::kNone) << size << " bytes";
  }
}

TEST_F(EnvelopeTest, FieldsOutOfRangeAreRefusedWhateverTheTag) {
  const auto fault_of = [this](auto change, std::span<const std::uint8_t> frame = {}) {
    EnvelopeHeader header = Knock();
    change(header);
    return Open(SealEnvelope(header, frame, buffer_, key_.get()));
  };
  ASSERT_EQ(fault_of([](EnvelopeHeader&) {}), EnvelopeFault::kNone);
  EXPECT_EQ(fault_of([](EnvelopeHeader& h) { h.kind = EnvelopeKind{0}; }), EnvelopeFault::kMalformed);
  EXPECT_EQ(fault_of([](EnvelopeHeader& h) { h.kind = EnvelopeKind{6}; }), EnvelopeFault::kMalformed);
  EXPECT_EQ(fault_of([](EnvelopeHeader& h) { h.port = bus::Port{2}; }), EnvelopeFault::kMalformed);
  EXPECT_EQ(fault_of([](EnvelopeHeader& h) { h.link = 0; }), EnvelopeFault::kMalformed);
  EXPECT_EQ(fault_of([](EnvelopeHeader& h) { h.hub = -1; }), EnvelopeFault::kMalformed);
  EXPECT_EQ(fault_of([](EnvelopeHeader& h) { h.nonce = 0; }), EnvelopeFault::kMalformed);
  EXPECT_EQ(fault_of([](EnvelopeHeader& h) { h.value = -1; }), EnvelopeFault::kMalformed);
  EXPECT_EQ(fault_of([](EnvelopeHeader& h) { h.deployment = 4712; }), EnvelopeFault::kDeployment);
  // Only envelopes of kind kFrame contain a frame.
  EXPECT_EQ(fault_of([](EnvelopeHeader& h) { h.kind = EnvelopeKind::kFrame; }), EnvelopeFault::kMalformed);
  EXPECT_EQ(fault_of([](EnvelopeHeader&) {}, vectors_["request-keyed"]), EnvelopeFault::kMalformed);
}

}  // namespace
}  // namespace legopt::bridge
