#pragma once

#include <cstddef>
#include <string>

/// @file
/// Texts of messages: UTF-8 without NUL. Thread rule: none, no state.

namespace legopt::bus {

/// UTF-8 without NUL.
bool IsText(const std::string& text);

/// `text` with at most `limit` bytes (whole characters), NULs and bytes that are not UTF-8 replaced by '?'.
std::string CleanText(std::string text, std::size_t limit);

}  // namespace legopt::bus
