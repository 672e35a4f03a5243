#pragma once

#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>

#include "legopt/dataset/internal/dataset_file.h"
#include "legopt/dataset/internal/yaml_fields.h"

namespace legopt {

/// Reads the key `self_collision` (dataset_file.h); nothing if it is absent. Link names are not resolved. Throws
/// InputError for a wrong type, an unknown reason, a pair that is listed twice or of one link with itself, and
/// a dataset that also has `self_collision_reference`.
std::optional<DatasetDescription::SelfCollision> ReadSelfCollision(const YamlFields& fields);

/// Reads the key `link_shapes`; kHulls if it is absent. Throws InputError for an unknown word.
LinkRepresentation ReadLinkShapes(const YamlFields& fields);

/// Formats the key `self_collision`, one pair a line. `quoted` formats a name for YAML.
std::string FormatSelfCollision(const DatasetDescription::SelfCollision& pairs,
                                const std::function<std::string(const std::string&)>& quoted);

/// Returns the unchecked pairs as canonical JSON, for the content hash: sorted triples, without samples and seed, which
/// do not affect results.
nlohmann::json CanonicalPairs(const DatasetDescription::SelfCollision& pairs);

}  // namespace legopt
