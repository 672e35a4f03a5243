// Test vectors of the protocol, as bytes.
#pragma once

#include <cstdint>
#include <cstdlib>
#include <fstream>
#include <map>
#include <span>
#include <sstream>
#include <string>
#include <vector>

#include "tests/folders.h"

namespace legopt::bus {

// Returns name -> bytes, read from lines "vector NAME" and the hexadecimal lines after each.
inline std::map<std::string, std::vector<std::uint8_t>> ReadProtocolVectors() {
  std::ifstream file(SourceFolder() + "/lcmtypes/test-vectors.txt");
  std::map<std::string, std::vector<std::uint8_t>> vectors;
  std::vector<std::uint8_t>* current = nullptr;
  for (std::string line; std::getline(file, line);) {
    std::istringstream words(line);
    std::string word, name;
    if (line.rfind("vector ", 0) == 0) {
      words >> word >> name;
      current = &vectors[name];
    } else if (line.empty() || line.front() == '#') {
      current = nullptr;
    } else if (current != nullptr) {
      while (words >> word) {
        for (std::size_t i = 0; i + 1 < word.size(); i += 2) {
          current->push_back(static_cast<std::uint8_t>(std::strtoul(word.substr(i, 2).c_str(), nullptr, 16)));
        }
      }
    }
  }
  return vectors;
}

inline std::string Hex(std::span<const std::uint8_t> bytes) {
  static constexpr char kHex[] = "0123456789abcdef";
  std::string text;
  for (const std::uint8_t byte : bytes) {
    text += kHex[byte >> 4U];
    text += kHex[byte & 15U];
  }
  return text;
}

}  // namespace legopt::bus
