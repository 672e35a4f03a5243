#include "bus/udp_statistics.h"

#include <algorithm>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

namespace legopt::bus {
namespace {

std::vector<std::string> Words(const std::string& line) {
  std::istringstream stream(line);  // reader: words
  std::vector<std::string> words;
  for (std::string word; stream >> word;) words.push_back(word);
  return words;
}

std::uint64_t ToNumber(const std::string& word) {
  std::uint64_t value = 0;
  for (const char c : word) {
    if (c < '0' || c > '9') return 0;
    value = value * 10 + static_cast<std::uint64_t>(c - '0');
  }
  return value;
}

}  // namespace

std::uint64_t SocketDrops(std::span<const std::uint64_t> inodes) {
  // "sl local rem st tx:rx tr:when retrnsmt uid timeout inode ref pointer drops"
  constexpr std::size_t kInode = 9;
  constexpr std::size_t kDrops = 12;
  std::ifstream table("/proc/net/udp");
  std::uint64_t drops = 0;
  for (std::string line; std::getline(table, line);) {
    const auto words = Words(line);
    if (words.size() <= kDrops) continue;
    if (std::find(inodes.begin(), inodes.end(), ToNumber(words[kInode])) != inodes.end()) {
      drops += ToNumber(words[kDrops]);
    }
  }
  return drops;
}

std::uint64_t ReceiveBufferErrors() {
  std::ifstream table("/proc/net/snmp");
  std::vector<std::string> names;
  for (std::string line; std::getline(table, line);) {
    if (!line.starts_with("Udp:")) continue;
    const auto words = Words(line);
    if (names.empty()) {
      names = words;
      continue;
    }
    const auto at = std::find(names.begin(), names.end(), "RcvbufErrors") - names.begin();
    return static_cast<std::size_t>(at) < words.size() ? ToNumber(words[static_cast<std::size_t>(at)]) : 0;
  }
  return 0;
}

std::uint64_t LargestReceiveBuffer() {
  std::ifstream file("/proc/sys/net/core/rmem_max");
  std::string word;
  file >> word;
  return ToNumber(word);
}

}  // namespace legopt::bus
