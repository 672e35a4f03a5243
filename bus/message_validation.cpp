#include "bus/message_validation.h"

#include <cstdint>
#include <optional>

namespace legopt::bus {
namespace {

class Walker {
 public:
  explicit Walker(std::string_view bytes) : bytes_(bytes) {}

  bool Walk(std::string_view layout) {
    for (std::size_t at = 0; at < layout.size(); ++at) {
      const char field = layout[at];
      if (field == 's') {
        if (!SkipString()) return false;
      } else if (field == 'a') {
        const std::size_t close = layout.find(')', at);  // groups do not nest
        if (!SkipGroups(layout.substr(at + 2, close - at - 2))) return false;
        at = close;
      } else if (!Skip(static_cast<std::size_t>(field - '0'))) {
        return false;
      }
    }
    return true;
  }

  bool at_end() const { return bytes_.empty(); }

 private:
  bool Skip(std::size_t count) {
    if (count > bytes_.size()) return false;
    bytes_.remove_prefix(count);
    return true;
  }

  std::optional<std::size_t> ReadCount() {
    std::uint32_t value = 0;
    if (bytes_.size() < sizeof(value)) return std::nullopt;
    for (std::size_t i = 0; i < sizeof(value); ++i) value = (value << 8) | static_cast<std::uint8_t>(bytes_[i]);
    bytes_.remove_prefix(sizeof(value));
    if (value > static_cast<std::uint32_t>(INT32_MAX)) return std::nullopt;  // negative
    return value;
  }

  bool SkipString() {
    const auto length = ReadCount();
    if (!length || *length == 0 || *length > bytes_.size()) return false;
    if (bytes_[*length - 1] != '\0') return false;
    return Skip(*length);
  }

  bool SkipGroups(std::string_view group) {
    const auto count = ReadCount();
    if (!count || *count > bytes_.size()) return false;  // a group has at least one byte
    if (group.size() == 1 && group[0] != 's') return Skip(*count * static_cast<std::size_t>(group[0] - '0'));
    for (std::size_t i = 0; i < *count; ++i) {
      if (!Walk(group)) return false;
    }
    return true;
  }

  std::string_view bytes_;
};

}  // namespace

bool LayoutFits(std::string_view layout, std::string_view bytes) {
  Walker walker(bytes);
  return walker.Walk(layout) && walker.at_end();
}

}  // namespace legopt::bus
