#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace legopt {

/// Store of computed values between runs of a program. Losing an entry costs time only.
///
/// The key of an entry is a hash of all that the value depends on, including the version of the computation, so that an
/// entry is never outdated. Implementations are thread-safe and also safe for concurrent processes.
class ByteCache {
 public:
  virtual ~ByteCache() = default;
  /// Returns the bytes stored under a key (hexadecimal digits); nothing if there are none or they are damaged.
  virtual std::optional<std::string> Read(std::string_view key) const = 0;
  /// Stores bytes under a key. A failure, for example a full disk, is ignored.
  virtual void Write(std::string_view key, std::string_view bytes) const = 0;
};

}  // namespace legopt
