#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "client/compare/solves.h"

/// Naming of methods by users: "SQP", or, if an experiment has several methods of the name, "SQP:multi_starts=10" with
/// the distinguishing properties separated by commas: multi_starts, sample_size, incremental (yes, no), collision, id.
namespace legopt::client {

/// Returns the shortest unambiguous name of `method`, which must be one of `methods`.
std::string ChoiceOf(const MethodIdentity& method, std::span<const MethodIdentity> methods);

/// Returns the method named by `text`, ignoring case; nullopt if no method has the name. Throws ClientError (kUsage)
/// for a name with wrong properties, and for an ambiguous name: the error lists how to distinguish the methods.
std::optional<MethodIdentity> FindMethod(const std::string& text, std::span<const MethodIdentity> methods);

/// Returns the method named by `text`; if there is none, throws ClientError (kUsage) with the most similar name.
MethodIdentity ChooseMethod(const std::string& text, std::span<const MethodIdentity> methods,
                            std::int64_t experiment_id);

/// Returns "did you mean 'SQP'? valid: ..." for the names of all methods.
std::string SuggestMethod(const std::string& text, std::span<const MethodIdentity> methods);

}  // namespace legopt::client
