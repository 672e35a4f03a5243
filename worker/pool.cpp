#include "worker/pool.h"

#include <algorithm>
#include <cstdlib>
#include <utility>

#include "app/exit_codes.h"
#include "legopt/types/number_text.h"
#include "legopt/types/reply.h"
#include "worker/child_process.h"
#include "worker/job_executor.h"

namespace legopt::worker {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr microseconds kFirstHelloRetry = milliseconds(100);
constexpr microseconds kLastHelloRetry = seconds(2);
constexpr microseconds kLeaseRetry = milliseconds(250);  // delay after a lost or malformed reply
constexpr microseconds kSoonestAsk = milliseconds(5);
constexpr microseconds kLatestAsk = seconds(10);
constexpr microseconds kDefaultLease = seconds(10);
constexpr microseconds kDefaultHeartbeat = seconds(1);
constexpr microseconds kSilence = seconds(3);  // time without an answer until the user is informed
constexpr microseconds kSilenceRepeat = seconds(30);
constexpr std::size_t kMaxMethods = 1024;
constexpr std::size_t kMaxLeases = 4096;            // limit of one heartbeat
constexpr std::size_t kMaxUndeliveredPerSlot = 64;  // maximum with which new leases are requested
constexpr double kShortJob_us = 500'000;            // jobs shorter than this always have one prefetched lease
constexpr double kAnswersAhead = 4;  // server response times to prefetch for; refilled when half of it is left
constexpr int kStopMarginDivisor = 10;

}  // namespace

std::string Pool::Seconds(microseconds duration) {
  return FormatFixed(std::chrono::duration<double>(duration).count(), 1) + " s";
}

Pool::Pool(PoolOptions options, microseconds now)
    : options_(std::move(options)),
      random_(static_cast<std::minstd_rand::result_type>(options_.seed)),
      last_heard_(now) {
  if (options_.slots < 1) std::abort();
  for (int i = 0; i < options_.slots; ++i) slots_.push_back({JobSlot(options_.slot_times), {}});
  Advance(now);
}

// --- Time ------------------------------------------------------------------------------------------------------------

void Pool::Tick(microseconds now) { Advance(now); }

void Pool::Advance(microseconds now) {
  if (finished_) return;
  AdvanceSlots(now);
  EndDrain(now);
  ExpireLeases(now);
  AskForRegistration(now);
  AskForMethods(now);
  Dispatch(now);
  ReleaseWaiting(now);
  AskForLeases(now);
  SendHeartbeat(now);
  DeliverResults(now);
  CheckEnd(now);
}

microseconds Pool::next_deadline() const {
  microseconds next = microseconds::max();
  if (finished_) return next;
  const auto at = [&next](microseconds time) { next = std::min(next, time); };
  for (const SlotEntry& slot : slots_) at(slot.machine.deadline());
  if (!registration_ && !hello_in_flight_) at(next_hello_);
  if (registration_ && !heartbeat_in_flight_) at(next_heartbeat_);
  if (!capabilities_.empty()) {
    if (registration_ && !lease_in_flight_ && NumWantedLeases() > 0) at(next_lease_);
    if (options_.wait_server != microseconds::max()) at(last_heard_ + options_.wait_server);
  }
  const bool delivering = CanDeliver();
  for (const auto& [key, held] : leases_) {
    if (held.phase != Phase::kDelivering) at(held.expires);
    if (held.phase == Phase::kDelivering && !held.in_flight && delivering) at(held.next_delivery);
  }
  for (const auto& [hash, method] : methods_) {
    if (!method.options_json && !method.in_flight) at(method.next_try);
  }
  if (const auto end = WaitEnd()) at(*end);
  at(IdleEnd());
  if (draining_) at(leases_.empty() ? LeaseAnswerEnd() : DeliveryEnd());
  if (draining_ && !jobs_released_) at(drain_end_);
  return next;
}

std::vector<Action> Pool::TakeActions() { return std::exchange(actions_, {}); }

void Pool::Log(LogLevel level, std::string text) { actions_.emplace_back(LogLine{level, std::move(text)}); }

