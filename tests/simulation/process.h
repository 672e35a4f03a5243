#pragma once

#include <cstdint>
#include <optional>

#include "tests/doubles/simulated_network.h"
#include "tests/simulation/world.h"

namespace legopt::simulation {

/// Thrown at a point where a process is killed. Only the bus catches it, around handlers; the rest of such a turn
/// sends nothing (MortalTransport) and changes nothing durable (FaultyStore).
struct ProcessDied {};

/// Whether a process is alive. It can die at any fatal point: before each datagram it sends, before and after each
/// commit.
class Life {
 public:
  bool alive() const { return alive_; }
  void Kill() { alive_ = false; }
  /// Dies after `points` more fatal points.
  void KillAfter(std::uint64_t points) { left_ = points; }
  /// Passes a fatal point; returns whether the process is still alive.
  bool Pass() {
    if (left_ && (*left_)-- == 0) alive_ = false;
    return alive_;
  }

 private:
  bool alive_ = true;
  std::optional<std::uint64_t> left_;
};

/// The network interface of a process, which sends nothing after the process's death.
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

/// A program at one node of the network that is started, killed, paused and restarted.
class Process : public Party {
 public:
  explicit Process(World& world) : world_(world), transport_(world.network(), life_) { world.Add(*this); }

  void Work() final;
  microseconds due() const final;

  bool up() const { return up_; }
  std::uint64_t lives() const { return lives_; }
  /// Sends SIGKILL now; restarts after `outage`.
  void Kill(microseconds outage);
  /// Sends SIGKILL at a later fatal point.
  void KillAfter(std::uint64_t points, microseconds outage);
  /// Sends SIGSTOP until `time`: the process neither receives nor sends nor reads a clock.
  void Pause(microseconds time);
  bool paused() const { return world_.now() < paused_until_; }
  /// Disconnects the process from all that have a different number.
  void SetPartition(int partition) { world_.network().SetPartition(transport_.station(), partition); }

 protected:
  /// Creates the objects of a new process. Returns false if that is not possible now; it is retried.
  virtual bool Start() = 0;
  virtual void Turn() = 0;
  /// Time at which Turn is due if nothing arrives.
  virtual microseconds next_turn() const = 0;
  /// Destroys the objects of the ended process.
  virtual void DestroyObjects() = 0;
  virtual void OnPause() {}

  World& world() { return world_; }
  const World& world() const { return world_; }
  Life& life() { return life_; }
  MortalTransport& transport() { return transport_; }
  /// Ends the process by itself, as exit() does.
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
