#include "client/pool/engine_call.h"

#include <algorithm>
#include <filesystem>

#include "app/processes.h"
#include "client/client_error.h"

namespace legopt::client {
namespace {

using Clock = std::chrono::steady_clock;
constexpr std::chrono::milliseconds kGrace{500};

std::filesystem::path Find(const std::string& program) {
  const std::filesystem::path found = app::FindProgram(program);
  if (!found.empty()) return found;
  throw ClientError(ExitCode::kMachine,
                    program +
                        " is not on PATH: there is nothing here to start workers with; log in where "
                        "jobs are submitted, or load the site's module for it");
}

}  // namespace

EngineCommand::EngineCommand(const std::string& program, const std::vector<std::string>& arguments,
                             std::chrono::seconds patience, const std::string& input)
    : deadline_(Clock::now() + patience), child_(Find(program), arguments, true, input) {}

EngineResult EngineCommand::AnswerOf(std::optional<ChildExit> exit) const {
  return {exit, child_.output(), child_.ErrorTail()};
}

std::optional<EngineResult> EngineCommand::Poll() {
  if (const auto exit = child_.Poll()) return AnswerOf(exit);
  if (Clock::now() < deadline_) return std::nullopt;
  child_.Stop(kGrace);
  return AnswerOf(std::nullopt);
}

EngineResult EngineCommand::Wait() {
  const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(deadline_ - Clock::now());
  if (const auto exit = child_.Wait(std::max(left, std::chrono::milliseconds(0)))) return AnswerOf(exit);
  child_.Stop(kGrace);
  return AnswerOf(std::nullopt);
}

void RequireEngineProgram(const std::string& program) { Find(program); }

}  // namespace legopt::client
