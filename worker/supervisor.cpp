#include "worker/supervisor.h"

#include <algorithm>
#include <system_error>
#include <utility>

#include "app/host_resources.h"
#include "bus/codec.h"
#include "worker/job_executor.h"

namespace legopt::worker {
namespace {

constexpr microseconds kLongestWait = std::chrono::seconds(1);
// Time between closing of the socket by a job process and its end; a crash takes a moment.
constexpr microseconds kClosingGrace = std::chrono::milliseconds(500);
constexpr std::size_t kDescriptorsPerChild = 3;  // socket, log, process

}  // namespace

Supervisor::Supervisor(ServerLink& link, SupervisorOptions options, spdlog::logger& logger)
    : link_(link),
      options_(std::move(options)),
      logger_(logger),
      pool_(options_.pool, link.now()),
      calls_(link_, pool_),
      children_(static_cast<std::size_t>(options_.pool.slots)) {}

Supervisor::~Supervisor() { EndChildren(); }

// Kills all processes before waiting for the first one, so that they do not take processor time from those that are
// ending.
void Supervisor::EndChildren() {
  for (Child& entry : children_) {
    if (entry.process) entry.process->Kill();
  }
  for (Child& entry : children_) entry = Child{};
}

pid_t Supervisor::child_pid(int slot) const {
  const auto& process = children_[static_cast<std::size_t>(slot)].process;
  return process ? process->pid() : -1;
}

// --- The loop --------------------------------------------------------------------------------------------------------

microseconds Supervisor::WaitTime() const {
  const microseconds now = link_.now();
  microseconds next = pool_.next_deadline();
  for (const Child& entry : children_) {
    if (entry.closed_at) next = std::min(next, *entry.closed_at + kClosingGrace);
  }
  return next <= now ? microseconds(0) : std::min(next - now, kLongestWait);
}

ExitCode Supervisor::Run(int stop_fd, const std::function<bool()>& take_order) {
  std::vector<pollfd> descriptors;
  for (;;) {
    if (const std::optional<ExitCode> code = CarryOutActions()) {
      EndChildren();
      return *code;
    }
    descriptors.assign(1, {stop_fd, POLLIN, 0});
    for (const Child& entry : children_) {
      const ChildProcess* process = entry.process.get();
      const bool talks = process != nullptr && !entry.output_ignored;
      const auto events = static_cast<short>(POLLIN | (talks && process->unsent() ? POLLOUT : 0));
      descriptors.push_back({talks ? process->socket() : -1, events, 0});
      descriptors.push_back({process != nullptr ? process->log_pipe() : -1, POLLIN, 0});
      descriptors.push_back({process != nullptr ? process->pidfd() : -1, POLLIN, 0});
    }
    link_.Wait(descriptors, WaitTime());
    if ((descriptors[0].revents & POLLIN) != 0 && take_order()) pool_.Stop(link_.now());
    for (int slot = 0; slot < options_.pool.slots; ++slot) {
      const std::size_t first = 1 + kDescriptorsPerChild * static_cast<std::size_t>(slot);
      HandleChild(slot, std::span<const pollfd>(descriptors).subspan(first, kDescriptorsPerChild));
    }
    pool_.Tick(link_.now());
  }
}

std::optional<ExitCode> Supervisor::CarryOutActions() {
  // An action may cause further actions.
  for (std::vector<Action> actions = pool_.TakeActions(); !actions.empty(); actions = pool_.TakeActions()) {
    for (const Action& action : actions) {
      std::visit([this](const auto& specific) { CarryOut(specific); }, action);
    }
  }
  return exit_code_;
}

// --- Job processes ---------------------------------------------------------------------------------------------------

void Supervisor::CarryOut(const StartChild& action) {
  Child& entry = child(action.slot);
  entry = Child{};
  try {
    std::optional<app::PinnedThread> pinned;  // inherited by child processes
    if (!options_.slot_processors.empty())
      pinned.emplace(options_.slot_processors[static_cast<std::size_t>(action.slot)]);
    entry.process = std::make_unique<ChildProcess>(options_.child_command);
    logger_.debug("slot {}: job process {} started", action.slot, entry.process->pid());
  } catch (const std::system_error& error) {
    pool_.OnChildExited(link_.now(), action.slot, {0, kChildNotStarted, error.what(), 0});
  }
}

void Supervisor::CarryOut(const AssignJob& action) {
  ChildProcess* process = child(action.slot).process.get();
  if (process == nullptr) return;
  ForwardLog(action.slot, *process);
  process->ClearLogTail();
  logger_.debug("slot {}: job {} attempt {}", action.slot, action.lease.job_id, action.lease.attempt);
  // A process that has closed its socket is about to end; its end is reported then.
  process->Send({FrameType::kJob, action.sequence, EncodeJob(action.lease, *action.options_json)});
}

void Supervisor::CarryOut(const CancelJob& action) {
  if (child(action.slot).process) child(action.slot).process->AskToStop();
}

void Supervisor::CarryOut(const KillChild& action) {
  if (child(action.slot).process) child(action.slot).process->Kill();
}

void Supervisor::HandleChild(int slot, std::span<const pollfd> ready) {
  Child& entry = child(slot);
  if (!entry.process) return;
  ChildProcess& process = *entry.process;
  const bool ended = ready[2].revents != 0;
  if ((ready[0].revents & POLLOUT) != 0) process.Flush();
  if ((ready[0].revents & ~POLLOUT) != 0 || ended) ReadFrames(slot);
  if (ready[1].revents != 0) ForwardLog(slot, process);
  if (entry.closed_at && !ended && link_.now() >= *entry.closed_at + kClosingGrace) {
    Garbage(slot, "closed its channel and went on");
  }
  ChildExit exit;
  if (ended && process.Reap(&exit)) {
    entry = Child{};
    pool_.OnChildExited(link_.now(), slot, exit);
  }
}

void Supervisor::ReadFrames(int slot) {
  Child& entry = child(slot);
  Frame frame;
  std::string why;
  // A process may end with more data on its socket than one read returns.
  for (bool more = true; more && !entry.output_ignored && entry.process->socket() >= 0;) {
    if (!entry.process->ReadSocket()) entry.closed_at = link_.now();
    more = false;
    while (!entry.output_ignored) {
      const FrameReader::Status status = entry.process->NextFrame(&frame, &why);
      if (status == FrameReader::Status::kNeedMore) break;
      if (status == FrameReader::Status::kGarbage) {
        Garbage(slot, why);
      } else {
        HandleFrame(slot, frame);
        more = true;
      }
    }
  }
}

void Supervisor::Garbage(int slot, const std::string& why) {
  child(slot).output_ignored = true;
  child(slot).closed_at.reset();
  pool_.OnChildGarbage(link_.now(), slot, why);
}

void Supervisor::HandleFrame(int slot, const Frame& frame) {
  const microseconds now = link_.now();
  switch (frame.type) {
    case FrameType::kReady: {
      std::vector<Capability> capabilities;
      if (!DecodeCapabilities(frame.body, &capabilities)) return Garbage(slot, "an unreadable list of capabilities");
      return pool_.OnChildReady(now, slot, capabilities);
    }
    case FrameType::kStartFailed:
      return pool_.OnChildStartFailed(now, slot, PrintableText(frame.body, kMaxMessageBytes));
    case FrameType::kProgress: {
      int done = 0;
      int total = 0;
      if (!DecodeProgress(frame.body, &done, &total)) return Garbage(slot, "unreadable progress");
      return pool_.OnChildProgress(now, slot, frame.sequence, done, total);
    }
    case FrameType::kJudging:
      return pool_.OnChildJudging(now, slot, frame.sequence);
    case FrameType::kResult: {
      std::string why;
      std::optional<legopt_msg::result_request> result = bus::Decode<legopt_msg::result_request>(frame.body, &why);
      if (!result) return Garbage(slot, "an unreadable result: " + why);
      const auto outcome = static_cast<ReportedOutcome>(result->outcome);
      // The supervisor determines how a process ended.
      if (outcome == ReportedOutcome::kCrashed) return Garbage(slot, "an impossible outcome");
      return pool_.OnChildResult(now, slot, frame.sequence, std::move(*result));
    }
    case FrameType::kJob:
      break;
  }
  Garbage(slot, "a frame that is not for the supervisor");
}

void Supervisor::ForwardLog(int slot, ChildProcess& process) {
  const std::string text = process.ReadLog();
  if (!logger_.should_log(spdlog::level::debug)) return;
  std::string_view rest = text;
  while (!rest.empty()) {
    const std::size_t end = std::min(rest.find('\n'), rest.size());
    if (end > 0) logger_.debug("slot {}: {}", slot, PrintableText(rest.substr(0, end), kMaxMessageBytes));
    rest.remove_prefix(std::min(end + 1, rest.size()));
  }
}

// --- Log, and the end ------------------------------------------------------------------------------------------------

void Supervisor::CarryOut(const LogLine& action) {
  switch (action.level) {
    case LogLevel::kDebug:
      return logger_.debug(action.text);
    case LogLevel::kInfo:
      return logger_.info(action.text);
    case LogLevel::kWarning:
      return logger_.warn(action.text);
    case LogLevel::kError:
      return logger_.error(action.text);
  }
}

void Supervisor::CarryOut(const ExitWorker& action) {
  if (!exit_code_) exit_code_ = action.code;
}

}  // namespace legopt::worker
