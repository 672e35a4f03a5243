// The name of a build: changes that affect its id, changes that do not, and its output format.

#include "app/build_identity.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

namespace legopt::app {
namespace {

using testing::HasSubstr;
using testing::MatchesRegex;
using testing::Not;

BuildFacts Sample() {
  return {"0.1.0", "8a643da59c",  std::string(64, 'a'), "GNU 12.2.0",
          "-O3",   "Eigen 3.4.0", "glibc 2.36",         "1234567890abcdef"};
}

TEST(BuildIdentity, TheIdIsTwelveDigits) { EXPECT_THAT(BuildId(Sample()), MatchesRegex("[0-9a-f]{12}")); }

TEST(BuildIdentity, WhatMayChangeABitChangesTheId) {
  for (std::string BuildFacts::*fact : {&BuildFacts::version, &BuildFacts::sources, &BuildFacts::compiler,
                                        &BuildFacts::flags, &BuildFacts::libraries, &BuildFacts::numerics}) {
    BuildFacts other = Sample();
    other.*fact += "1";
    EXPECT_NE(BuildId(other), BuildId(Sample()));
  }
}

TEST(BuildIdentity, FactsDoNotRunIntoEachOther) {
  BuildFacts other = Sample();
  other.compiler += other.flags;
  other.flags.clear();
  EXPECT_NE(BuildId(other), BuildId(Sample()));
}

TEST(BuildIdentity, ACommitOfDocumentsIsTheSameBuild) {
  BuildFacts other = Sample();
  other.commit = "1234567890-dirty";
  other.math_library = "glibc 2.37";
  EXPECT_EQ(BuildId(other), BuildId(Sample()));
  EXPECT_THAT(BuildName(other), HasSubstr("1234567890-dirty"));
}

TEST(BuildIdentity, TheNameFitsAMessage) {
  EXPECT_EQ(BuildName(Sample()), "legopt 0.1.0 (8a643da59c), GNU 12.2.0, numerics 1234567890abcdef");
  BuildFacts without_git = Sample();
  without_git.commit.clear();
  without_git.numerics.clear();
  EXPECT_EQ(BuildName(without_git), "legopt 0.1.0, GNU 12.2.0");
  without_git.compiler = std::string(1000, 'x');
  EXPECT_LE(BuildName(without_git).size(), 200U);
}

TEST(BuildIdentity, TheReportHasEveryFact) {
  const std::string report = BuildReport(Sample());
  for (const char* fact :
       {"0.1.0", "8a643da59c", "aaaaaaaaaaaa", "GNU 12.2.0", "-O3", "Eigen 3.4.0", "glibc 2.36", "1234567890abcdef"}) {
    EXPECT_THAT(report, HasSubstr(fact));
  }
  EXPECT_THAT(report, HasSubstr(BuildId(Sample())));
}

TEST(BuildIdentity, AProgramThatComputesNothingHasNoId) {
  BuildFacts server = Sample();
  server.numerics.clear();
  const std::string report = BuildReport(server);
  EXPECT_THAT(report, Not(HasSubstr(BuildId(server))));
  EXPECT_THAT(report, HasSubstr("computes no results"));
}

}  // namespace
}  // namespace legopt::app