// --- Registration ----------------------------------------------------------------------------------------------------

// Also sent before the datasets are loaded, so that users see that a worker is starting, and again after loading.
void Pool::AskForRegistration(microseconds now) {
  if (registration_ || hello_in_flight_ || now < next_hello_) return;
  legopt_msg::hello_request request;
  request.protocol_version = options_.protocol_version;
  request.worker_name = options_.name;
  request.hostname = options_.hostname;
  request.pid = options_.pid;
  request.slots = options_.slots;
  request.build = options_.build;
  request.build_id = options_.build_id;
  request.processor = options_.processor;
  request.processors = options_.processors;
  request.memory_bytes = options_.memory_bytes;
  request.load = options_.load();
  for (const Capability& capability : capabilities_) request.capabilities.push_back(ToMessage(capability));
  if (options_.fetch_datasets && has_loaded()) {
    request.capabilities.push_back(ToMessage({{}, {}, CapabilityKind::kFetch}));
    for (const std::string& hash : options_.unfetched) {
      request.capabilities.push_back(ToMessage({{}, hash, CapabilityKind::kUnfetched}));
    }
  }
  hello_in_flight_ = true;
  announced_ = capabilities_.size();
  actions_.emplace_back(CallHello{std::move(request)});
}

void Pool::OnHelloReply(microseconds now, const legopt_msg::hello_reply* reply, const std::string& error) {
  hello_in_flight_ = false;
  if (reply == nullptr) {
    hello_backoff_ = std::clamp(hello_backoff_ * 2, kFirstHelloRetry, kLastHelloRetry);
    next_hello_ = now + hello_backoff_;
    ServerSilent(now, error);
    Advance(now);
    return;
  }
  HeardServer(now);
  switch (HelloStatus{reply->status}) {
    case HelloStatus::kOk: {
      hello_backoff_ = microseconds(0);
      Registration registration;
      registration.worker_id = reply->worker_id;
      registration.server_instance = reply->server_instance;
      registration.lease = reply->lease_us > 0 ? microseconds(reply->lease_us) : kDefaultLease;
      registration.heartbeat = reply->heartbeat_us > 0 ? microseconds(reply->heartbeat_us) : kDefaultHeartbeat;
      registration_ = registration;
      next_lease_ = now;
      next_heartbeat_ = leases_.empty() ? now + registration.heartbeat : now;  // renew held leases immediately
      for (auto& [key, held] : leases_) held.next_delivery = now;
      if (capabilities_.empty()) break;
      if (announced_ != capabilities_.size()) {  // loaded while the call was in flight
        registration_.reset();
        next_hello_ = now;
        break;
      }
      Log(LogLevel::kInfo, "registered as worker " + std::to_string(reply->worker_id) + " with " +
                               std::to_string(options_.slots) + " slot(s)");
      LogOnce(reply->message);
      break;
    }
    case HelloStatus::kDatasetMismatch:
      Log(LogLevel::kError, MismatchText(reply->message));
      Drain(now, ExitCode::kDatasetMismatch);
      next_hello_ = microseconds::max();
      break;
    case HelloStatus::kVersionRefused:
      Log(LogLevel::kError, "the server refuses this worker: " + PrintableText(reply->message, kMaxMessageBytes) +
                                "; run server and workers of the same release");
      Finish(ExitCode::kUsage);
  }
  Advance(now);
}

std::string Pool::MismatchText(const std::string& server_message) const {
  std::string text = "dataset mismatch: " + PrintableText(server_message, kMaxMessageBytes) + ". This worker has";
  const char* separator = " ";
  for (const Capability& dataset : capabilities_) {
    if (dataset.kind != CapabilityKind::kDataset) continue;
    text += separator + dataset.name + " " + dataset.hash;
    separator = ", ";
  }
  return text +
         ". Give the worker the same files as the client that submitted (--dataset DIR), or submit again with the "
         "files that the workers have";
}

void Pool::ForgetRegistration(microseconds now, const std::string& why) {
  if (!registration_) return;
  Log(LogLevel::kInfo, why + "; registering again");
  registration_.reset();
  next_hello_ = now;
}

