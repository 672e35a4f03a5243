#pragma once

#include <spdlog/logger.h>

#include <string>

namespace legopt::app {

/// Pattern of log lines of server and worker: "[2026-11-21 14:00:00.000] [legopt-worker] [warning] text".
inline constexpr char kLogPattern[] = "[%Y-%m-%d %H:%M:%S.%e] [%n] [%^%l%$] %v";

/// Sets the logger's pattern (of spdlog; the message %v once) and makes messages printable, because they may contain
/// untrusted text. Each record stays on one line. Call before the logger is shared between threads.
void FormatPrintably(spdlog::logger& logger, const std::string& pattern = kLogPattern);

}  // namespace legopt::app
