#include "tests/simulation/nemesis.h"

namespace legopt::simulation {
namespace {

constexpr microseconds kSecond{1'000'000};
constexpr std::uint64_t kMaxPoints = 60;  // maximum number of fatal points until a process dies

}  // namespace

Nemesis::Nemesis(World& world, FaultTargets cast)
    : world_(world), fault_targets_(cast), pace_(world.Within(kSecond / 4, 5 * kSecond)) {
  for (std::uint64_t blow = 0; blow < kNumFaultKinds; ++blow) {
    if (world_.Chance(0.6)) chosen_.push_back(static_cast<Blow>(blow));
  }
}

void Nemesis::Strike(microseconds end) {
  end_ = end;
  ChooseNetworkFaults();
  world_.At(end, [this] { Heal(); });
  Next();
}

void Nemesis::ChooseNetworkFaults() {
  bus::FaultModel weather;
  if (world_.Chance(0.8)) weather = bus::FaultModel::StandardChaos();
  if (world_.Chance(0.3)) weather.corrupt = 0.05;
  if (world_.Chance(0.3)) weather.truncate = 0.02;
  if (world_.Chance(0.2)) weather.duplicate = 0.3;
  if (world_.Chance(0.1)) weather.drop = 0.4;
  if (world_.Chance(0.1)) weather.reorder_delay = 3 * kSecond;
  if (world_.Chance(0.3)) weather.receive_buffer = 100;
  world_.network().set_fault_model(weather);
}

void Nemesis::Next() {
  const microseconds at = world_.now() + world_.Within(pace_ / 4, pace_);
  if (at >= end_ || chosen_.empty()) return;
  world_.At(at, [this] {
    InjectNext(chosen_[world_.Below(chosen_.size())]);
    Next();
  });
}

// Mostly short; sometimes longer than a lease.
microseconds Nemesis::Outage() {
  return world_.Chance(0.8) ? world_.Within(kSecond / 100, 2 * kSecond) : world_.Within(2 * kSecond, 8 * kSecond);
}

void Nemesis::InjectNext(Blow blow) {
  switch (blow) {
    case Blow::kKillWorker:
      return AnyWorker().Kill(Outage());
    case Blow::kKillWorkerSoon:
      return AnyWorker().KillAfter(world_.Below(kMaxPoints), Outage());
    case Blow::kKillClient:
      return AnyClient().Kill(Outage());
    case Blow::kPauseWorker:
      return AnyWorker().Pause(world_.now() + Outage());
    case Blow::kPauseClient:
      return AnyClient().Pause(world_.now() + Outage());
    case Blow::kStopWorker:
      return AnyWorker().Stop();
    case Blow::kPartition: {
      SimulatedWorker& worker = AnyWorker();
      worker.SetPartition(1);
      return world_.After(world_.Within(kSecond, 8 * kSecond), [&worker] { worker.SetPartition(0); });
    }
    default:
      return LandOnServer(blow);
  }
}

void Nemesis::LandOnServer(Blow blow) {
  SimulatedServer& server = fault_targets_.server;
  constexpr microseconds kHour = 3600 * kSecond;
  switch (blow) {
    case Blow::kKillServer:
      return server.Kill(Outage());
    case Blow::kKillServerSoon:
      return server.KillAfter(world_.Below(kMaxPoints), Outage());
    case Blow::kPauseServer:
      return server.Pause(world_.now() + Outage());
    case Blow::kDiskFull:
    case Blow::kDiskFails:
      server.faults().writes = blow == Blow::kDiskFull ? db::StoreErrorCode::kFull : db::StoreErrorCode::kIo;
      return world_.After(Outage(), [&server] { server.faults().writes.reset(); });
    case Blow::kReadingFails:
      server.faults().reads = true;
      return world_.After(Outage(), [&server] { server.faults().reads = false; });
    default:  // an hour or a day, forwards or backwards
      return server.StepWallClock((world_.Chance(0.5) ? kHour : 24 * kHour) * (world_.Chance(0.5) ? 1 : -1));
  }
}

void Nemesis::Heal() {
  world_.network().set_fault_model({});
  fault_targets_.server.faults() = {};
  for (auto& worker : fault_targets_.workers) worker->SetPartition(0);
}

}  // namespace legopt::simulation
