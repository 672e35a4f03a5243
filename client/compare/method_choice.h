#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "client/compare/solves.h"

/// Methods as people name them: "SQP", and where one experiment has several of the name "SQP:multi_starts=10", with
/// commas between what tells them apart: multi_starts, sample_size, incremental (yes, no), collision, id.
namespace legopt::client {

/// The shortest such name among `methods`, one of which `method` is.
std::string ChoiceOf(const MethodIdentity& method, std::span<const MethodIdentity> methods);

/// The method that `text` names, whatever the letter case; empty when none has its name. Throws ClientError (kUsage)
/// for a name with wrong figures, and for one that several have: the error lists how to tell them apart.
std::optional<MethodIdentity> FindMethod(const std::string& text, std::span<const MethodIdentity> methods);

/// The same; that there is none is a ClientError (kUsage), too, with the nearest name.
MethodIdentity ChooseMethod(const std::string& text, std::span<const MethodIdentity> methods,
                            std::int64_t experiment_id);

/// "did you mean 'SQP'? valid: ..." of the choices of all.
std::string SuggestMethod(const std::string& text, std::span<const MethodIdentity> methods);

}  // namespace legopt::client
