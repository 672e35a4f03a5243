#include "app/log_format.h"

#include <spdlog/pattern_formatter.h>

#include <memory>
#include <string_view>

#include "app/printable.h"

namespace legopt::app {
namespace {

constexpr char kFlag = '*';

class PrintableMessage final : public spdlog::custom_flag_formatter {
 public:
  void format(const spdlog::details::log_msg& message, const std::tm&, spdlog::memory_buf_t& line) override {
    const std::string text = Printable(std::string_view(message.payload.data(), message.payload.size()));
    line.append(text.data(), text.data() + text.size());
  }
  std::unique_ptr<custom_flag_formatter> clone() const override { return std::make_unique<PrintableMessage>(); }
};

}  // namespace

void FormatPrintably(spdlog::logger& logger, const std::string& pattern) {
  std::string own = pattern;
  own.replace(own.find("%v"), 2, std::string("%") + kFlag);
  auto formatter = std::make_unique<spdlog::pattern_formatter>();
  formatter->add_flag<PrintableMessage>(kFlag).set_pattern(own);
  logger.set_formatter(std::move(formatter));
}

}  // namespace legopt::app
