#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "legopt/dataset/contact.h"
#include "legopt/dataset/internal/yaml_fields.h"

namespace legopt {

/// Reads the key `contacts` of format 2 (dataset_file.h). Throws InputError with key, value and fix.
std::vector<ContactDescription> ReadContacts(const YamlFields& fields);

/// Reads the keys `feet` and `sole_offset_m` of format 1. Throws likewise.
std::vector<ContactDescription> ReadSoles(const YamlFields& fields);

/// Returns the contacts as canonical JSON, for the content hash: an array in the order of the file, with every value.
nlohmann::json CanonicalContacts(const std::vector<ContactDescription>& contacts);

}  // namespace legopt
