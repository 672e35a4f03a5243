#include <gtest/gtest.h>

#include <random>

#include "tests/worker/sample_messages.h"
#include "worker/child_process.h"
#include "worker/job_executor.h"

namespace legopt::worker {
namespace {

using Status = FrameReader::Status;

TEST(FrameTest, FramesSurviveAnyCutting) {
  std::string stream;
  for (std::uint64_t i = 1; i <= 5; ++i) {
    stream += EncodeFrame({FrameType::kProgress, i, std::string(i * 1000, static_cast<char>(i))});
  }
  for (const std::size_t piece : {std::size_t{1}, std::size_t{7}, std::size_t{4096}, stream.size()}) {
    FrameReader reader;
    Frame frame;
    std::string why;
    std::uint64_t seen = 0;
    for (std::size_t at = 0; at < stream.size(); at += piece) {
      reader.Append(std::string_view(stream).substr(at, piece));
      while (reader.Next(&frame, &why) == Status::kFrame) {
        ++seen;
        EXPECT_EQ(frame.sequence, seen);
        EXPECT_EQ(frame.body, std::string(seen * 1000, static_cast<char>(seen)));
      }
    }
    EXPECT_EQ(seen, 5U) << "pieces of " << piece;
  }
}

TEST(FrameTest, GarbageIsToldFromItsFirstByteAndForEver) {
  FrameReader reader;
  Frame frame;
  std::string why;
  EXPECT_EQ(reader.Next(&frame, &why), Status::kNeedMore);
  reader.Append("x");
  EXPECT_EQ(reader.Next(&frame, &why), Status::kGarbage);
  EXPECT_FALSE(why.empty());
  reader.Append(EncodeFrame({FrameType::kReady, 0, "fine"}));
  EXPECT_EQ(reader.Next(&frame, &why), Status::kGarbage);
}

TEST(FrameTest, EveryFlippedBitIsNoticed) {
  const std::string good = EncodeFrame({FrameType::kResult, 3, "the body of a result"});
  for (std::size_t bit = 0; bit < good.size() * 8; ++bit) {
    std::string bad = good;
    bad[bit / 8] = static_cast<char>(static_cast<unsigned char>(bad[bit / 8]) ^ (1U << (bit % 8)));
    FrameReader reader;
    reader.Append(bad);
    Frame frame;
    std::string why;
    // After a longer length the reader waits for more data; everything else is garbage at once.
    EXPECT_NE(reader.Next(&frame, &why), Status::kFrame) << "bit " << bit;
  }
}

TEST(FrameTest, AMadLengthIsRefusedBeforeAnythingIsStored) {
  std::string bad = EncodeFrame({FrameType::kResult, 3, ""});
  for (std::size_t i = 16; i < 24; ++i) bad[i] = '\x7f';
  FrameReader reader;
  reader.Append(bad);
  Frame frame;
  std::string why;
  EXPECT_EQ(reader.Next(&frame, &why), Status::kGarbage);
}

TEST(FrameTest, RandomBytesNeverMakeAFrame) {
  std::mt19937_64 random(7);
  const std::string start = EncodeFrame({FrameType::kReady, 1, "x"}).substr(0, 4);
  for (int round = 0; round < 2000; ++round) {
    std::string bytes = round % 2 == 0 ? start : std::string();
    while (bytes.size() < 64) bytes += static_cast<char>(random());
    FrameReader reader;
    reader.Append(bytes);
    Frame frame;
    std::string why;
    EXPECT_NE(reader.Next(&frame, &why), Status::kFrame);
  }
}

TEST(BodyTest, JobsAndDatasetsAndProgressGoRound) {
  const legopt_msg::lease lease = SampleLease(17);
  legopt_msg::lease decoded;
  std::string options;
  ASSERT_TRUE(DecodeJob(EncodeJob(lease, R"({"solver":"sqp"})"), &decoded, &options));
  EXPECT_EQ(decoded.job_id, 17);
  EXPECT_EQ(decoded.dataset_hash, lease.dataset_hash);
  EXPECT_EQ(options, R"({"solver":"sqp"})");

  std::vector<Capability> datasets;
  ASSERT_TRUE(DecodeCapabilities(EncodeCapabilities({{"garage", HexHash('a')}, {"yard", HexHash('b')}}), &datasets));
  ASSERT_EQ(datasets.size(), 2U);
  EXPECT_EQ(datasets[1].name, "yard");
  EXPECT_EQ(datasets[1].hash, HexHash('b'));

  int done = 0;
  int total = 0;
  ASSERT_TRUE(DecodeProgress(EncodeProgress(3, 11), &done, &total));
  EXPECT_EQ(done, 3);
  EXPECT_EQ(total, 11);
}

TEST(BodyTest, TruncatedBodiesAreRefused) {
  legopt_msg::lease lease;
  std::string options;
  std::vector<Capability> datasets;
  int number = 0;
  const std::string encoded_lease = EncodeJob(SampleLease(1), "");
  for (std::size_t size = 0; size < encoded_lease.size(); ++size) {
    EXPECT_FALSE(DecodeJob(encoded_lease.substr(0, size), &lease, &options)) << size;
  }
  const std::string encoded = EncodeCapabilities({{"garage", HexHash('a')}});
  for (std::size_t size = 0; size < encoded.size(); ++size) {
    EXPECT_FALSE(DecodeCapabilities(encoded.substr(0, size), &datasets)) << size;
  }
  EXPECT_FALSE(DecodeProgress("1234567", &number, &number));
}

TEST(OutcomeTest, TextsAreCutAndMadeHarmless) {
  EXPECT_EQ(PrintableText("line\nnext\ttab", 100), "line\nnext\ttab");
  EXPECT_EQ(PrintableText("\x1b[31mred\x7f", 100), "?[31mred?");
  EXPECT_EQ(PrintableText("abcdef", 3), "abc");
  EXPECT_EQ(PrintableTail("abcdef", 3), "def");
  EXPECT_EQ(PrintableText("gr\xc3\xbc\xc3\x9f", 100), "gr\xc3\xbc\xc3\x9f");
}

}  // namespace
}  // namespace legopt::worker
