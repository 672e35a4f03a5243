#pragma once

#include <cstddef>
#include <string>

/// @file
/// Texts of messages: UTF-8 without NUL. Thread rule: none, no state.

namespace legopt::bus {

/// Returns whether `text` is UTF-8 without NUL.
bool IsText(const std::string& text);

/// Returns `text` truncated to at most `limit` bytes (whole characters), with NULs and invalid UTF-8 bytes replaced by
/// '?'.
std::string CleanText(std::string text, std::size_t limit);

}  // namespace legopt::bus
