#pragma once

#include <cstdint>
#include <optional>

#include "bus/simulated_network.h"
#include "tests/simulation/world.h"

namespace legopt::simulation {

/// Thrown where a process ends in the middle of its work, as by SIGKILL. Nothing catches it but the bus, around
/// handlers; the rest of such a turn is mute (MortalTransport) and changes nothing durable (FaultyStore).
struct ProcessDied {};

/// Whether a process lives. It can die at any fatal point: before each datagram it sends, before and after each commit.
class Life {
 public:
  bool alive() const { return alive_; }
  void Kill() { alive_ = false; }
  /// Dies at the point after `points` more of them.
  void KillAfter(std::uint64_t points) { left_ = points; }
  /// A fatal point is reached; returns whether the process lives on.
  bool Pass() {
    if (left_ && (*left_)-- == 0) alive_ = false;
    return alive_;
  }

 private:
  bool alive_ = true;
  std::optional<std::uint64_t> left_;
};

/// The network as a process sees it: once dead it sends nothing more.
class MortalTransport final : public bus::Transport {
 public:
  MortalTransport(bus::SimulatedNetwork& network, Life& life) : transport_(network), life_(life) {}

  void Send(bus::Port port, std::span<const std::uint8_t> datagram) override {
    if (life_.Pass()) transport_.Send(port, datagram);
  }
  void SetReceiver(bus::DatagramReceiver* receiver, bus::EndpointId self) override {
    transport_.SetReceiver(receiver, self);
  }
  int Poll(std::span<pollfd> extra, microseconds max_wait) override { return transport_.Poll(extra, max_wait); }
  microseconds now() const override { return transport_.now(); }
  std::int64_t deployment() const override { return transport_.deployment(); }
  bus::TransportCounters counters() const override { return transport_.counters(); }

  bus::SimulatedTransport& station() { return transport_; }
  const bus::SimulatedTransport& station() const { return transport_; }

 private:
  bus::SimulatedTransport transport_;
  Life& life_;
};

/// A program that is started, killed, paused and started again, at one place of the network.
class Process : public Party {
 public:
  explicit Process(World& world) : world_(world), transport_(world.network(), life_) { world.Add(*this); }

  void Work() final;
  microseconds due() const final;

  bool up() const { return up_; }
  std::uint64_t lives() const { return lives_; }
  /// SIGKILL now; starts again after `outage`.
  void Kill(microseconds outage);
  /// SIGKILL at a fatal point in the near future.
  void KillAfter(std::uint64_t points, microseconds outage);
  /// SIGSTOP until `time`: it neither receives nor sends, nor looks at a clock.
  void Pause(microseconds time);
  bool paused() const { return world_.now() < paused_until_; }
  /// Cut off from those who have not the same number.
  void SetPartition(int partition) { world_.network().SetPartition(transport_.station(), partition); }

 protected:
  /// Makes the objects of a new life. Returns false when that is not possible now; it is tried again.
  virtual bool Start() = 0;
  virtual void Turn() = 0;
  /// When Turn is due although nothing arrives.
  virtual microseconds next_turn() const = 0;
  /// Drops the objects of the life that has ended.
  virtual void Bury() = 0;
  virtual void OnPause() {}

  World& world() { return world_; }
  const World& world() const { return world_; }
  Life& life() { return life_; }
  MortalTransport& transport() { return transport_; }
  /// Ends this life by itself, as by exit().
  void Exit(microseconds outage) { Kill(outage); }

 private:
  void Die();

  World& world_;
  Life life_;
  MortalTransport transport_;
  bool up_ = false;
  std::uint64_t lives_ = 0;
  microseconds start_at_{0};
  microseconds outage_{0};
  microseconds paused_until_{0};
};

}  // namespace legopt::simulation