void Pool::HeardServer(microseconds now) {
  last_heard_ = now;
  if (silence_reported_) Log(LogLevel::kWarning, "the server answers");
  silence_reported_ = false;
}

void Pool::ServerSilent(microseconds now, const std::string& error) {
  if (now - last_heard_ < kSilence || (silence_reported_ && now < next_silence_report_)) return;
  silence_reported_ = true;
  next_silence_report_ = now + kSilenceRepeat;
  Log(LogLevel::kWarning, "no answer from a server at " + options_.server_address + " for " +
                              Seconds(now - last_heard_) + " (" + error + CausesOfSilence() + "); trying on");
}

// A server with another key silently drops this worker's frames: an answer would reveal that it exists.
std::string Pool::CausesOfSilence() const {
  if (options_.key_file.empty()) return "";
  return "; a server that has another key than " + options_.key_file + " does not answer either";
}

// --- Leases ----------------------------------------------------------------------------------------------------------

// Long jobs take seconds to minutes, regardless of previous durations. They are not prefetched, because another worker
// could start them.
bool Pool::HoldsLongJob() const {
  return std::any_of(leases_.begin(), leases_.end(), [](const auto& entry) {
    return entry.second.phase != Phase::kDelivering && DescriptionOf(entry.second.task).long_jobs;
  });
}

int Pool::NumAheadPerSlot() const {
  if (mean_job_us_ < 0 || mean_job_us_ >= kShortJob_us || HoldsLongJob()) return 0;
  const double work_us = std::clamp(kAnswersAhead * mean_answer_us_, static_cast<double>(options_.prefetch.count()),
                                    static_cast<double>(options_.longest_prefetch.count()));
  const double jobs = work_us / std::max(mean_job_us_, 1.0);
  return std::clamp(static_cast<int>(std::min<double>(jobs, options_.max_prefetch_per_slot)), 1,
                    options_.max_prefetch_per_slot);
}

int Pool::NumWantedLeases() const {
  if (draining_ || num_undelivered() > kMaxUndeliveredPerSlot * slots_.size()) return 0;
  int idle = 0;
  int live = 0;
  for (const SlotEntry& slot : slots_) {
    const JobSlot::State state = slot.machine.state();
    idle += state == JobSlot::State::kIdle ? 1 : 0;
    live += state == JobSlot::State::kIdle || state == JobSlot::State::kRunning ? 1 : 0;
  }
  const int ahead = NumAheadPerSlot();
  const int ready = static_cast<int>(ready_.size());
  const int wanted = idle + ahead * live - ready;
  // Avoids small requests while enough leases are prefetched.
  if (ready >= idle && 2 * ready > ahead * live) return 0;
  const int room = static_cast<int>(kMaxLeases - std::min(kMaxLeases, leases_.size()));
  constexpr int kMaxPerRequest = 1024;
  return std::clamp(wanted, 0, std::min(room, kMaxPerRequest));
}

void Pool::AskForLeases(microseconds now) {
  if (!registration_ || capabilities_.empty() || lease_in_flight_ || now < next_lease_) return;
  const int wanted = NumWantedLeases();
  if (wanted <= 0) return;
  legopt_msg::lease_request request{};
  request.worker_id = registration_->worker_id;
  request.server_instance = registration_->server_instance;
  request.max_jobs = wanted;
  lease_in_flight_ = true;
  lease_asked_at_ = now;
  actions_.emplace_back(CallLease{std::move(request)});
}

