#include "server/permission.h"

#include "legopt/types/reply.h"

namespace legopt::server {
namespace {

bool IsForOperators(ControlAction action) {
  switch (action) {
    case ControlAction::kPauseNow:
    case ControlAction::kRelease:
    case ControlAction::kPriority:
    case ControlAction::kDelete:
    case ControlAction::kDrainWorker:
      return true;
    case ControlAction::kPause:
    case ControlAction::kResume:
    case ControlAction::kRetry:
    case ControlAction::kRetryTimeLimits:
    case ControlAction::kRename:
    case ControlAction::kTag:
    case ControlAction::kUntag:
    case ControlAction::kResumeAnyBuild:
      return false;
  }
  return true;
}

}  // namespace

std::string RefusalOf(bus::KeyRole role, const legopt_msg::control_request& request) {
  const ControlAction action{request.action};
  if (role == bus::KeyRole::kOperator || !IsForOperators(action)) return {};
  return bus::RoleRefusal(role, "the action '" + std::string(ToString(action)) + "'", bus::Callers::kOperator);
}

}  // namespace legopt::server
