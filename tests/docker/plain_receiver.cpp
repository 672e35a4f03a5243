// Uses LCM without legopt's socket filter, like most programs: the victim of firewall_test, and its attacker.
//
//   plain_receiver receive PORT    exits with 0 at the message on channel BYE, with 3 if none arrives within 20 s
//   plain_receiver send PORT       sends a fragment whose offset wraps around, a good message or two, and BYE
#include <arpa/inet.h>
#include <lcm/lcm.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string>

namespace {

constexpr char kGroup[] = "239.255.76.67";

void OnMessage(const lcm_recv_buf_t* /*message*/, const char* channel, void* done) {
  if (std::strcmp(channel, "BYE") == 0) *static_cast<bool*>(done) = true;
}

int Receive(const std::string& port) {
  lcm_t* lcm = lcm_create(("udpm://" + std::string(kGroup) + ":" + port + "?ttl=0").c_str());
  if (lcm == nullptr) return 2;
  bool done = false;
  lcm_subscribe(lcm, ".*", &OnMessage, &done);
  lcm_get_fileno(lcm);  // starts to listen
  std::puts("listening");
  std::fflush(stdout);
  constexpr int kSlice_ms = 100;
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(20);
  while (!done && std::chrono::steady_clock::now() < end) lcm_handle_timeout(lcm, kSlice_ms);
  lcm_destroy(lcm);
  return done ? 0 : 3;
}

int Send(const std::string& port) {
  const int fd = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  const unsigned char ttl = 0;
  ::setsockopt(fd, IPPROTO_IP, IP_MULTICAST_TTL, &ttl, sizeof(ttl));
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(std::stoi(port)));
  ::inet_pton(AF_INET, kGroup, &address.sin_addr);
  const auto send = [&](const std::string& packet) {
    ::sendto(fd, packet.data(), packet.size(), 0, reinterpret_cast<const sockaddr*>(&address), sizeof(address));
    ::usleep(50'000);
  };
  // Header: magic, message, size 16, offset, fragment, fragments. The first starts a message of 16 bytes on channel
  // "x"; offset plus length of the second is 16 in 32 bits, which passes the bounds check.
  send(std::string("LC03\0\0\0\1\0\0\0\x10\0\0\0\0\0\0\0\2x\0AAAAAAAA", 30));
  send(std::string("LC03\0\0\0\1\0\0\0\x10\xFF\xFF\xFF\xF8\0\1\0\2AAAAAAAAAAAAAAAAAAAAAAAA", 44));
  send(std::string("LC02\0\0\0\0good\0data", 17));
  for (int i = 0; i < 3; ++i) send(std::string("LC02\0\0\0\0BYE\0", 12));
  ::close(fd);
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) return 2;
  return std::strcmp(argv[1], "send") == 0 ? Send(argv[2]) : Receive(argv[2]);
}
