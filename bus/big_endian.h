#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <type_traits>

/// @file
/// Reading and writing of big-endian integers in byte buffers, the byte order of LCM and of the bridge. The caller
/// guarantees that the buffer is large enough. Used by bus and bridge.

namespace legopt::bus {

/// Writes values to a buffer, one after another.
class Writer {
 public:
  /// Starts at `at`.
  explicit Writer(std::uint8_t* at) : at_(at) {}
  /// Writes the sizeof(Integer) bytes of `value`.
  template <class Integer>
  Writer& Put(Integer value) {
    auto bits = static_cast<std::make_unsigned_t<Integer>>(value);
    for (std::size_t i = sizeof(Integer); i-- > 0;) *at_++ = static_cast<std::uint8_t>(bits >> (8 * i));
    return *this;
  }
  /// Writes bytes unchanged.
  Writer& Bytes(std::span<const std::uint8_t> bytes) {
    at_ = std::copy(bytes.begin(), bytes.end(), at_);
    return *this;
  }
  std::uint8_t* at() const { return at_; }  ///< end of the written bytes

 private:
  std::uint8_t* at_;
};

/// Reads values from a buffer, one after another.
class Reader {
 public:
  /// Starts at `at`.
  explicit Reader(const std::uint8_t* at) : at_(at) {}
  /// Reads sizeof(Integer) bytes.
  template <class Integer>
  Integer Get() {
    std::make_unsigned_t<Integer> bits = 0;
    for (std::size_t i = 0; i < sizeof(Integer); ++i) {
      bits = static_cast<std::make_unsigned_t<Integer>>((std::uint64_t{bits} << 8) | *at_++);
    }
    return static_cast<Integer>(bits);
  }
  /// Reads out.size() bytes unchanged.
  void Bytes(std::span<std::uint8_t> out) {
    std::copy_n(at_, out.size(), out.begin());
    at_ += out.size();
  }

 private:
  const std::uint8_t* at_;
};

}  // namespace legopt::bus
