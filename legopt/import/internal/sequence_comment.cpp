#include "legopt/import/internal/sequence_comment.h"

#include <tinyxml2.h>

#include <nlohmann/json.hpp>
#include <optional>
#include <string_view>

#include "legopt/input/json.h"
#include "legopt/types/input_error.h"

namespace legopt {
namespace {

constexpr std::string_view kMark = "legopt-stances ";

/// Replaces "--", which XML forbids in comments, by an escape of JSON.
std::string WithoutDoubleDashes(const std::string& json) {
  std::string text;
  for (const char c : json) text += c == '-' && text.ends_with('-') ? "\\u002d" : std::string(1, c);
  return text;
}

}  // namespace

std::string CommentOf(std::span<const Stance> stances) {
  nlohmann::json list = nlohmann::json::array();
  for (const Stance& stance : stances) list.push_back(StanceJson(stance));
  return "<!-- " + std::string(kMark) + WithoutDoubleDashes(Dump(list)) + " -->\n";
}

std::vector<Stance> StancesInComment(const tinyxml2::XMLDocument& document, const std::string& file) {
  std::vector<Stance> stances;
  for (const tinyxml2::XMLNode* node = document.RootElement(); node != nullptr; node = node->NextSibling()) {
    if (node->ToComment() == nullptr) continue;
    std::string_view text = node->Value();
    const std::size_t begin = text.find(kMark);
    if (begin == std::string_view::npos) continue;
    const std::string field = "comment in line " + std::to_string(node->GetLineNum());
    const std::optional<nlohmann::json> list = TryParseJson(text.substr(begin + kMark.size()));
    if (!list || !list->is_array()) {
      throw InputError({.file = file,
                        .field = field,
                        .value = "",
                        .message = "the list of stances is damaged",
                        .fix = "remove the comment; the stances then follow from the patches"});
    }
    for (const nlohmann::json& stance : *list) stances.push_back(ReadStance(stance, {.file = file, .field = field}));
  }
  return stances;
}

}  // namespace legopt
