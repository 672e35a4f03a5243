// Encode and Decode of every message: legal messages survive a round trip, illegal ones are refused, and no input
// makes them throw or over-allocate.
#include "bus/codec.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <map>
#include <random>
#include <string>

#include "legopt/types/reply.h"
#include "tests/bus/sample_messages.h"

namespace legopt::bus {
namespace {

// Returns a message's bytes as written by the generated encoder, without validation.
template <class Message>
std::string RawEncode(const Message& message) {
  std::string bytes(static_cast<std::size_t>(message.getEncodedSize()), '\0');
  message.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
  return bytes;
}

template <class Message>
class EveryMessage : public testing::Test {};

template <class... Message>
testing::Types<Message...> AsTestTypes(MessageList<Message...> all);
using Messages = decltype(AsTestTypes(AllMessages()));

struct MessageNames {
  template <class Message>
  static std::string GetName(int /*index*/) {
    return Message::getTypeName();
  }
};
TYPED_TEST_SUITE(EveryMessage, Messages, MessageNames);

TYPED_TEST(EveryMessage, RoundTrip) {
  const TypeParam sample = Sample<TypeParam>();
  EXPECT_EQ(Validate(sample), "");
  const std::string bytes = Encode(sample);
  EXPECT_EQ(bytes, RawEncode(sample));
  std::string why;
  const auto decoded = Decode<TypeParam>(bytes, &why);
  ASSERT_TRUE(decoded.has_value()) << why;
  EXPECT_EQ(Encode(*decoded), bytes);
}

TYPED_TEST(EveryMessage, TruncatedAtEveryLengthIsRefused) {
  const std::string bytes = Encode(Sample<TypeParam>());
  for (std::size_t length = 0; length < bytes.size(); ++length) {
    EXPECT_FALSE(Decode<TypeParam>(bytes.substr(0, length)).has_value()) << length;
  }
}

TYPED_TEST(EveryMessage, ATrailingByteIsRefused) {
  std::string why;
  EXPECT_FALSE(Decode<TypeParam>(Encode(Sample<TypeParam>()) + '\0', &why).has_value());
  EXPECT_NE(why.find(TypeParam::getTypeName()), std::string::npos) << why;
}

TYPED_TEST(EveryMessage, AnotherFingerprintIsRefused) {
  std::string bytes = Encode(Sample<TypeParam>());
  bytes[0] = static_cast<char>(bytes[0] ^ 1);
  EXPECT_FALSE(Decode<TypeParam>(bytes).has_value());
}

// Every four bytes in turn are replaced by a negative, enormous or wrong length.
TYPED_TEST(EveryMessage, HostileLengthsAreRefusedOrHarmless) {
  const std::string bytes = Encode(Sample<TypeParam>());
  for (std::size_t at = 8; at + 4 <= bytes.size(); ++at) {
    for (const std::uint32_t length : {0xFFFFFFFFU, 0x80000000U, 0x7FFFFFFFU, 0x40000000U, 0U}) {
      std::string changed = bytes;
      for (std::size_t i = 0; i < 4; ++i) changed[at + i] = static_cast<char>(length >> (24 - 8 * i));
      const auto decoded = Decode<TypeParam>(changed);
      if (decoded) {
        EXPECT_EQ(Validate(*decoded), "");
      }
    }
  }
}

TYPED_TEST(EveryMessage, RandomChangesNeverYieldAnIllegalMessage) {
  const std::string bytes = Encode(Sample<TypeParam>());
  std::mt19937_64 random(1);
  constexpr int kTries = 3000;
  for (int i = 0; i < kTries; ++i) {
    std::string changed = bytes;
    for (std::uint64_t n = 1 + random() % 4; n > 0; --n) {
      changed[8 + random() % (changed.size() - 8)] = static_cast<char>(random());
    }
    if (random() % 8 == 0) changed.resize(random() % (changed.size() + 1));
    const auto decoded = Decode<TypeParam>(changed);
    if (decoded) {
      EXPECT_EQ(Validate(*decoded), "");
      EXPECT_EQ(RawEncode(*decoded).size(), changed.size());
    }
  }
}

template <class Message>
std::string WhyRefused(const Message& message) {
  std::string why;
  EXPECT_FALSE(Decode<Message>(RawEncode(message), &why).has_value());
  return why;
}

TEST(Result, FiguresMayBeNanButNotInfinite) {
  using Figure = double legopt_msg::result_request::*;
  using M = legopt_msg::result_request;
  for (const Figure figure :
       {&M::solver_cost, &M::solver_violation, &M::cost, &M::interpolation_environment_depth_m,
        &M::interpolation_self_depth_m, &M::interpolation_free_share, &M::duration_s, &M::reduced_duration_s,
        &M::velocity_limited_share, &M::torque_limited_share, &M::contact_limited_share, &M::margin_relaxed}) {
    M message = Sample<M>();
    message.*figure = std::nan("");
    EXPECT_TRUE(Decode<M>(RawEncode(message)).has_value());
    message.*figure = std::numeric_limits<double>::infinity();
    EXPECT_NE(WhyRefused(message), "");
    const auto prepared = Decode<M>(Encode(message));
    ASSERT_TRUE(prepared.has_value());
    EXPECT_TRUE(std::isnan((*prepared).*figure));
  }
}

TEST(Result, WaypointsMustBeFinite) {
  for (const double bad : {std::nan(""), std::numeric_limits<double>::infinity()}) {
    auto message = Sample<legopt_msg::result_request>();
    message.waypoints[3] = bad;
    EXPECT_NE(WhyRefused(message).find("waypoints"), std::string::npos);
    // A sender that omits the waypoints sets their number to 0.
    const auto prepared = Decode<legopt_msg::result_request>(Encode(message));
    ASSERT_TRUE(prepared.has_value());
    EXPECT_EQ(prepared->num_waypoints, 0);
    EXPECT_TRUE(prepared->waypoints.empty());
    EXPECT_NE(prepared->verdict_detail.find("not finite"), std::string::npos);
  }
}

TEST(Result, CountsMustAgree) {
  auto message = Sample<legopt_msg::result_request>();
  message.num_waypoints = 3;
  EXPECT_NE(WhyRefused(message).find("num_values"), std::string::npos);
  EXPECT_THROW(Encode(message), BusError);
}

TEST(Result, TextsForHumansNeverPreventDelivery) {
  auto message = Sample<legopt_msg::result_request>();
  message.message = std::string(10'000, 'x');
  message.log_tail = std::string(100'000, 'a') + "\xFF\xFE" + std::string("\0", 1) + "the end";
  const auto decoded = Decode<legopt_msg::result_request>(Encode(message));
  ASSERT_TRUE(decoded.has_value());
  EXPECT_EQ(decoded->message.size(), 4096U);
  EXPECT_TRUE(decoded->log_tail.ends_with("a???the end"));
}

TEST(Ranges, AreEnforced) {
  auto lease = Sample<legopt_msg::lease>();
  lease.task = "dance";
  EXPECT_NE(WhyRefused(lease).find("task: dance"), std::string::npos);
  lease = Sample<legopt_msg::lease>();
  lease.method_hash[5] = 'X';
  EXPECT_NE(WhyRefused(lease).find("method_hash"), std::string::npos);
  lease = Sample<legopt_msg::lease>();
  lease.token = 0;
  EXPECT_NE(WhyRefused(lease).find("token"), std::string::npos);

  auto leases = Sample<legopt_msg::lease_reply>();
  leases.jobs[1].attempt = 0;
  EXPECT_NE(WhyRefused(leases).find("jobs[1].attempt: 0"), std::string::npos);
  leases = Sample<legopt_msg::lease_reply>();
  leases.status = static_cast<std::int32_t>(LeaseStatus::kNoneNow);
  EXPECT_NE(WhyRefused(leases).find("num_jobs"), std::string::npos);

  auto beat = Sample<legopt_msg::heartbeat_reply>();
  beat.verdicts[0] = kNumEnumerators<LeaseVerdict>;
  EXPECT_NE(WhyRefused(beat).find("verdicts"), std::string::npos);

  auto hello = Sample<legopt_msg::hello_request>();
  hello.slots = 0;
  EXPECT_NE(WhyRefused(hello).find("slots"), std::string::npos);
  hello = Sample<legopt_msg::hello_request>();
  hello.worker_name = "\xC0\x80";  // overlong NUL
  EXPECT_NE(WhyRefused(hello).find("worker_name"), std::string::npos);

  auto query = Sample<legopt_msg::query_request>();
  std::string bytes = Encode(query);
  bytes[bytes.find(' ')] = '\0';
  std::string why;
  EXPECT_FALSE(Decode<legopt_msg::query_request>(bytes, &why).has_value());
  EXPECT_NE(why.find("sql"), std::string::npos) << why;
  query.sql[1] = '\0';
  EXPECT_THROW(Encode(query), BusError);
}

// Each action takes its own priority and text; numbers beyond the last action are refused.
TEST(Ranges, ControlRequestsHoldWhatTheirActionNeeds) {
  const auto fault_of_number = [](int action, const std::string& reason, int priority = 0) {
    legopt_msg::control_request m{};
    m.experiment_id = 1;
    m.action = static_cast<std::int8_t>(action);
    m.reason = reason;
    m.priority = priority;
    return Validate(m);
  };
  const auto fault = [&](ControlAction action, const std::string& reason, int priority = 0) {
    return fault_of_number(static_cast<int>(action), reason, priority);
  };
  const std::map<ControlAction, std::size_t> with_text = {{ControlAction::kPause, 1000},
                                                          {ControlAction::kPauseNow, 1000},
                                                          {ControlAction::kRename, 200},
                                                          {ControlAction::kTag, 100},
                                                          {ControlAction::kUntag, 100}};
  for (const auto& [action, word] : kEnumNames<ControlAction>) {
    if (with_text.contains(action)) {
      const std::size_t most = with_text.at(action);
      const bool optional = action == ControlAction::kPause || action == ControlAction::kPauseNow;
      EXPECT_EQ(fault(action, "").empty(), optional) << word;
      EXPECT_EQ(fault(action, "x"), "") << word;
      EXPECT_EQ(fault(action, std::string(most, 'x')), "") << word;
      EXPECT_NE(fault(action, std::string(most + 1, 'x')), "") << word;
    } else {
      EXPECT_EQ(fault(action, ""), "") << word;
      EXPECT_NE(fault(action, "x"), "") << word;
    }
  }
  EXPECT_EQ(fault(ControlAction::kPriority, "", 1000), "");
  EXPECT_NE(fault(ControlAction::kRetryTimeLimits, "", 1), "");
  for (const int action : {-1, int{kNumEnumerators<ControlAction>}})
    EXPECT_NE(fault_of_number(action, ""), "") << action;
}

// These error messages are part of the interface: users read them, and authors of other workers search for them.
TEST(Ranges, FaultsNameFieldValueAndWhatIsAllowed) {
  auto lease = Sample<legopt_msg::lease>();
  lease.task = "dance";
  EXPECT_EQ(Validate(lease), "task: dance: must be posture, motion, continuous, balanced or timed");
  lease = Sample<legopt_msg::lease>();
  lease.wall_limit_us = 0;
  EXPECT_EQ(Validate(lease), "wall_limit_us: 0: must be in 1 .. 31536000000000");
  auto reply = Sample<legopt_msg::lease_reply>();
  reply.status = 5;
  EXPECT_EQ(Validate(reply), "status: 5: must be in 0 .. 4");
  reply = Sample<legopt_msg::lease_reply>();
  reply.jobs[1].token = 0;
  EXPECT_EQ(Validate(reply), "jobs[1].token: 0: must be non-zero");
  auto state = Sample<legopt_msg::lease_state>();
  state.progress_done = state.progress_total + 1;
  EXPECT_EQ(Validate(state), "progress_done: 106: must be in 0 .. 105");
  auto hello = Sample<legopt_msg::hello_reply>();
  hello.status = static_cast<std::int32_t>(HelloStatus::kOk);
  hello.worker_id = 0;
  EXPECT_EQ(Validate(hello), "worker_id: 0: must be at least 1");
  auto request = Sample<legopt_msg::hello_request>();
  request.num_capabilities = 257;
  EXPECT_EQ(Validate(request), "num_capabilities: 257: must be in 0 .. 256");
  request.num_capabilities = 1;
  EXPECT_EQ(Validate(request), "num_capabilities: 1: must be the size of its array, 3");
  auto method = Sample<legopt_msg::method_reply>();
  method.options_json = std::string(65, '[');
  EXPECT_EQ(Validate(method), "options_json: JSON: must be nested at most 64 deep");
}

// Of several faults the first is reported: fields in their order, then array elements.
TEST(Ranges, FirstFaultIsReported) {
  auto result = Sample<legopt_msg::result_request>();
  result.waypoints[0] = std::nan("");
  EXPECT_EQ(Validate(result), "waypoints: nan: must be finite");
  result.num_trace_bytes = 9;
  EXPECT_EQ(Validate(result), "num_trace_bytes: 9: must be the size of its array, 3");
  result.torque_limited_share = 1.5;
  EXPECT_EQ(Validate(result), "torque_limited_share: must be within 0 .. 1");
  result.reduced_duration_s = -1;
  EXPECT_EQ(Validate(result), "reduced_duration_s: must not be negative");
  result.interpolation_free_share = 2;
  EXPECT_EQ(Validate(result), "interpolation_free_share: must be within 0 .. 1");
  result.interpolation_self_depth_m = -1;
  EXPECT_EQ(Validate(result), "interpolation: a depth is negative");
  result.cost = std::numeric_limits<double>::infinity();
  EXPECT_EQ(Validate(result), "cost: inf: must be finite, or NaN for not available");
  result.worker_id = 0;
  EXPECT_EQ(Validate(result), "worker_id: 0: must be at least 1");
}

TEST(Encode, TakesCountsFromTheArrays) {
  auto message = Sample<legopt_msg::heartbeat_request>();
  message.num_leases = 99;
  const auto decoded = Decode<legopt_msg::heartbeat_request>(Encode(message));
  ASSERT_TRUE(decoded.has_value());
  EXPECT_EQ(decoded->num_leases, 3);
}

TEST(Encode, RefusesAnIllegalMessageByName) {
  auto message = Sample<legopt_msg::cancel_request>();
  message.experiment_id = 0;
  try {
    Encode(message);
    FAIL();
  } catch (const BusError& error) {
    EXPECT_EQ(error.code(), BusErrorCode::kInvalidMessage);
    EXPECT_STREQ(error.what(), "cancel_request: experiment_id: 0: must be at least 1");
  }
}

TEST(Decode, AHugeCountInASmallMessageCostsNothing) {
  // num_leases follows worker_id, server_instance and load.
  std::string bytes = Encode(Sample<legopt_msg::heartbeat_request>());
  constexpr std::size_t kCount = 8 + 8 + 8 + 8;
  bytes[kCount] = 0x7F;
  EXPECT_FALSE(Decode<legopt_msg::heartbeat_request>(bytes).has_value());
}

TEST(Text, Utf8IsRecognised) {
  EXPECT_TRUE(IsText("plain \xC3\xA9 \xE2\x82\xAC \xF0\x9F\xA6\xBF"));
  for (const char* bad : {"\x80", "\xC3", "\xC1\xBF", "\xE0\x80\x80", "\xED\xA0\x80", "\xF5\x80\x80\x80", "\xFF"}) {
    EXPECT_FALSE(IsText(bad));
    EXPECT_TRUE(IsText(CleanText(bad, 100)));
  }
  EXPECT_EQ(CleanText("ab\xE2\x82\xAC", 4), "ab");  // whole characters only
}

}  // namespace
}  // namespace legopt::bus
