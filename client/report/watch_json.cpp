#include "client/report/watch_json.h"

#include <nlohmann/json.hpp>
#include <utility>

#include "client/report/json_text.h"
#include "legopt/input/json.h"

namespace legopt::client {
namespace {

using Json = nlohmann::ordered_json;

Json OrNull(const std::optional<double>& number) { return number ? Json(*number) : Json(); }

void AddProgress(const ExperimentStatus& status, Json* line) {
  Json running = Json::array();
  for (const RunningJob& job : status.running) {
    running.push_back({{"job", job.job},
                       {"task", ToString(job.task)},
                       {"worker", job.worker},
                       {"done", job.done},
                       {"total", job.total}});
  }
  line->update(Json{{"name", status.name},
                    {"state", ToString(status.state)},
                    {"hold", ToString(status.hold)},
                    {"hold_reason", status.hold_reason},
                    {"waiting_for", status.waiting_for},
                    {"total", status.total},
                    {"queued", status.queued},
                    {"leased", status.leased},
                    {"done", status.done},
                    {"failed", status.failed},
                    {"dead", status.dead},
                    {"cancelled", status.cancelled},
                    {"solved", status.solved},
                    {"rule", ToString(status.rule)},
                    {"taken_over", status.taken_over},
                    {"elapsed_s", status.elapsed_s},
                    {"worked_s", OrNull(status.worked_s)},
                    {"eta_s", OrNull(status.eta_s)},
                    {"share", status.share},
                    {"running", std::move(running)}});
}

}  // namespace

WatchJson::WatchJson(std::int64_t experiment_id, Seconds interval, Clock clock, WallClock wall_clock, Write write)
    : experiment_id_(experiment_id),
      interval_(interval),
      clock_(std::move(clock)),
      wall_clock_(std::move(wall_clock)),
      write_(std::move(write)) {}

Json WatchJson::Event(const char* name) const {
  return {{"event", name}, {"at_us", wall_clock_()}, {"experiment", experiment_id_}};
}

bool WatchJson::Due(const ExperimentStatus& status) const {
  constexpr int kIntervalsUnchanged = 10;
  if (!written_ || status.over()) return true;
  const Seconds since = clock_() - written_at_;
  return since >= (SameProgress(status, *written_) ? kIntervalsUnchanged * interval_ : interval_);
}

void WatchJson::Show(const ExperimentStatus& status) {
  latest_ = status;
  if (!Due(status)) return;
  Json line = Event("progress");
  AddProgress(status, &line);
  write_(JsonText(line, -1));
  written_ = status;
  written_at_ = clock_();
}

void WatchJson::ServerSilent(Seconds silence, Seconds /*patience*/) {
  Json line = Event("silent");
  line["silent_s"] = silence.count();
  write_(JsonText(line, -1));
}

void WatchJson::ServerBack() { write_(Dump(Event("back"))); }

void WatchJson::End(ExitCode exit_code, const std::string& reason) {
  Json line = Event("end");
  line["exit_code"] = static_cast<int>(exit_code);
  line["reason"] = reason;
  if (latest_) AddProgress(*latest_, &line);
  write_(JsonText(line, -1));
}

}  // namespace legopt::client
