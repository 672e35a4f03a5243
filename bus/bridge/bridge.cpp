#include "bus/bridge/bridge.h"

#include <poll.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <csignal>
#include <functional>
#include <mutex>
#include <thread>
#include <utility>

#include "bus/bridge/envelope.h"
#include "bus/bridge/hub.h"
#include "bus/bridge/spoke.h"
#include "bus/bus_error.h"
#include "bus/endpoint.h"

namespace legopt::bridge {
namespace {

constexpr int kMaxPerRound = 256;  // maximum number of link datagrams per round, so that the bus is not starved
constexpr microseconds kLongestRound = std::chrono::seconds(1);

// Starts a thread that blocks all signals, so that the program's own thread handles them.
std::thread StartWithoutSignals(std::function<void()> work) {
  sigset_t all, before;
  sigfillset(&all);
  pthread_sigmask(SIG_SETMASK, &all, &before);
  std::thread thread(std::move(work));
  pthread_sigmask(SIG_SETMASK, &before, nullptr);
  return thread;
}

}  // namespace

// Thread with the sockets. The link end decides what to do with datagrams.
class Bridge::Loop final : private Carrier, private bus::DatagramReceiver {
 public:
  using MakeEnd = std::function<std::unique_ptr<LinkEnd>(const DeploymentIdentity&, Carrier&)>;

  Loop(const bus::LcmOptions& bus, LinkSocket socket, const MakeEnd& make_end)
      : bus_(bus), socket_(std::move(socket)), stop_fd_(::eventfd(0, EFD_CLOEXEC)) {
    if (stop_fd_ < 0) throw bus::BusError(bus::BusErrorCode::kNetworkUnusable, "no descriptor for a bridge's end");
    end_ = make_end(DeploymentIdentity{bus_.deployment(), bus_.key()}, *this);
    bus_.SetReceiver(this, 0);
    thread_ = StartWithoutSignals([this] { Run(); });
  }
  ~Loop() {
    const std::uint64_t one = 1;
    if (::write(stop_fd_, &one, sizeof one) != sizeof one) std::terminate();  // an eventfd accepts it
    thread_.join();
    ::close(stop_fd_);
    bus_.SetReceiver(nullptr, 0);
  }
  Loop(const Loop&) = delete;
  Loop& operator=(const Loop&) = delete;

  LinkCounters counters() const {
    const std::lock_guard lock(mutex_);
    return published_;
  }
  bool linked() const { return linked_; }

 private:
  void Run() {
    std::array<pollfd, 2> extra{pollfd{socket_.descriptor(), POLLIN, 0}, pollfd{stop_fd_, POLLIN, 0}};
    while ((extra[1].revents & POLLIN) == 0) {
      const microseconds now = bus_.now();
      bus_.Poll(extra, std::clamp(end_->next_deadline() - now, microseconds(0), kLongestRound));
      if ((extra[0].revents & POLLIN) != 0) DrainLink();
      end_->Tick(bus_.now());
      linked_ = end_->linked();
      const std::lock_guard lock(mutex_);
      published_ = end_->counters();
    }
  }

  void DrainLink() {
    // One byte larger than the largest envelope, to detect datagrams that are too large.
    std::array<std::uint8_t, kMaxEnvelopeBytes + 1> room{};
    for (int i = 0; i < kMaxPerRound; ++i) {
      LinkAddress from = 0;
      const std::size_t bytes = socket_.Receive(room, from);
      if (bytes == 0) return;
      end_->OnLink(from, std::span(room.data(), bytes), bus_.now());
    }
  }

  void OnDatagram(bus::Port port, std::span<const std::uint8_t> datagram) noexcept override {
    end_->OnBus(port, datagram, bus_.now());
  }
  void ToBus(bus::Port port, std::span<const std::uint8_t> frame) override { bus_.Send(port, frame); }
  void ToLink(LinkAddress to, std::span<const std::uint8_t> envelope) override { socket_.Send(to, envelope); }

  bus::LcmTransport bus_;
  LinkSocket socket_;
  int stop_fd_;
  std::unique_ptr<LinkEnd> end_;
  mutable std::mutex mutex_;
  LinkCounters published_;
  std::atomic<bool> linked_{false};
  std::thread thread_;
};

Bridge::Bridge(std::unique_ptr<Loop> loop) : loop_(std::move(loop)) {}
Bridge::~Bridge() = default;

LinkCounters Bridge::counters() const { return loop_->counters(); }
bool Bridge::linked() const { return loop_->linked(); }

std::unique_ptr<Bridge> Bridge::RunHub(const bus::LcmOptions& bus, LinkSocket socket) {
  const auto make = [](const DeploymentIdentity& membership, Carrier& carrier) -> std::unique_ptr<LinkEnd> {
    return std::make_unique<Hub>(membership, bus::RandomSeed(), carrier);
  };
  return std::unique_ptr<Bridge>(new Bridge(std::make_unique<Loop>(bus, std::move(socket), make)));
}

std::unique_ptr<Bridge> Bridge::RunSpoke(const bus::LcmOptions& bus, LinkSocket socket, std::vector<LinkAddress> hub) {
  const auto make = [&hub](const DeploymentIdentity& membership, Carrier& carrier) -> std::unique_ptr<LinkEnd> {
    return std::make_unique<Spoke>(membership, std::move(hub), bus::RandomSeed(), carrier);
  };
  return std::unique_ptr<Bridge>(new Bridge(std::make_unique<Loop>(bus, std::move(socket), make)));
}

}  // namespace legopt::bridge
