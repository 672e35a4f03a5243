#pragma once

#include <spdlog/logger.h>

#include <string>

namespace legopt::programs {

/// How server and worker write a line: "[2026-11-21 14:00:00.000] [legopt-worker] [warning] text".
inline constexpr char kLogPattern[] = "[%Y-%m-%d %H:%M:%S.%e] [%n] [%^%l%$] %v";

/// Lets a logger write its lines by `pattern` (of spdlog; the message %v once), with messages made printable: what they
/// quote may come from anybody. One record stays one line. Call before the logger is shared between threads.
void FormatPrintably(spdlog::logger& logger, const std::string& pattern = kLogPattern);

}  // namespace legopt::programs