void Pool::OnLeaseReply(microseconds now, const legopt_msg::lease_reply* reply, const std::string& error) {
  lease_in_flight_ = false;
  if (reply == nullptr) {
    next_lease_ = now + kLeaseRetry;
    ServerSilent(now, error);
    Advance(now);
    return;
  }
  HeardServer(now);
  no_more_work_ = false;
  wanted_dataset_ = options_.fetch_datasets ? reply->wanted_dataset : std::string();
  const microseconds retry = Jittered(std::clamp(microseconds(reply->retry_after_us), kSoonestAsk, kLatestAsk));
  switch (LeaseStatus{reply->status}) {
    case LeaseStatus::kLeased:
      mean_answer_us_ += kAverageWeight * (static_cast<double>((now - lease_asked_at_).count()) - mean_answer_us_);
      for (const legopt_msg::lease& lease : reply->jobs) AcceptLease(now, lease);
      next_lease_ = now;
      break;
    case LeaseStatus::kNoneNow:
      LogOnce(reply->message);
      next_lease_ = now + retry;
      break;
    case LeaseStatus::kUnknownWorker:
      ForgetRegistration(now, "the server does not know this worker");
      break;
    case LeaseStatus::kDatasetMismatch:
      Log(LogLevel::kError, MismatchText(reply->message));
      Drain(now, ExitCode::kDatasetMismatch);
      break;
    case LeaseStatus::kNoMoreWork:
      no_more_work_ = true;
      next_lease_ = now + retry;
  }
  Advance(now);
}

// Adds at most a quarter, so that workers with the same interval do not all ask at once.
microseconds Pool::Jittered(microseconds duration) {
  constexpr double kMaxJitter = 0.25;
  const double unit = std::generate_canonical<double, 16>(random_);
  return duration + microseconds(static_cast<std::int64_t>(kMaxJitter * unit * static_cast<double>(duration.count())));
}

// Logs a message of the server once, e.g. that no job needs the datasets of this worker.
void Pool::LogOnce(const std::string& server_message) {
  if (server_message.empty() || server_message == last_logged_message_) return;
  last_logged_message_ = server_message;
  Log(LogLevel::kWarning, PrintableText(server_message, kMaxMessageBytes));
}

microseconds Pool::StopMargin(const legopt_msg::lease& lease) const {
  return microseconds(lease.lease_us / kStopMarginDivisor) + options_.slot_times.cancel_grace;
}

void Pool::AcceptLease(microseconds now, const legopt_msg::lease& lease) {
  const LeaseKey key{lease.job_id, lease.attempt, lease.token};
  HeldLease held;
  held.lease = lease;
  held.accepted = now;
  held.expires = lease_asked_at_ + microseconds(lease.lease_us) - StopMargin(lease);
  if (!leases_.emplace(key, std::move(held)).second) return;  // repeated lease
  ready_.push_back(key);
  if (!HasDataset(lease.dataset_hash)) {
    return RefuseLease(now, key, "this worker does not have dataset " + lease.dataset_hash);
  }
  if (draining_) return StopLease(now, key, StopReason::kShutdown);  // the reply to a request made before draining
  const std::optional<Task> task = ParseEnum<Task>(lease.task);
  if (!task) return RefuseLease(now, key, "this worker does not know the task '" + lease.task + "'");
  leases_.at(key).task = *task;
  methods_.try_emplace(lease.method_hash);
}

bool Pool::HasDataset(const std::string& hash) const {
  return std::any_of(capabilities_.begin(), capabilities_.end(), [&](const Capability& capability) {
    return capability.kind == CapabilityKind::kDataset && capability.hash == hash;
  });
}

void Pool::ExpireLeases(microseconds now) {
  std::vector<LeaseKey> expired;
  for (const auto& [key, held] : leases_) {
    if (held.phase != Phase::kDelivering && now >= held.expires) expired.push_back(key);
  }
  for (const LeaseKey& key : expired) {
    // Stopped only once: from here on the slot has its own deadline.
    leases_.at(key).expires = microseconds::max();
    Log(LogLevel::kWarning, "job " + std::to_string(key.job_id) + ": lease not renewed in time, stopping the job");
    StopLease(now, key, StopReason::kLeaseExpiring);
  }
}

void Pool::AskForMethods(microseconds now) {
  if (methods_.size() > kMaxMethods) {
    std::erase_if(methods_, [](const auto& entry) { return entry.second.options_json.use_count() == 1; });
    for (const LeaseKey& key : ready_) methods_.try_emplace(leases_.at(key).lease.method_hash);
  }
  for (auto& [hash, method] : methods_) {
    if (method.options_json || method.in_flight || now < method.next_try) continue;
    method.in_flight = true;
    legopt_msg::method_request request;
    request.hash = hash;
    actions_.emplace_back(CallMethod{std::move(request)});
  }
}

