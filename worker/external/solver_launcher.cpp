#include "worker/external/solver_launcher.h"

#include <fcntl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <system_error>

#include "worker/external/launcher_messages.h"
#include "worker/external/line_channel.h"

namespace legopt::external {
namespace {

[[noreturn]] void RefuseLaunch(const char* what) { throw std::system_error(errno, std::generic_category(), what); }

[[noreturn]] void LauncherIsGone() {
  throw std::system_error(ECHILD, std::generic_category(), "the process that starts external solvers is gone");
}

/// Reply with its descriptors.
struct Answer {
  LaunchReply reply;
  SolverLauncher::Streams streams;
};

void TakeDescriptors(msghdr& message, SolverLauncher::Streams& streams) {
  const cmsghdr* header = CMSG_FIRSTHDR(&message);
  std::array<int, 4> descriptors{};
  if (header == nullptr || header->cmsg_len != CMSG_LEN(sizeof(descriptors))) return;
  std::memcpy(descriptors.data(), CMSG_DATA(header), sizeof(descriptors));
  streams.in = app::Descriptor(descriptors[0]);
  streams.out = app::Descriptor(descriptors[1]);
  streams.error = app::Descriptor(descriptors[2]);
  streams.process = app::Descriptor(descriptors[3]);
  for (const auto* stream : {&streams.in, &streams.out, &streams.error}) stream->SetNonBlocking();
}

Answer AskLauncher(int socket, const LaunchRequest& request) {
  if (::send(socket, &request, sizeof(request), MSG_NOSIGNAL) != sizeof(request)) LauncherIsGone();
  Answer answer;
  iovec part{&answer.reply, sizeof(answer.reply)};
  alignas(cmsghdr) std::array<char, CMSG_SPACE(4 * sizeof(int))> control{};
  msghdr message{};
  message.msg_iov = &part;
  message.msg_iovlen = 1;
  message.msg_control = control.data();
  message.msg_controllen = control.size();
  ssize_t size = -1;
  do {
    size = ::recvmsg(socket, &message, MSG_CMSG_CLOEXEC);
  } while (size < 0 && errno == EINTR);
  if (size != sizeof(answer.reply)) LauncherIsGone();
  TakeDescriptors(message, answer.streams);
  return answer;
}

}  // namespace

SolverLauncher::SolverLauncher(std::span<const LaunchCommand> commands, const std::filesystem::path& scratch) {
  std::array<int, 2> sockets{};
  if (::socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0, sockets.data()) != 0) RefuseLaunch("socketpair");
  socket_ = app::Descriptor(sockets[0]);
  const app::Descriptor theirs(sockets[1]);
  launcher_ = ::fork();
  if (launcher_ < 0) RefuseLaunch("cannot start the process that starts external solvers");
  if (launcher_ == 0) {
    const int status = ServeLaunches(theirs.get(), commands);
    std::error_code ignored;
    if (!scratch.empty()) std::filesystem::remove_all(scratch, ignored);
    ::_exit(status);
  }
}

SolverLauncher::~SolverLauncher() {
  socket_.Close();  // makes the launcher end
  app::WaitForEnd(launcher_);
}

SolverLauncher::Streams SolverLauncher::Start(std::size_t command, std::int64_t memory_bytes) {
  Answer answer = AskLauncher(socket_.get(),
                              {LaunchRequest::Kind::kStart, false, static_cast<std::uint32_t>(command), memory_bytes});
  if (answer.reply.error != 0) {
    throw SolverFault(std::string("could not be started: ") + std::strerror(answer.reply.error));
  }
  if (!answer.streams.error.open()) LauncherIsGone();
  return std::move(answer.streams);
}

void SolverLauncher::CountFromNow() { AskLauncher(socket_.get(), {LaunchRequest::Kind::kCount, false, 0, 0}); }

ProcessEnd SolverLauncher::End(bool leaving) {
  const ProcessEnd end = AskLauncher(socket_.get(), {LaunchRequest::Kind::kEnd, leaving, 0, 0}).reply.end;
  usage_.cpu_us += end.usage.cpu_us;
  usage_.peak_memory_bytes = std::max(usage_.peak_memory_bytes, end.usage.peak_memory_bytes);
  return end;
}

}  // namespace legopt::external
