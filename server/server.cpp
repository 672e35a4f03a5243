#include "server/server.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <chrono>

#include "bus/codec.h"
#include "legopt/input/json.h"
#include "legopt/types/reply.h"
#include "server/permission.h"
#include "server/status.h"

namespace legopt::server {
namespace {

constexpr std::size_t kMaxOpsPerCommit = 20'000;

template <class Message>
std::string EncodeReply(Message message) {
  return bus::Encode(std::move(message));
}

}  // namespace

Server::Server(bus::Endpoint& endpoint, db::Store& store, QueryService* queries, ServerOptions options,
               WallClock wall_clock, Scheduler::TokenSource tokens)
    : endpoint_(endpoint),
      store_(store),
      queries_(queries),
      options_(std::move(options)),
      wall_clock_(std::move(wall_clock)),
      scheduler_(options_.scheduler, store.LoadOpenState(), std::move(tokens),
                 {[&store](std::int64_t job_id, int attempt) { return store.FindAttempt(job_id, attempt); },
                  [&store](const std::string& hash) { return store.FindMethodOptions(hash); },
                  [&store](std::int64_t id) { return store.LoadExperiment(id); },
                  [&store](const db::ResultSearch& search) { return store.FindKnownResults(search); },
                  options_.disk_space, [this](const std::string& hash) { return OffersDataset(hash); }},
                 Instant{endpoint.now(), wall_clock_()}),
      started_(endpoint.now()),
      last_commit_(endpoint.now() - options_.commit_interval),
      watch_(options_.conditions, options_.disk_space) {
  ops_.emplace_back(db::RecordEvent{"server_started", wall_clock_(), {}, {}, {}, options_.version});
  for (const auto& [id, experiment] : scheduler_.experiments()) {
    if (experiment.state == db::ExperimentState::kActive) health_.Begin(id, Counters());
  }
  RegisterHandlers();
}

Server::~Server() {
  for (std::int16_t type = 1; type <= bus::kLastMessageType; ++type) {
    endpoint_.Serve(static_cast<bus::MessageType>(type), {});
  }
}

microseconds Server::Stopwatch() const { return options_.stopwatch ? options_.stopwatch() : microseconds(0); }
Instant Server::Now() const { return {endpoint_.now(), wall_clock_()}; }

// --- Handlers --------------------------------------------------------------------------------------------------------

template <class Message, class Handler>
void Server::Serve(bus::MessageType type, bool always, Handler handler) {
  endpoint_.Serve(type, [this, type, always, handler](bus::Request&& request, bus::Responder responder) {
    RequestCount& served = requests_.at(static_cast<std::size_t>(type));
    ++served.requests;
    served.bytes += request.body.size();
    std::string why;
    std::optional<Message> message = bus::Decode<Message>(request.body, &why);
    if (!message) {
      responder.Reject(bus::ErrorCode::kMalformed, why);
      return;
    }
    if (const std::string refusal = RefusalOf(request.role, *message); !refusal.empty()) {
      responder.Reject(bus::ErrorCode::kRoleRefused, refusal);
      return;
    }
    if (always || store_healthy()) {
      try {
        handler(request.sender, *message, responder);
        return;
      } catch (const db::StoreError& error) {
        // Handlers read before they change any state, so this one can be run again.
        if (!error.transient()) throw;
        StoreFailed(error);
      }
    }
    // Beyond the limit, requests stay unanswered: the callers retry after a timeout.
    const std::size_t bytes = request.body.size();
    if (deferred_.size() >= options_.max_deferred || deferred_bytes_ + bytes > options_.max_deferred_bytes) return;
    deferred_bytes_ += bytes;
    deferred_.push_back({[handler, sender = request.sender, kept = std::move(*message), responder] {
                           handler(sender, kept, responder);
                         },
                         responder, bytes});
  });
}

void Server::RegisterHandlers() {
  using bus::MessageType;
  using Sender = bus::EndpointId;
  Serve<legopt_msg::hello_request>(MessageType::kHello, false,
                                   [this](Sender sender, const auto& request, auto responder) {
                                     spdlog::info("hello from worker '{}' on {} with {} slot(s)", request.worker_name,
                                                  request.hostname, request.slots);
                                     Later(responder, EncodeReply(scheduler_.Hello(Now(), sender, request, ops_)));
                                   });
  Serve<legopt_msg::result_request>(MessageType::kResult, false, [this](Sender, const auto& request, auto responder) {
    Later(responder, EncodeReply(scheduler_.Result(Now(), request, ops_)));
  });
  Serve<legopt_msg::submit_request>(MessageType::kSubmit, false, [this](Sender, const auto& request, auto responder) {
    const std::size_t first = ops_.size();
    const auto reply = scheduler_.Submit(Now(), request, ops_);
    StoreDatasets(first);
    spdlog::info("submission {}: status {}, experiment {}, {} jobs {}", request.submission_id, reply.status,
                 reply.experiment_id, reply.num_jobs, reply.message);
    Later(responder, EncodeReply(reply));
  });
  Serve<legopt_msg::cancel_request>(MessageType::kCancel, false, [this](Sender, const auto& request, auto responder) {
    Later(responder, EncodeReply(scheduler_.Cancel(Now(), request, ops_)));
  });
  Serve<legopt_msg::control_request>(MessageType::kControl, false, [this](Sender, const auto& request, auto responder) {
    Later(responder, EncodeReply(scheduler_.Control(Now(), request, ops_)));
  });
  // Heartbeats renew leases in memory only: they must work while the disk does not.
  Serve<legopt_msg::heartbeat_request>(MessageType::kHeartbeat, true,
                                       [this](Sender sender, const auto& request, auto responder) {
                                         responder.Reply(EncodeReply(scheduler_.Heartbeat(Now(), sender, request)));
                                       });
  Serve<legopt_msg::method_request>(MessageType::kMethod, true, [this](Sender, const auto& request, auto responder) {
    const auto options = store_.FindMethodOptions(request.hash);
    legopt_msg::method_reply reply{};
    reply.status = EnumNumber(options ? MethodStatus::kFound : MethodStatus::kUnknown);
    reply.options_json = options.value_or("");
    responder.Reply(EncodeReply(reply));
  });
  Serve<legopt_msg::dataset_request>(MessageType::kDataset, true, [this](Sender, const auto& request, auto responder) {
    responder.Reply(EncodeReply(ReadDatasetChunk(request)));
  });
  // Never deferred: archives that wait for the store would fill the memory, so they are refused instead.
  Serve<legopt_msg::store_dataset_request>(
      MessageType::kStoreDataset, true,
      [this](Sender, const auto& request, auto responder) { TakeDataset(request, responder); });
  Serve<legopt_msg::shutdown_request>(MessageType::kShutdown, true, [this](Sender, const auto&, auto responder) {
    spdlog::info("shutdown requested");
    shutdown_requested_ = true;
    Drain();
    responder.Reply(EncodeReply(legopt_msg::shutdown_reply{}));  // no commit needed: the reply makes no promise about
                                                                 // stored data
  });
  ServeProbe();
  ServeLease();
  ServeStatus();
  ServeQuery();
}

void Server::ServeProbe() {
  Serve<legopt_msg::probe_request>(
      bus::MessageType::kProbe, true, [this](bus::EndpointId sender, const auto& request, auto responder) {
        // This server's own probe for rivals must stay unanswered.
        if (sender == bus::kServer && request.nonce == options_.scheduler.server_instance) return;
        responder.Reply(EncodeReply(ProbeReply(options_, endpoint_.now() - started_, wall_clock_())));
      });
}

void Server::ServeLease() {
  Serve<legopt_msg::lease_request>(
      bus::MessageType::kLease, true, [this](bus::EndpointId sender, const auto& request, auto responder) {
        if (store_healthy()) {
          Later(responder, EncodeReply(scheduler_.Lease(Now(), sender, request, ops_)));
          return;
        }
        legopt_msg::lease_reply reply{};
        reply.status = EnumNumber(LeaseStatus::kNoneNow);
        reply.retry_after_us = options_.max_store_retry.count();
        reply.message = "no job is leased while the database cannot be written: " + store_error_;
        responder.Reply(EncodeReply(reply));
      });
}

void Server::ServeStatus() {
  Serve<legopt_msg::status_request>(
      bus::MessageType::kStatus, true, [this](bus::EndpointId, const auto& request, auto responder) {
        CommitNow();
        nlohmann::json status = StatusJson(scheduler_, request.experiment_id, Now(), store_error_);
        nlohmann::json transport = nlohmann::json::object();
        for (const auto& [name, value] : endpoint_.counters().Listing()) transport[std::string(name)] = value;
        status["server"]["transport"] = std::move(transport);
        status["server"]["requests"] = RequestsJson();
        status["server"].update(Figures());
        legopt_msg::status_reply reply{};
        reply.json = Dump(status);
        responder.Reply(EncodeReply(reply));
      });
}

void Server::ServeQuery() {
  Serve<legopt_msg::query_request>(
      bus::MessageType::kQuery, true, [this](bus::EndpointId sender, const auto& request, auto responder) {
        CommitNow();
        const std::int64_t ticket = next_query_++;
        const std::string refusal =
            queries_ == nullptr ? "this server has no database file" : queries_->Start(ticket, sender, request);
        if (refusal.empty()) {
          open_queries_.emplace(ticket, responder);
          return;
        }
        legopt_msg::query_reply reply{};
        reply.status = EnumNumber(QueryStatus::kRefused);
        reply.message = refusal;
        responder.Reply(EncodeReply(reply));
      });
}

void Server::FinishQueries() {
  if (queries_ == nullptr || open_queries_.empty()) return;
  for (QueryService::Finished& finished : queries_->TakeFinished()) {
    const auto open = open_queries_.find(finished.ticket);
    if (open == open_queries_.end()) continue;
    open->second.Reply(EncodeReply(std::move(finished.reply)));
    open_queries_.erase(open);
  }
}

void Server::Later(bus::Responder responder, std::string body) {
  replies_.push_back({std::move(responder), std::move(body)});
}

void Server::Drain() {
  if (draining_) return;
  draining_ = true;
  scheduler_.set_draining(true);
  next_place_check_ = endpoint_.now();
  ops_.emplace_back(db::RecordEvent{"server_stopping", wall_clock_(), {}, {}, {}, {}});
}

void Server::RequeueRunningJobs(const std::string& why) { scheduler_.RequeueAllRunning(Now(), why, ops_); }

// --- Rounds ----------------------------------------------------------------------------------------------------------

microseconds Server::WaitTime(microseconds max_wait) const {
  const microseconds now = endpoint_.now();
  microseconds wait = max_wait;
  if (!store_healthy()) return std::clamp(store_retry_at_ - now, microseconds(0), wait);
  if (!ops_.empty() || !replies_.empty()) {
    if (CommitDue()) return microseconds(0);
    wait = std::min(wait, last_commit_ + options_.commit_interval - now);
  }
  if (const auto deadline = scheduler_.next_deadline()) wait = std::min(wait, *deadline - now);
  if (!tidy_) wait = std::min(wait, last_commit_ + options_.idle_checkpoint - now);
  return std::max(wait, microseconds(0));
}

void Server::Round(microseconds max_wait, std::span<const pollfd> extra) {
  std::vector<pollfd> descriptors(extra.begin(), extra.end());
  if (queries_ != nullptr) descriptors.push_back({queries_->descriptor(), POLLIN, 0});
  endpoint_.PollWith(descriptors, WaitTime(max_wait));
  Work();
}

void Server::Work() {
  FinishQueries();
  CheckPlace();
  if (store_healthy()) {
    scheduler_.Tick(Now(), ops_);
    watch_.Look(scheduler_, Now(), store_error_, ops_);
    CommitRound();
  } else if (endpoint_.now() >= store_retry_at_) {
    Commit();
    if (store_healthy()) ResumeDeferred();
  }
  if (store_healthy() && !tidy_ && endpoint_.now() >= last_commit_ + options_.idle_checkpoint) {
    tidy_ = true;
    try {
      store_.Idle();
    } catch (const db::StoreError& error) {
      // No data is lost: the log is only longer than necessary.
      spdlog::warn("checkpoint: {}", error.what());
    }
  }
}

bool Server::CommitDue() const {
  return draining_ || replies_.size() >= options_.commit_batch ||
         endpoint_.now() >= last_commit_ + options_.commit_interval;
}

void Server::CommitRound() {
  if (!ops_.empty()) {
    if (CommitDue()) Commit();
  } else {
    for (Pending& pending : replies_) pending.responder.Reply(std::move(pending.body));
    replies_.clear();
  }
}

void Server::CommitNow() {
  if (store_healthy() && !ops_.empty()) Commit();
}

void Server::Commit() {
  if (watched_ops_ < ops_.size())
    health_.Watch(
        watched_ops_, [this] { return Counters(); }, wall_clock_(), ops_);
  watched_ops_ = ops_.size();
  const microseconds begin = Stopwatch();
  try {
    store_.Apply(ops_);
  } catch (const db::StoreError& error) {
    if (!error.transient()) throw;
    StoreFailed(error);
    return;
  }
  if (!store_healthy()) spdlog::warn("the database can be used again");
  const auto took = Stopwatch() - begin;
  ++commits_.count;
  commits_.total += took;
  commits_.longest = std::max(commits_.longest, took);
  store_error_.clear();
  PublishEvents();
  OfferStoredDatasets();
  ops_.clear();
  watched_ops_ = 0;
  if (ops_.capacity() > kMaxOpsPerCommit) ops_.shrink_to_fit();
  last_commit_ = endpoint_.now();
  tidy_ = false;
  for (Pending& pending : replies_) pending.responder.Reply(std::move(pending.body));
  replies_.clear();
}

void Server::PublishEvents() const {
  if (!options_.on_event) return;
  for (const db::StoreOp& op : ops_) {
    if (const auto* event = std::get_if<db::RecordEvent>(&op)) options_.on_event(*event);
  }
}

// Process metrics for monitoring.
nlohmann::json Server::Figures() const {
  const auto seconds = [](microseconds duration) { return std::chrono::duration<double>(duration).count(); };
  nlohmann::json figures = {{"uptime_s", seconds(endpoint_.now() - started_)},
                            {"commits", commits_.count},
                            {"commit_s", seconds(commits_.total)},
                            {"longest_commit_s", seconds(commits_.longest)},
                            {"disk_low", watch_.disk_is_low()},
                            {"disk_free_bytes", nullptr},
                            {"disk_bytes", nullptr}};
  if (watch_.disk()) {
    figures["disk_free_bytes"] = watch_.disk()->free_bytes;
    figures["disk_bytes"] = watch_.disk()->total_bytes;
  }
  return figures;
}

nlohmann::json Server::RequestsJson() const {
  nlohmann::json by_type = nlohmann::json::object();
  for (std::int16_t type = 1; type <= bus::kLastMessageType; ++type) {
    const RequestCount& served = requests_.at(static_cast<std::size_t>(type));
    by_type[std::string(bus::ToString(static_cast<bus::MessageType>(type)))] = {{"requests", served.requests},
                                                                                {"bytes", served.bytes}};
  }
  return by_type;
}

TransportHealth::Listing Server::Counters() const {
  TransportHealth::Listing counters = endpoint_.counters().Listing();
  const TransportHealth::Listing decisions = scheduler_.counters().Listing();
  counters.insert(counters.end(), decisions.begin(), decisions.end());
  return counters;
}

// Detects a moved database even without messages, while its data can still be rescued.
void Server::CheckPlace() {
  if (!store_healthy() || endpoint_.now() < next_place_check_) return;
  next_place_check_ = endpoint_.now() + options_.place_check;
  try {
    store_.CheckPlace();
  } catch (const db::StoreError& error) {
    if (!error.transient()) throw;
    StoreFailed(error);
  }
}

void Server::StoreFailed(const db::StoreError& error) {
  if (store_error_ != error.what()) {
    spdlog::error("the database cannot be used, nothing is leased or acknowledged: {}", error.what());
  }
  if (store_healthy()) {
    store_retry_after_ = options_.first_store_retry;
  } else {
    store_retry_after_ = std::min(2 * store_retry_after_, options_.max_store_retry);
  }
  store_error_ = error.what();
  store_retry_at_ = endpoint_.now() + store_retry_after_;
}

// Handles deferred requests in order of arrival; their operations are committed in the next round.
void Server::ResumeDeferred() {
  while (store_healthy() && !deferred_.empty()) {
    try {
      deferred_.front().handle();
    } catch (const db::StoreError& error) {
      if (!error.transient()) throw;
      StoreFailed(error);
      return;
    } catch (const std::exception& error) {
      deferred_.front().responder.Reject(bus::ErrorCode::kHandlerFailed, error.what());
    }
    deferred_bytes_ -= deferred_.front().bytes;
    deferred_.pop_front();
  }
}

legopt_msg::probe_reply ProbeReply(const ServerOptions& options, microseconds uptime, std::int64_t wall_clock_us) {
  legopt_msg::probe_reply reply{};
  reply.protocol_version = bus::kProtocolVersion;
  reply.server_version = options.version;
  reply.hostname = options.hostname;
  reply.pid = options.pid;
  reply.server_instance = options.scheduler.server_instance;
  reply.database = options.database;
  reply.uptime_us = uptime.count();
  reply.wall_clock_us = wall_clock_us;
  return reply;
}

}  // namespace legopt::server
