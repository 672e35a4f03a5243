#include "tests/client/raw_http.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>

#include <array>
#include <cerrno>
#include <system_error>

namespace legopt::test {
namespace {

using Clock = std::chrono::steady_clock;
using std::chrono::milliseconds;

// Waits for `events`; returns false after `limit`.
bool Wait(int socket, short events, milliseconds limit) {
  pollfd descriptor{socket, events, 0};
  return poll(&descriptor, 1, static_cast<int>(limit.count())) > 0;
}

}  // namespace

RawHttp::RawHttp(std::uint16_t port, int visitor)
    : socket_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)), port_(port) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK - 1 + static_cast<std::uint32_t>(visitor));
  if (bind(socket_.get(), reinterpret_cast<const sockaddr*>(&address), sizeof(address)) != 0) {
    throw std::system_error(errno, std::generic_category(), "bind");
  }
  address.sin_port = htons(port);
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  if (connect(socket_.get(), reinterpret_cast<const sockaddr*>(&address), sizeof(address)) != 0) {
    throw std::system_error(errno, std::generic_category(), "connect");
  }
}

bool RawHttp::Send(const std::string& bytes) {
  std::size_t sent = 0;
  while (sent < bytes.size()) {
    if (!Wait(socket_.get(), POLLOUT, milliseconds(1000))) return false;
    const ssize_t count = send(socket_.get(), bytes.data() + sent, bytes.size() - sent, MSG_NOSIGNAL | MSG_DONTWAIT);
    if (count < 0 && errno == EAGAIN) continue;
    if (count <= 0) return false;
    sent += static_cast<std::size_t>(count);
  }
  return true;
}

bool RawHttp::Get(const std::string& path, const std::string& headers) {
  return Send("GET " + path + " HTTP/1.1\r\nHost: 127.0.0.1:" + std::to_string(port_) + "\r\n" + headers + "\r\n");
}

std::string RawHttp::Receive(const std::string& until, milliseconds limit) {
  const auto end = Clock::now() + limit;
  std::string text;
  std::array<char, 65536> piece{};
  while (until.empty() || text.find(until) == std::string::npos) {
    const auto left = std::chrono::duration_cast<milliseconds>(end - Clock::now());
    if (left.count() <= 0 || !Wait(socket_.get(), POLLIN, left)) break;
    const ssize_t count = recv(socket_.get(), piece.data(), piece.size(), MSG_DONTWAIT);
    if (count <= 0) break;
    text.append(piece.data(), static_cast<std::size_t>(count));
  }
  return text;
}

bool RawHttp::Closed(milliseconds limit) {
  const auto end = Clock::now() + limit;
  std::array<char, 65536> piece{};
  while (true) {
    const auto left = std::chrono::duration_cast<milliseconds>(end - Clock::now());
    if (left.count() <= 0 || !Wait(socket_.get(), POLLIN, left)) return false;
    if (recv(socket_.get(), piece.data(), piece.size(), MSG_DONTWAIT) <= 0) return true;
  }
}

std::string Fetch(std::uint16_t port, const std::string& path, const std::string& headers, int visitor) {
  RawHttp http(port, visitor);
  http.Get(path, headers + "Connection: close\r\n");
  return http.Receive("", std::chrono::seconds(60));
}

std::uint16_t FreePort() {
  const app::Descriptor socket(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0));
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof(address);
  auto* const any = reinterpret_cast<sockaddr*>(&address);
  if (bind(socket.get(), any, size) != 0 || getsockname(socket.get(), any, &size) != 0) {
    throw std::system_error(errno, std::generic_category(), "bind");
  }
  return ntohs(address.sin_port);
}

std::uint16_t PortOf(const std::string& url) {
  return static_cast<std::uint16_t>(std::stoi(url.substr(url.rfind(':') + 1)));
}

}  // namespace legopt::test
