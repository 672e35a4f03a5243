// Common parts of fuzz targets: a reader that splits an input, and a file with its content. Each target defines
// LLVMFuzzerTestOneInput, libFuzzer's entry point; without libFuzzer, replay.cpp calls it on every file of a corpus.
#pragma once

#include <unistd.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <span>
#include <string>
#include <string_view>

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

namespace legopt::fuzz {

// Aborts the process with a message if a property is violated.
inline void Require(bool holds, const char* what) {
  if (holds) return;
  std::fprintf(stderr, "fuzz target: violated: %s\n", what);
  std::abort();
}

// Reads an input from its beginning; returns zeros at the end.
class FuzzInput {
 public:
  FuzzInput(const std::uint8_t* data, std::size_t size) : rest_(data, size) {}
  bool empty() const { return rest_.empty(); }
  std::uint64_t Number(std::size_t bytes) {
    std::uint64_t value = 0;
    for (const std::uint8_t byte : Bytes(bytes)) value = (value << 8U) | byte;
    return value;
  }
  // Returns at most `most` bytes, fewer at the end.
  std::span<const std::uint8_t> Bytes(std::size_t most) {
    const auto taken = rest_.first(std::min(most, rest_.size()));
    rest_ = rest_.subspan(taken.size());
    return taken;
  }
  std::string_view Text() {
    const auto all = Bytes(rest_.size());
    return {reinterpret_cast<const char*>(all.data()), all.size()};
  }

 private:
  std::span<const std::uint8_t> rest_;
};

// A file with the input as content, for readers that take a path; in /dev/shm if available.
class InputFile {
 public:
  InputFile(std::string_view text, const std::string& suffix)
      : path_((::access("/dev/shm", W_OK) == 0 ? "/dev/shm" : "/tmp") + std::string("/legopt-fuzz-") +
              std::to_string(::getpid()) + suffix) {
    std::ofstream(path_, std::ios::binary) << text;
  }
  ~InputFile() { ::unlink(path_.c_str()); }
  InputFile(const InputFile&) = delete;
  InputFile& operator=(const InputFile&) = delete;
  const std::string& path() const { return path_; }

 private:
  std::string path_;
};

}  // namespace legopt::fuzz
