#include "tests/bus/bridge/joined_hosts.h"

#include <algorithm>

#include "bus/wire.h"

namespace legopt::bridge {
namespace {

constexpr std::int64_t kJoinedDeployment = 4711;

}  // namespace

std::shared_ptr<const bus::MessageKey> BridgeTestKey(std::uint8_t first_byte) {
  std::array<std::uint8_t, bus::MessageKey::kBytes> bytes{};
  bytes[0] = first_byte;
  return std::make_shared<const bus::MessageKey>(bytes);
}

// --- The link --------------------------------------------------------------------------------------------------------

void FaultyWire::Send(LinkAddress from, LinkAddress to, std::span<const std::uint8_t> bytes, microseconds now) {
  const Letter letter{from, to, Bytes(bytes.begin(), bytes.end())};
  recorded_.push_back(letter);
  if (Chance(fault_model_.drop)) return;
  const int copies = Chance(fault_model_.duplicate) ? 2 : 1;
  for (int i = 0; i < copies; ++i) {
    const auto spread = static_cast<std::uint64_t>(fault_model_.max_delay.count()) + 1;
    microseconds delay(static_cast<std::int64_t>(random_() % spread));
    if (Chance(fault_model_.reorder)) delay += fault_model_.reorder_delay;
    under_way_.emplace(now + delay, letter);
  }
}

std::vector<FaultyWire::Letter> FaultyWire::TakeDue(microseconds now) {
  std::vector<Letter> due;
  while (!under_way_.empty() && under_way_.begin()->first <= now) {
    due.push_back(std::move(under_way_.begin()->second));
    under_way_.erase(under_way_.begin());
  }
  return due;
}

std::optional<microseconds> FaultyWire::next() const {
  if (under_way_.empty()) return std::nullopt;
  return under_way_.begin()->first;
}

// --- A host ----------------------------------------------------------------------------------------------------------

Host::Host(FaultyWire& wire, LinkAddress address, std::uint64_t seed, std::shared_ptr<const bus::MessageKey> key)
    : network_(seed), wire_(wire), address_(address), key_(std::move(key)), bus_(network_, kJoinedDeployment, key_) {
  bus_.SetReceiver(this, 0);
}

void Host::BecomeHub(std::uint64_t seed, const HubOptions& options) {
  Carrier& carrier = *this;
  end_ = std::make_unique<Hub>(membership(), seed, carrier, options);
}

void Host::BecomeSpoke(std::vector<LinkAddress> hub, std::uint64_t seed) {
  Carrier& carrier = *this;
  end_ = std::make_unique<Spoke>(membership(), std::move(hub), seed, carrier);
}

void Host::AddParty(bus::EndpointId id, std::uint64_t seed) {
  party_id_ = id;
  party_transport_ = std::make_unique<bus::SimulatedTransport>(network_, kJoinedDeployment, key_);
  party_ = std::make_unique<bus::Endpoint>(*party_transport_, id, seed);
}

void Host::Work(microseconds now) {
  network_.AdvanceTo(now);
  bus_.Poll({}, microseconds(0));
  if (party_) party_->Poll(microseconds(0));
  if (end_) end_->Tick(now);
}

void Host::Take(const FaultyWire::Letter& letter, microseconds now) {
  network_.AdvanceTo(now);
  if (end_) end_->OnLink(letter.from, letter.bytes, now);
}

std::optional<microseconds> Host::next() const {
  std::optional<microseconds> next = network_.next_delivery();
  const auto sooner = [&next](microseconds time) { next = next ? std::min(*next, time) : time; };
  if (party_ && party_->next_timer()) sooner(*party_->next_timer());
  if (end_) sooner(end_->next_deadline());
  return next;
}

void Host::OnDatagram(bus::Port port, std::span<const std::uint8_t> datagram) noexcept {
  if (end_) end_->OnBus(port, datagram, network_.now());
}

void Host::ToBus(bus::Port port, std::span<const std::uint8_t> frame) {
  if (watch_) watch_(*this, port, frame);
  bus_.Send(port, frame);
}

void Host::ToLink(LinkAddress to, std::span<const std::uint8_t> envelope) {
  wire_.Send(address_, to, envelope, network_.now());
}

// --- All -------------------------------------------------------------------------------------------------------------

JoinedHosts::JoinedHosts(int callers, std::uint64_t seed, const std::shared_ptr<const bus::MessageKey>& key)
    : wire_(seed), random_(seed) {
  for (int i = 0; i <= callers; ++i) {
    hosts_.push_back(std::make_unique<Host>(wire_, i == 0 ? kHubAddress : next_address_++, random_(), key));
    Host& host = *hosts_.back();
    host.set_watch(
        [this](const Host& where, bus::Port port, std::span<const std::uint8_t> frame) { Watch(where, port, frame); });
    host.AddParty(i == 0 ? bus::kServer : kFirstCaller + i, random_());
    if (i == 0) {
      StartHub();
    } else {
      host.BecomeSpoke({kHubAddress}, random_());
    }
  }
  server().party().Serve(bus::MessageType::kQuery, [this](bus::Request&& request, bus::Responder responder) {
    ++handled_;
    responder.Reply("<" + request.body + ">");
  });
}

void JoinedHosts::StartHub() { server().BecomeHub(random_()); }

void JoinedHosts::StartSpoke(int i) {
  caller(i).MoveTo(next_address_++);
  caller(i).BecomeSpoke({kHubAddress}, random_());
}

// Records actions of a bridge that PROTOCOL.md, section 14, forbids.
void JoinedHosts::Watch(const Host& host, bus::Port /*port*/, std::span<const std::uint8_t> frame) {
  bus::FrameView view;
  const DeploymentIdentity members = host.membership();
  if (bus::OpenFrame(frame, members.deployment, bus::kAnyDestination, view, members.key) != bus::FrameFault::kNone) {
    first_violation_ = "a frame that is damaged or forged was put on a bus";
    return;
  }
  const auto& header = view.header;
  if (&host == hosts_.front().get()) {
    if (header.destination != bus::kServer || header.sender < kFirstCaller) {
      first_violation_ = "a frame that is not for the server was put on its bus";
    }
    if (!carried_up_.emplace(header.sender, header.nonce).second) first_violation_ = "a frame was carried twice";
  } else if (header.sender != bus::kServer || header.destination != host.party_id()) {
    first_violation_ = "a frame was put on the bus of a host that has no party for it";
  }
}

void JoinedHosts::Step() {
  for (const FaultyWire::Letter& letter : wire_.TakeDue(now_)) {
    for (const auto& host : hosts_) {
      if (host->address() == letter.to) host->Take(letter, now_);
    }
  }
  for (const auto& host : hosts_) host->Work(now_);
  for (const auto& host : hosts_) {
    const auto chosen = host != hosts_.front() && host->bridged() ? host->spoke().connected() : std::nullopt;
    if (chosen && *chosen != kHubAddress) first_violation_ = "a spoke speaks to somebody who is not the hub";
  }
}

bool JoinedHosts::RunUntil(const std::function<bool()>& done, microseconds limit) {
  const microseconds end = now_ + limit;
  while (true) {
    Step();
    if (done()) return true;
    if (now_ >= end) return false;
    std::optional<microseconds> next = wire_.next();
    for (const auto& host : hosts_) {
      const auto due = host->next();
      if (due && (!next || *due < *next)) next = due;
    }
    // Everything due now has been done, so time must advance.
    now_ = std::min(end, std::max(next.value_or(end), now_ + microseconds(1)));
  }
}

std::string JoinedHosts::CallAndWait(int i, const std::string& body, microseconds limit) {
  std::optional<bus::CallResult> result;
  bus::CallOptions options;
  options.timeout = limit;
  caller(i).party().Call(bus::kServer, bus::MessageType::kQuery, body, options,
                         [&](bus::CallResult&& r) { result = std::move(r); });
  RunUntil([&] { return result.has_value(); }, limit + std::chrono::seconds(1));
  return result && result->status == bus::CallResult::kOk ? result->body : "";
}

}  // namespace legopt::bridge
