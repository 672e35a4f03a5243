#include "client/pool/slurm_array.h"

#include <algorithm>
#include <cctype>
#include <cstdio>
#include <map>
#include <thread>

#include "app/printable.h"
#include "client/client_error.h"
#include "legopt/types/classic_stream.h"

namespace legopt::client {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using Clock = std::chrono::steady_clock;

constexpr seconds kSubmitPatience{60};
constexpr seconds kCallPatience{20};
// Most errors occur at once; later, one query per half minute is acceptable for sites.
constexpr seconds kFirstLook{5}, kLongestInterval{30}, kLookAgain{3};
constexpr milliseconds kStopInterval{500};
constexpr milliseconds kReleasePatience{5'000};  // time for a worker to release its jobs

std::vector<std::string> QueueArguments(const std::string& job_id) {
  return {"--noheader", "--array", "--jobs=" + job_id, "--format=%i|%T|%M|%R"};
}

std::string Trimmed(const std::string& text) {
  const auto first = text.find_first_not_of(" \n");
  return first == std::string::npos ? "" : text.substr(first, text.find_last_not_of(" \n") - first + 1);
}

// Returns nullopt without an answer. Slurm forgets ended jobs after some minutes and then reports an invalid id.
std::optional<std::vector<SlurmElement>> ElementsOf(const EngineResult& answer) {
  if (answer.ok()) return ParseElements(answer.output);
  if (answer.words.find("Invalid job id") != std::string::npos) return std::vector<SlurmElement>{};
  return std::nullopt;
}

// Returns the option that Slurm's message mentions, if any.
const EngineOption* MentionedOption(const PoolFile& pool, const std::string& words) {
  const auto named = [&words](const EngineOption& option) {
    return option.key.size() > 1 && words.find(option.key) != std::string::npos;
  };
  const auto blamed = std::find_if(pool.options.begin(), pool.options.end(), named);
  return blamed == pool.options.end() ? nullptr : &*blamed;
}

std::string Refusal(const PoolFile& pool, const EngineResult& answer) {
  const std::string words = Trimmed(app::PrintableLines(answer.words));
  const std::string said = words.empty() ? "sbatch ended with " + answer.exit->Describe() : "Slurm says: " + words;
  if (const EngineOption* option = MentionedOption(pool, words)) {
    return option->place + ": slurm." + option->key + ": is refused" +
           (option->value ? " (got '" + *option->value + "')" : "") + "; " + said;
  }
  return pool.file + ": the pool is refused; " + said;
}

void Cancel(std::vector<std::string> arguments) {
  const EngineResult answer = EngineCommand("scancel", arguments, kCallPatience).Wait();
  if (answer.ok() || answer.words.find("Invalid job id") != std::string::npos) return;
  // Ignore elements that have just ended.
  if (answer.exit && answer.words.find("already completing") != std::string::npos) return;
  std::fprintf(stderr, "legopt: warning: scancel %s: %s\n", arguments.back().c_str(),
               answer.exit ? Trimmed(app::PrintableLines(answer.words)).c_str() : "no answer in time");
}

}  // namespace

std::vector<SlurmElement> ParseElements(const std::string& lines) {
  std::vector<SlurmElement> elements;
  ClassicInput stream(lines);
  for (std::string line; std::getline(stream, line);) {
    ClassicInput fields(line);
    SlurmElement element;
    std::getline(fields, element.id, '|');
    std::getline(fields, element.state, '|');
    std::getline(fields, element.run_time, '|');
    std::getline(fields, element.place);  // a reason may contain any character
    if (!element.state.empty()) elements.push_back(std::move(element));
  }
  return elements;
}

std::string Summary(const std::vector<SlurmElement>& elements) {
  std::map<std::string, int> counts;
  for (const SlurmElement& element : elements) {
    std::string words;
    for (const char c : element.state) words += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    if (element.place.starts_with('(')) words += " " + element.place;
    ++counts[words];
  }
  std::string summary;
  for (const auto& [words, count] : counts) {
    summary += (summary.empty() ? "" : ", ") + std::to_string(count) + " " + words;
  }
  return summary.empty() ? "none" : summary;
}

SlurmArray SlurmArray::Submit(const PoolFile& pool, const std::string& script) {
  const EngineResult answer = EngineCommand("sbatch", {"--parsable"}, kSubmitPatience, script).Wait();
  if (!answer.exit) {
    throw ClientError(ExitCode::kEngineRefused, "sbatch did not answer within " +
                                                    std::to_string(kSubmitPatience.count()) +
                                                    " s; whether the job was taken in, 'squeue --me' tells");
  }
  const std::string job_id = Trimmed(answer.output.substr(0, answer.output.find(';')));  // "17" or "17;cluster"
  const bool is_number = !job_id.empty() && std::all_of(job_id.begin(), job_id.end(),
                                                        [](unsigned char c) { return std::isdigit(c) != 0; });
  if (!answer.ok() || !is_number) throw ClientError(ExitCode::kEngineRefused, Refusal(pool, answer));
  return SlurmArray(job_id);
}

std::optional<std::vector<SlurmElement>> SlurmArray::Look(Clock::time_point now) {
  if (next_look_ == Clock::time_point{}) next_look_ = now + (interval_ = kFirstLook);
  if (look_ == nullptr) {
    if (now < next_look_) return std::nullopt;
    look_ = std::make_unique<EngineCommand>("squeue", QueueArguments(job_id_), kCallPatience);
  }
  const auto answer = look_->Poll();
  if (!answer) return std::nullopt;
  look_.reset();
  auto elements = ElementsOf(*answer);
  next_look_ = now + (elements && elements->empty() ? kLookAgain : interval_);
  interval_ = std::min(2 * interval_, kLongestInterval);
  return elements;
}

std::optional<std::vector<SlurmElement>> SlurmArray::Elements() const {
  return ElementsOf(EngineCommand("squeue", QueueArguments(job_id_), kCallPatience).Wait());
}

void SlurmArray::Stop(milliseconds patience, bool (*give_up)()) {
  const auto hurried = [give_up] { return give_up != nullptr && give_up(); };
  // Returns true if all elements have left the queue.
  const auto wait = [&](milliseconds duration) {
    for (const auto end = Clock::now() + duration;;) {
      const auto elements = Elements();
      if (elements && elements->empty()) return true;
      if (hurried() || Clock::now() >= end) return false;
      std::this_thread::sleep_for(kStopInterval);
    }
  };
  look_.reset();
  Cancel({"--state=PENDING", job_id_});
  if (!hurried()) Cancel({"--batch", "--signal=TERM", job_id_});  // the worker drains
  if (wait(patience)) return;
  Cancel({"--batch", "--signal=TERM", job_id_});  // the worker releases running jobs
  if (wait(kReleasePatience)) return;
  Cancel({job_id_});
}

}  // namespace legopt::client
