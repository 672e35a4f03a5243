#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "legopt/types/input_error.h"

/// Expects that the statement refuses its input with a message that contains `part`.
#define EXPECT_REFUSED(statement, part) \
  EXPECT_THAT([&] { statement; }, testing::ThrowsMessage<legopt::InputError>(testing::HasSubstr(part)))