void Pool::OnMethodReply(microseconds now, const std::string& hash, const legopt_msg::method_reply* reply,
                         const std::string& error) {
  const auto it = methods_.find(hash);
  if (it != methods_.end()) {
    MethodEntry& method = it->second;
    method.in_flight = false;
    if (reply == nullptr) {
      method.backoff = std::clamp(method.backoff * 2, kFirstHelloRetry, kLastHelloRetry);
      method.next_try = now + method.backoff;
      ServerSilent(now, error);
    } else if (MethodStatus{reply->status} == MethodStatus::kFound) {
      HeardServer(now);
      method.options_json = std::make_shared<const std::string>(reply->options_json);
    } else {
      HeardServer(now);
      methods_.erase(it);
      const std::deque<LeaseKey> waiting = ready_;
      for (const LeaseKey& key : waiting) {
        if (leases_.at(key).lease.method_hash == hash) FailLease(now, key, "the server does not know method " + hash);
      }
    }
  }
  Advance(now);
}

// --- Heartbeats ------------------------------------------------------------------------------------------------------

void Pool::SendHeartbeat(microseconds now) {
  if (!registration_ || heartbeat_in_flight_ || now < next_heartbeat_) return;
  legopt_msg::heartbeat_request request{};
  request.load = options_.load();
  request.worker_id = registration_->worker_id;
  request.server_instance = registration_->server_instance;
  heartbeat_keys_.clear();
  for (const auto& [key, held] : leases_) {
    legopt_msg::lease_state state{};
    state.job_id = key.job_id;
    state.attempt = key.attempt;
    state.token = key.token;
    state.progress_done = held.progress_done;
    state.progress_total = held.progress_total;
    request.leases.push_back(state);
    heartbeat_keys_.push_back(key);
  }
  heartbeat_in_flight_ = true;
  heartbeat_sent_at_ = now;
  next_heartbeat_ = now + registration_->heartbeat;
  actions_.emplace_back(CallHeartbeat{std::move(request)});
}

void Pool::OnHeartbeatReply(microseconds now, const legopt_msg::heartbeat_reply* reply, const std::string& error) {
  heartbeat_in_flight_ = false;
  if (reply == nullptr) {
    ServerSilent(now, error);
  } else if (HeardServer(now); !registration_ || HeartbeatStatus{reply->status} == HeartbeatStatus::kUnknownWorker ||
                               reply->server_instance != registration_->server_instance) {
    ForgetRegistration(now, "the server has restarted");
  } else if (reply->verdicts.size() == heartbeat_keys_.size()) {
    if (HeartbeatStatus{reply->status} == HeartbeatStatus::kDrain) DrainForServer(now);
    for (std::size_t i = 0; i < heartbeat_keys_.size(); ++i) {
      const auto it = leases_.find(heartbeat_keys_[i]);
      if (it == leases_.end() || it->second.phase == Phase::kDelivering) continue;  // the answer to the result decides
      HeldLease& held = it->second;
      const LeaseVerdict verdict{reply->verdicts[i]};
      if (verdict == LeaseVerdict::kContinue) {
        const microseconds renewed = heartbeat_sent_at_ + microseconds(held.lease.lease_us) - StopMargin(held.lease);
        if (held.expires != microseconds::max()) held.expires = std::max(held.expires, renewed);
        continue;
      }
      const bool cancelled = verdict == LeaseVerdict::kCancel;
      Log(LogLevel::kInfo, "job " + std::to_string(it->first.job_id) +
                               (cancelled ? ": cancelled" : ": the server has withdrawn the lease"));
      StopLease(now, heartbeat_keys_[i], cancelled ? StopReason::kCancelled : StopReason::kUnknownLease);
    }
  }
  Advance(now);
}

microseconds Pool::heartbeat_interval() const { return registration_ ? registration_->heartbeat : kDefaultHeartbeat; }

microseconds Pool::lease_call_timeout() const { return (registration_ ? registration_->lease : kDefaultLease) / 2; }

}  // namespace legopt::worker
