#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "legopt_msg/capability.hpp"
#include "worker/job_executor.h"

namespace legopt::worker {

/// Messages between supervisor and job process over their socket pair.
///
/// A frame is a header of 32 bytes, native byte order (both ends are the same program on one host), and a body:
///
///     offset  0  uint32  magic 0x4c474a31
///     offset  4  uint32  type (FrameType)
///     offset  8  uint64  sequence number of the job concerned; 0 when none
///     offset 16  uint64  length of the body, bytes
///     offset 24  uint64  SipHash-2-4 of bytes 4 - 23 and the body, under a fixed key
///
/// The supervisor does not trust the job process: anything but a well-formed frame at the right time ends the process.
enum class FrameType : std::uint32_t {
  kJob = 1,          ///< sent to the child: lease and method options (EncodeJob)
  kReady = 2,        ///< datasets and solver declarations are loaded; body: EncodeCapabilities
  kStartFailed = 3,  ///< body: reason why the datasets cannot be used, for the user
  kProgress = 4,     ///< body: done and total, EncodeProgress
  kJudging = 5,      ///< the solver has returned; empty body
  kResult = 6,       ///< body: a result_request with its identification
};

struct Frame {
  FrameType type{};
  std::uint64_t sequence = 0;
  std::string body;
};

inline constexpr std::size_t kFrameHeaderBytes = 32;
/// Largest body in either direction: fits a result of 1e6 numbers and rejects corrupted lengths.
inline constexpr std::size_t kMaxFrameBytes = std::size_t{32} << 20;
inline constexpr std::size_t kReadBytes = 1U << 16;  ///< largest read from the socket

std::string EncodeFrame(const Frame& frame);

/// Splits a byte stream into frames. kGarbage is permanent.
class FrameReader {
 public:
  enum class Status { kNeedMore, kFrame, kGarbage };

  void Append(std::string_view bytes) { buffer_.append(bytes); }
  /// Extracts the next frame. With kGarbage, `why` contains the fault.
  Status Next(Frame* frame, std::string* why);

 private:
  std::string buffer_;
  std::size_t consumed_ = 0;
  bool broken_ = false;
};

// Bodies. Decoders return false for a body that their encoder cannot have written.
std::string EncodeJob(const legopt_msg::lease& lease, std::string_view options_json);
bool DecodeJob(std::string_view body, legopt_msg::lease* lease, std::string* options_json);
std::string EncodeCapabilities(const std::vector<Capability>& capabilities);
bool DecodeCapabilities(std::string_view body, std::vector<Capability>* capabilities);
/// Returns the form used in a hello.
legopt_msg::capability ToMessage(const Capability& capability);
std::string EncodeProgress(int done, int total);
bool DecodeProgress(std::string_view body, int* done, int* total);

}  // namespace legopt::worker
