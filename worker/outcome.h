#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "legopt_msg/result_request.hpp"

namespace legopt::worker {

/// What became of one attempt; values of result_request.outcome.
enum class Outcome : std::int8_t {
  kFinished = 0,     ///< solved, well or badly, and judged
  kCrashed = 1,      ///< the job process died or broke the protocol
  kTimeLimit = 2,    ///< killed, because the solver did not stop itself
  kMemoryLimit = 3,  ///< needed more memory than the job may have
  kCancelled = 4,
  kError = 5,  ///< could not be run as asked (no such problem, other dataset, unknown option)
};

/// Longest texts that a result carries; longer ones are cut (the log at the front, others at the end).
inline constexpr std::size_t kMaxMessageBytes = 2000;
inline constexpr std::size_t kMaxLogTailBytes = 4096;
inline constexpr std::size_t kMaxHistoryBytes = std::size_t{4} << 20;

/// A result without a solution: figures NaN, texts empty, but for `outcome` and `message` (cut and made printable).
legopt_msg::result_request ResultWithoutSolution(Outcome outcome, std::string_view message);

/// `text` cut to `max_bytes` at its end; control characters except newline and tab become '?'.
std::string PrintableText(std::string_view text, std::size_t max_bytes);
/// The same, cut at its beginning (the last lines of a log matter).
std::string PrintableTail(std::string_view text, std::size_t max_bytes);

/// "SIGSEGV (segmentation fault)" or the like for the signals that end programs; "signal 42" otherwise.
std::string SignalName(int signal);

}  // namespace legopt::worker
