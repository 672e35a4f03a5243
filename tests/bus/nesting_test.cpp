// JSON texts of messages nest at most 64 levels deep, so that recursive readers and error messages are safe.
#include <gtest/gtest.h>

#include <string>

#include "bus/codec.h"
#include "bus/field_check.h"

namespace legopt::bus {
namespace {

std::string Nested(int depth) {
  return std::string(static_cast<std::size_t>(depth), '[') + std::string(static_cast<std::size_t>(depth), ']');
}

TEST(Nesting, IsCountedOutsideOfTexts) {
  EXPECT_TRUE(NestsWithin(Nested(3), 3));
  EXPECT_FALSE(NestsWithin(Nested(4), 3));
  EXPECT_TRUE(NestsWithin(R"({"a":"[[[[[[","b\"[[[[":[]})", 2));
  EXPECT_TRUE(NestsWithin("[][][][]{}{}{}", 1)) << "beside each other";
  EXPECT_TRUE(NestsWithin("\"unfinished [[[[\\", 1));
}

TEST(Nesting, ASubmissionThatNestsDeeperIsRefused) {
  legopt_msg::submit_request request{};
  request.submission_id = "id";
  request.spec_json = "{\"seed\":" + Nested(kMaxJsonNesting - 1) + "}";
  EXPECT_EQ(Validate(request), "");
  request.spec_json = "{\"seed\":" + Nested(100'000) + "}";
  EXPECT_NE(Validate(request).find("spec_json"), std::string::npos);
}

}  // namespace
}  // namespace legopt::bus
