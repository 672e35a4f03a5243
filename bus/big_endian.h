#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <type_traits>

/// @file
/// Integers as bytes, the most significant first, in place: LCM's order, and that of bridges. The caller sees to the
/// room. For bus and bridge.

namespace legopt::bus {

/// Writes one after another.
class Writer {
 public:
  /// At `at`, from there on.
  explicit Writer(std::uint8_t* at) : at_(at) {}
  /// As many bytes as the type has.
  template <class Integer>
  Writer& Put(Integer value) {
    auto bits = static_cast<std::make_unsigned_t<Integer>>(value);
    for (std::size_t i = sizeof(Integer); i-- > 0;) *at_++ = static_cast<std::uint8_t>(bits >> (8 * i));
    return *this;
  }
  /// As they are.
  Writer& Bytes(std::span<const std::uint8_t> bytes) {
    at_ = std::copy(bytes.begin(), bytes.end(), at_);
    return *this;
  }
  std::uint8_t* at() const { return at_; }  ///< behind what was written

 private:
  std::uint8_t* at_;
};

/// Reads one after another.
class Reader {
 public:
  /// At `at`, from there on.
  explicit Reader(const std::uint8_t* at) : at_(at) {}
  /// As many bytes as the type has.
  template <class Integer>
  Integer Get() {
    std::make_unsigned_t<Integer> bits = 0;
    for (std::size_t i = 0; i < sizeof(Integer); ++i) {
      bits = static_cast<std::make_unsigned_t<Integer>>((std::uint64_t{bits} << 8) | *at_++);
    }
    return static_cast<Integer>(bits);
  }
  /// As they are, as many as `out` has.
  void Bytes(std::span<std::uint8_t> out) {
    std::copy_n(at_, out.size(), out.begin());
    at_ += out.size();
  }

 private:
  const std::uint8_t* at_;
};

}  // namespace legopt::bus
