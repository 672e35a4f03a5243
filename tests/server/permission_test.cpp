#include "server/permission.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

namespace legopt::server {
namespace {

// The table of PROTOCOL.md, section 11, for every action, with or without an object.
TEST(Permission, ActionsThatConcernTheWorkOfOthersAreForOperators) {
  const std::vector<ControlAction> operators_only = {ControlAction::kPauseNow, ControlAction::kRelease,
                                                     ControlAction::kPriority, ControlAction::kDelete,
                                                     ControlAction::kDrainWorker};
  for (const EnumName<ControlAction>& row : kEnumNames<ControlAction>) {
    legopt_msg::control_request request{};
    request.action = EnumNumber(row.value);
    const bool restricted = std::find(operators_only.begin(), operators_only.end(), row.value) != operators_only.end();
    EXPECT_EQ(RefusalOf(bus::KeyRole::kOperator, request), "") << row.word;
    EXPECT_EQ(RefusalOf(bus::KeyRole::kClient, request).empty(), !restricted) << row.word;
    if (restricted) {
      EXPECT_EQ(
          RefusalOf(bus::KeyRole::kClient, request),
          "a client's key does not permit the action '" + std::string(row.word) + "'; give --key-file the full key");
    }
  }
}

}  // namespace
}  // namespace legopt::server
