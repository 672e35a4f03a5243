#include "db/records.h"

namespace legopt::db {
namespace {

std::string ValidateNameText(std::string_view text, std::size_t max_bytes) {
  if (!text.empty() && text.size() <= max_bytes && text.find('\0') == std::string_view::npos) return {};
  return "must have 1 to " + std::to_string(max_bytes) + " bytes";
}

}  // namespace

std::string ValidateName(std::string_view name) { return ValidateNameText(name, kMaxNameBytes); }

std::string ValidateTag(std::string_view tag) {
  if (tag.find(',') != std::string_view::npos) return "must not hold a comma";
  return ValidateNameText(tag, kMaxTagBytes);
}

}  // namespace legopt::db
