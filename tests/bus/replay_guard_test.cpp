// Each nonce of an admitted session is accepted once, and never if it is older than the window. A session is admitted
// only by a challenge of the current process.
#include "bus/replay_guard.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <random>
#include <set>

namespace legopt::bus {
namespace {

using Verdict = ReplayGuard::Verdict;
constexpr std::size_t kSessions = 4;
constexpr EndpointId kCaller = 1000;

TEST(ReplayWindow, TakesEachNonceOnce) {
  ReplayWindow window(10);
  EXPECT_FALSE(window.Take(10)) << "the floor itself";
  EXPECT_FALSE(window.Take(3)) << "before the floor";
  EXPECT_TRUE(window.Take(11));
  EXPECT_FALSE(window.Take(11));
  EXPECT_TRUE(window.Take(15));
  EXPECT_TRUE(window.Take(12)) << "late but new";
  EXPECT_FALSE(window.Take(12));
  EXPECT_TRUE(window.Take(15 + kReplayWindow));
  EXPECT_FALSE(window.Take(15)) << "out of the window";
  EXPECT_TRUE(window.Take(16)) << "the oldest one inside";
}

TEST(ReplayWindow, IllegalAndExtremeNoncesAreSafe) {
  constexpr std::int64_t kLast = std::numeric_limits<std::int64_t>::max();
  ReplayWindow window(1);
  for (const std::int64_t nonce : {std::int64_t{0}, std::int64_t{-1}, std::numeric_limits<std::int64_t>::min()}) {
    EXPECT_FALSE(window.Take(nonce));
  }
  EXPECT_TRUE(window.Take(kLast));
  EXPECT_FALSE(window.Take(kLast));
  EXPECT_TRUE(window.Take(kLast - kReplayWindow + 1));
  EXPECT_FALSE(window.Take(kLast - kReplayWindow));
}

TEST(ReplayWindow, AgreesWithASetUnderRandomOrder) {
  std::mt19937_64 random(1);
  for (int round = 0; round < 20; ++round) {
    ReplayWindow window(100);
    std::set<std::int64_t> taken;
    std::int64_t highest = 100;
    for (int i = 0; i < 20'000; ++i) {
      constexpr std::uint64_t kBack = 6000, kForward = 30;
      const std::int64_t nonce =
          highest + static_cast<std::int64_t>(random() % kForward) - static_cast<std::int64_t>(random() % kBack);
      const bool expected = nonce > 100 && nonce > highest - kReplayWindow && !taken.contains(nonce);
      ASSERT_EQ(window.Take(nonce), expected) << nonce << " after " << highest;
      if (expected) taken.insert(nonce);
      highest = std::max(highest, expected ? nonce : highest);
    }
  }
}

TEST(ReplayGuard, ASessionIsAdmittedByTheChallengeOfThisLifeOnly) {
  ReplayGuard guard(kSessions, 1), other_life(kSessions, 2);
  EXPECT_EQ(guard.Check(kCaller, 7, 1), Verdict::kUnproven);
  EXPECT_FALSE(guard.Prove(kCaller, 7, 2, other_life.challenge()));
  EXPECT_FALSE(guard.Prove(kCaller, 7, 2, 0));
  EXPECT_TRUE(guard.Prove(kCaller, 7, 2, guard.challenge()));
  EXPECT_EQ(guard.Check(kCaller, 7, 3), Verdict::kFresh);
  EXPECT_EQ(guard.Check(kCaller, 7, 3), Verdict::kReplayed);
  EXPECT_EQ(guard.Check(kCaller, 8, 4), Verdict::kUnproven) << "another session of the same caller";
}

TEST(ReplayGuard, NothingFromBeforeTheProofIsTaken) {
  ReplayGuard guard(kSessions, 1);
  ASSERT_TRUE(guard.Prove(kCaller, 7, 1000, guard.challenge()));
  for (std::int64_t nonce = 1; nonce <= 1000; ++nonce) EXPECT_EQ(guard.Check(kCaller, 7, nonce), Verdict::kReplayed);
}

TEST(ReplayGuard, ARepeatedProofDoesNotOpenTheWindowAgain) {
  ReplayGuard guard(kSessions, 1);
  ASSERT_TRUE(guard.Prove(kCaller, 7, 10, guard.challenge()));
  EXPECT_EQ(guard.Check(kCaller, 7, 11), Verdict::kFresh);
  EXPECT_TRUE(guard.Prove(kCaller, 7, 10, guard.challenge()));
  EXPECT_EQ(guard.Check(kCaller, 7, 11), Verdict::kReplayed);
}

TEST(ReplayGuard, AForgottenSessionsProofIsWorthNothing) {
  ReplayGuard guard(kSessions, 1);
  const std::int64_t first = guard.challenge();
  ASSERT_TRUE(guard.Prove(kCaller, 1, 1, first));
  EXPECT_EQ(guard.Check(kCaller, 1, 2), Verdict::kFresh);
  for (std::int64_t session = 2; session <= static_cast<std::int64_t>(kSessions) + 1; ++session) {
    ASSERT_TRUE(guard.Prove(kCaller, session, 1, guard.challenge()));
  }
  EXPECT_EQ(guard.Check(kCaller, 1, 2), Verdict::kUnproven) << "the longest silent one is forgotten";
  EXPECT_FALSE(guard.Prove(kCaller, 1, 1, first)) << "and its recorded proof does not bring it back";
  EXPECT_EQ(guard.Check(kCaller, 2, 2), Verdict::kFresh) << "the others go on";
}

}  // namespace
}  // namespace legopt::bus
