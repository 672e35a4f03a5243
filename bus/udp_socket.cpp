#include "bus/udp_socket.h"

#include <linux/filter.h>
#include <linux/if_packet.h>
#include <sys/socket.h>

#include <algorithm>
#include <fstream>
#include <initializer_list>
#include <sstream>
#include <string>
#include <vector>

#include "bus/messages.h"

namespace legopt::bus {
namespace {

// Offsets from the UDP header, where a filter on a UDP socket starts: 8 bytes of UDP, 8 of LCM, the channel with its
// NUL, then the frame (frame.lcm).
constexpr std::uint32_t kMagic = 8;
constexpr std::uint32_t kChannel = 16;
constexpr std::uint32_t kFrame = 23;
constexpr std::uint32_t kDeployment = kFrame + 16;
constexpr std::uint32_t kDestination = kFrame + 32;
constexpr std::uint32_t kDestinationEnd = kDestination + 8;

// Metadata of a packet, which the kernel exposes at special offsets.
constexpr auto kInterface = static_cast<std::uint32_t>(SKF_AD_OFF + SKF_AD_IFINDEX);
constexpr auto kPacketType = static_cast<std::uint32_t>(SKF_AD_OFF + SKF_AD_PKTTYPE);

constexpr std::uint32_t Word(char a, char b, char c, char d) {
  return (static_cast<std::uint32_t>(a) << 24U) | (static_cast<std::uint32_t>(b) << 16U) |
         (static_cast<std::uint32_t>(c) << 8U) | static_cast<std::uint32_t>(d);
}

// Builds a filter from a sequence of tests. Jumps lead to the next test, over it, or to one of two exits at the end;
// Attach() resolves them.
class Program {
 public:
  enum class Exit : std::uint8_t { kNext, kSkipTest, kAccept, kDrop };

  // Loads the word at `offset`, masks it, compares it and jumps to `equal` or `other`. The kernel drops packets that
  // are too short.
  void Test(std::uint32_t offset, std::uint32_t value, Exit equal, Exit other, std::uint32_t mask = ~0U) {
    code_.push_back(BPF_STMT(BPF_LD | BPF_W | BPF_ABS, offset));
    exits_.push_back({});
    if (mask != ~0U) {
      code_.push_back(BPF_STMT(BPF_ALU | BPF_AND | BPF_K, mask));
      exits_.push_back({});
    }
    code_.push_back(BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, value, 0, 0));
    exits_.push_back({equal, other});
  }
  // Continues with the next test if the packet has at least `bytes`; otherwise jumps to `shorter`.
  void AtLeast(std::uint32_t bytes, Exit shorter) {
    code_.push_back(BPF_STMT(BPF_LD | BPF_W | BPF_LEN, 0));
    exits_.push_back({});
    code_.push_back(BPF_JUMP(BPF_JMP | BPF_JGE | BPF_K, bytes, 0, 0));
    exits_.push_back({Exit::kNext, shorter});
  }

  bool Attach(int socket_fd) {
    constexpr std::uint32_t kWholePacket = 0xFFFFFFFFU;
    const std::size_t accept = code_.size();
    const std::size_t drop = accept + 1;
    for (std::size_t i = 0; i < accept; ++i) {
      const auto jump = [&](Exit exit) -> std::uint8_t {
        constexpr std::uint8_t kTestInstructions = 2;  // instructions of an unmasked test: load and compare
        if (exit == Exit::kNext) return 0;
        if (exit == Exit::kSkipTest) return kTestInstructions;
        return static_cast<std::uint8_t>((exit == Exit::kAccept ? accept : drop) - i - 1);
      };
      code_[i].jt = jump(exits_[i].equal);
      code_[i].jf = jump(exits_[i].other);
    }
    code_.push_back(BPF_STMT(BPF_RET | BPF_K, kWholePacket));
    code_.push_back(BPF_STMT(BPF_RET | BPF_K, 0));
    const sock_fprog program{static_cast<unsigned short>(code_.size()), code_.data()};
    return ::setsockopt(socket_fd, SOL_SOCKET, SO_ATTACH_FILTER, &program, sizeof(program)) == 0;
  }

 private:
  struct Exits {
    Exit equal = Exit::kNext;
    Exit other = Exit::kNext;
  };
  std::vector<sock_filter> code_;
  std::vector<Exits> exits_;
};

std::uint32_t High(std::int64_t value) { return static_cast<std::uint32_t>(static_cast<std::uint64_t>(value) >> 32U); }
std::uint32_t Low(std::int64_t value) { return static_cast<std::uint32_t>(value); }

}  // namespace

bool AttachSocketFilter(int socket_fd, std::int64_t deployment, std::int64_t self, int only_from) {
  using Exit = Program::Exit;
  constexpr std::uint32_t kThreeBytes = 0xFFFFFF00U;
  const std::int64_t fingerprint = legopt_msg::frame::getHash();
  Program program;
  if (only_from != 0) {
    program.Test(kInterface, static_cast<std::uint32_t>(only_from), Exit::kSkipTest, Exit::kNext);
    program.Test(kPacketType, PACKET_LOOPBACK, Exit::kNext, Exit::kDrop);
  }
  program.Test(kMagic, Word('L', 'C', '0', '2'), Exit::kNext, Exit::kDrop);
  program.Test(kChannel, Word('L', 'E', 'G', 'O'), Exit::kNext, Exit::kDrop);
  program.Test(kChannel + 4, Word('P', 'T', '\0', '\0'), Exit::kNext, Exit::kDrop, kThreeBytes);
  if (self != 0) {
    // Drops only well-formed frames of this deployment for another party. Malformed packets pass, so that they are
    // counted.
    program.AtLeast(kDestinationEnd, Exit::kAccept);
    program.Test(kFrame, High(fingerprint), Exit::kNext, Exit::kAccept);
    program.Test(kFrame + 4, Low(fingerprint), Exit::kNext, Exit::kAccept);
    program.Test(kDeployment, High(deployment), Exit::kNext, Exit::kAccept);
    program.Test(kDeployment + 4, Low(deployment), Exit::kNext, Exit::kAccept);
    program.Test(kDestination, High(self), Exit::kNext, Exit::kDrop);
    program.Test(kDestination + 4, Low(self), Exit::kAccept, Exit::kDrop);
  }
  return program.Attach(socket_fd);
}

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
