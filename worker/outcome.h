#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "legopt/types/job.h"
#include "legopt_msg/result_request.hpp"

namespace legopt::worker {

/// Maximum lengths of texts in a result. Longer ones are truncated (the log at its beginning, others at the end).
inline constexpr std::size_t kMaxMessageBytes = 2000;
inline constexpr std::size_t kMaxLogTailBytes = 4096;

/// Returns a result without a solution: numbers NaN, texts empty, except for `outcome` and `message` (truncated and
/// made printable).
legopt_msg::result_request ResultWithoutSolution(ReportedOutcome outcome, std::string_view message);

/// Returns `text` truncated at its end to `max_bytes`, without control characters (app::WithoutControls).
std::string PrintableText(std::string_view text, std::size_t max_bytes);
/// Returns `text` truncated at its beginning, because the last lines of a log matter; without control characters.
std::string PrintableTail(std::string_view text, std::size_t max_bytes);

}  // namespace legopt::worker
