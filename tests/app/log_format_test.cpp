// Policy: a log record is one line without control characters for any message; the rest of the line follows the
// pattern.
#include "app/log_format.h"

#include <gtest/gtest.h>
#include <spdlog/sinks/ostream_sink.h>

#include <memory>
#include <sstream>
#include <string>

namespace legopt::app {
namespace {

TEST(LogFormat, MessagesAreEscaped) {
  std::ostringstream stream;
  spdlog::logger logger("legopt-test", std::make_shared<spdlog::sinks::ostream_sink_st>(stream));
  FormatPrintably(logger, "[%n] [%l] %v");
  logger.warn("worker '{}' said {}", "\x1b[2Jö", "a\n[legopt-test] [info] forged");
  EXPECT_EQ(stream.str(), "[legopt-test] [warning] worker '\\x1b[2Jö' said a\\n[legopt-test] [info] forged\n");
}

TEST(LogFormat, TheUsualLineIsThatOfSpdlog) {
  std::ostringstream ours, theirs;
  spdlog::logger logger("x", std::make_shared<spdlog::sinks::ostream_sink_st>(ours));
  spdlog::logger plain("x", std::make_shared<spdlog::sinks::ostream_sink_st>(theirs));
  FormatPrintably(logger);
  logger.error("text");
  plain.error("text");
  const auto after_time = [](const std::string& line) { return line.substr(line.find(']')); };
  EXPECT_EQ(after_time(ours.str()), after_time(theirs.str()));
  EXPECT_EQ(ours.str().size(), theirs.str().size());
}

}  // namespace
}  // namespace legopt::app
