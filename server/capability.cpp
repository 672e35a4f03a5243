#include "server/capability.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <optional>

#include "legopt/input/json.h"
#include "legopt/types/collision.h"
#include "legopt/types/enum_names.h"

namespace legopt::server {
namespace {

constexpr std::size_t kDatasetDigitsShown = 12, kSolverDigitsShown = 8;
constexpr std::int64_t kMegabyte = std::int64_t{1} << 20;

std::optional<CapabilityKind> KindOf(JobRequirement::Kind kind) {
  switch (kind) {
    case JobRequirement::Kind::kDataset:
      return CapabilityKind::kDataset;
    case JobRequirement::Kind::kSolver:
      return CapabilityKind::kSolver;
    case JobRequirement::Kind::kCollision:
      return CapabilityKind::kCollision;
    case JobRequirement::Kind::kBuild:
    case JobRequirement::Kind::kMemory:
      break;
  }
  return std::nullopt;
}

}  // namespace

std::string TextOf(const JobRequirement& need) {
  switch (need.kind) {
    case JobRequirement::Kind::kDataset:
      return "dataset '" + need.name + "' (" + need.hash.substr(0, kDatasetDigitsShown) + ")";
    case JobRequirement::Kind::kSolver:
      return "solver '" + need.name + "' (" + need.hash.substr(0, kSolverDigitsShown) + ")";
    case JobRequirement::Kind::kCollision:
      return "collision model '" + need.name + "'";
    case JobRequirement::Kind::kBuild:
      return "build " + need.hash;
    case JobRequirement::Kind::kMemory:
      break;
  }
  return std::to_string(need.bytes / kMegabyte) + " MB of memory";
}

std::string RemedyOf(const JobRequirement& need) {
  switch (need.kind) {
    case JobRequirement::Kind::kDataset:
      return "start one with --dataset";
    case JobRequirement::Kind::kSolver:
      return "start one with --solver and the same files as at the submission";
    case JobRequirement::Kind::kCollision:
    case JobRequirement::Kind::kBuild:
      return "start one of the release that submitted it";
    case JobRequirement::Kind::kMemory:
      break;
  }
  return "start one on a larger host, or submit with less 'memory_mb'";
}

WorkerCapabilities::WorkerCapabilities(const legopt_msg::hello_request& hello)
    : build_id_(hello.build_id), memory_bytes_(hello.memory_bytes) {
  for (const legopt_msg::capability& capability : hello.capabilities) {
    const auto kind = ParseEnum<CapabilityKind>(capability.kind);
    if (kind) capabilities_.push_back({*kind, capability.name, capability.hash});
  }
}

bool WorkerCapabilities::Has(const JobRequirement& need) const {
  if (need.kind == JobRequirement::Kind::kBuild) return build_id_ == need.hash;
  if (need.kind == JobRequirement::Kind::kMemory) return memory_bytes_ == 0 || memory_bytes_ >= need.bytes;
  const CapabilityKind kind = KindOf(need.kind).value();
  return std::any_of(capabilities_.begin(), capabilities_.end(), [&](const Capability& capability) {
    if (capability.kind != kind) return false;
    const bool by_hash = kind != CapabilityKind::kCollision;
    const bool by_name = kind != CapabilityKind::kDataset;  // dataset names are for display only
    return (!by_hash || capability.hash == need.hash) && (!by_name || capability.name == need.name);
  });
}

bool WorkerCapabilities::FetchesDatasets() const {
  return std::any_of(capabilities_.begin(), capabilities_.end(),
                     [](const Capability& capability) { return capability.kind == CapabilityKind::kFetch; });
}

bool WorkerCapabilities::WouldFetch(const std::string& hash) const {
  return FetchesDatasets() &&
         std::none_of(capabilities_.begin(), capabilities_.end(), [&](const Capability& capability) {
           return capability.kind == CapabilityKind::kUnfetched && capability.hash == hash;
         });
}

std::vector<std::string> WorkerCapabilities::Names(CapabilityKind kind) const {
  std::vector<std::string> names;
  for (const Capability& capability : capabilities_) {
    if (capability.kind == kind) names.push_back(capability.name);
  }
  return names;
}

std::string WorkerCapabilities::HashOf(CapabilityKind kind, const std::string& name) const {
  const auto found = std::find_if(capabilities_.begin(), capabilities_.end(), [&](const Capability& capability) {
    return capability.kind == kind && capability.name == name;
  });
  return found == capabilities_.end() ? std::string() : found->hash;
}

// The server does not interpret method options, except for these two keys, which determine the requirements.
std::vector<JobRequirement> NeedsOf(const db::MethodRecord& method) {
  std::vector<JobRequirement> needs;
  const auto parsed = TryParseJson(method.options_json);
  if (!parsed || !parsed->is_object()) return needs;
  const nlohmann::json& description = *parsed;
  const auto options = description.find("options");
  if (options == description.end() || !options->is_object()) return needs;
  const auto declaration = options->find("declaration");
  const auto solver = description.find("solver");
  if (declaration != options->end() && declaration->is_string() && solver != description.end() && solver->is_string()) {
    needs.push_back({JobRequirement::Kind::kSolver, solver->get<std::string>(), declaration->get<std::string>()});
  }
  if (options->contains("collision")) {
    needs.push_back({JobRequirement::Kind::kCollision, std::string(ToString(method.collision)), {}});
  }
  return needs;
}

}  // namespace legopt::server
