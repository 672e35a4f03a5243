#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "legopt_msg/result_request.hpp"
#include "words/job.h"

namespace legopt::worker {

/// Longest texts that a result carries; longer ones are cut (the log at the front, others at the end).
inline constexpr std::size_t kMaxMessageBytes = 2000;
inline constexpr std::size_t kMaxLogTailBytes = 4096;

/// A result without a solution: figures NaN, texts empty, but for `outcome` and `message` (cut and made printable).
legopt_msg::result_request ResultWithoutSolution(ReportedOutcome outcome, std::string_view message);

/// `text` cut to `max_bytes` at its end, without controls (programs::WithoutControls).
std::string PrintableText(std::string_view text, std::size_t max_bytes);
/// The same, cut at its beginning (the last lines of a log matter).
std::string PrintableTail(std::string_view text, std::size_t max_bytes);

}  // namespace legopt::worker
