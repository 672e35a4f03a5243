#pragma once

#include <string>

#include "legopt/input/json.h"
#include "programs/printable.h"

namespace legopt::client {

/// JSON as commands print it, without a line end: `indent` spaces a level, or one line (-1). Broken UTF-8 is replaced,
/// characters that a terminal could act on are escaped; whoever parses it gets the values as they are.
template <class Json>
std::string JsonText(const Json& json, int indent = 2) {
  return programs::PrintableJson(Dump(json, indent));
}

}  // namespace legopt::client
