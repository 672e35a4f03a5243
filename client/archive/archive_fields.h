#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "client/archive/archive.h"

namespace legopt::client {

/// The JSON of an archive; the keys are those of docs/reference/archives.md.

/// Returns the JSON of the header or of one result.
nlohmann::ordered_json HeaderFields(const Archive& archive);
nlohmann::ordered_json ResultFields(const ArchivedResult& result);

/// Reads everything but the results. Throws InputError with `source` and the key.
Archive HeaderOf(const nlohmann::ordered_json& json, const std::string& source);

/// Reads a result of an archive whose header has been read. Throws as HeaderOf.
ArchivedResult ResultOf(const nlohmann::ordered_json& json, const Archive& archive, const std::string& source);

}  // namespace legopt::client
