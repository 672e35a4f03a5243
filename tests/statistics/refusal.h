#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "legopt/input_error.h"

/// The statement refuses its input with a message that holds `part`.
#define EXPECT_REFUSED(statement, part) \
  EXPECT_THAT([&] { statement; }, testing::ThrowsMessage<legopt::InputError>(testing::HasSubstr(part)))
