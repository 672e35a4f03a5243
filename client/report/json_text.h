#pragma once

#include <string>

#include "app/printable.h"
#include "legopt/input/json.h"

namespace legopt::client {

/// Returns JSON as printed by commands, without a line end: `indent` spaces per level, or one line (-1). Invalid UTF-8
/// is replaced; terminal control characters are escaped, so parsers still get the original values.
template <class Json>
std::string JsonText(const Json& json, int indent = 2) {
  return app::PrintableJson(Dump(json, indent));
}

}  // namespace legopt::client
