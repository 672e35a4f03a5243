#include "legopt/input/yaml.h"

#include <yaml-cpp/eventhandler.h>

#include <algorithm>
#include <optional>
#include <set>
#include <unordered_map>
#include <utility>
#include <vector>

#include "legopt/input/text.h"
#include "legopt/types/input_error.h"
#include "legopt/types/number_text.h"

namespace legopt {
namespace {

constexpr const char* kSyntaxFix = "check indentation, brackets and quotes";

/// Checks a document during parsing, before nodes are created. Aliases count as their expansion, so that a few lines
/// cannot expand to billions of values.
class DocumentCheck : public YAML::EventHandler {
 public:
  DocumentCheck(const std::string& source, const YamlLimits& limits) : source_(source), limits_(limits) {}

  const YAML::Mark& start() const { return start_; }

  void OnDocumentStart(const YAML::Mark& mark) override {
    start_ = mark;
    ++documents_;
  }
  void OnDocumentEnd() override {}
  void OnNull(const YAML::Mark& mark, YAML::anchor_t anchor) override {
    if (!open_.empty()) AddScalar(mark, anchor, "");  // else the document is empty
  }
  void OnScalar(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor,
                const std::string& value) override {
    const bool plain = tag != "!";  // the library's tag of quoted scalars
    if (plain && value == "<<" && IsKey()) {
      Refuse(mark, "merge keys (<<) are not supported", "write the keys out");
    }
    if (value.find('\0') != std::string::npos) {
      Refuse(mark, "a text holds the character NUL", "remove its escape sequence");
    }
    AddScalar(mark, anchor, value);
  }
  void OnAlias(const YAML::Mark& mark, YAML::anchor_t anchor) override {
    const auto found = anchors_.find(anchor);
    if (found == anchors_.end()) {
      Refuse(mark, "the alias is inside of the value that it refers to", "write the value out");
    }
    const Anchored& target = found->second;
    if (target.depth + open_.size() > limits_.depth) RefuseDepth(mark);
    Add(mark, target.values, target.scalar ? &*target.scalar : nullptr);
    for (Open& container : open_) container.depth = std::max(container.depth, target.depth + Above(container));
  }
  void OnSequenceStart(const YAML::Mark& mark, const std::string& /*tag*/, YAML::anchor_t anchor,
                       YAML::EmitterStyle::value /*style*/) override {
    Begin(mark, anchor, false);
  }
  void OnMapStart(const YAML::Mark& mark, const std::string& /*tag*/, YAML::anchor_t anchor,
                  YAML::EmitterStyle::value /*style*/) override {
    Begin(mark, anchor, true);
  }
  void OnSequenceEnd() override { End(); }
  void OnMapEnd() override { End(); }

 private:
  /// A list or map that has not ended.
  struct Open {
    YAML::anchor_t anchor = 0;
    std::size_t values_before = 0;  ///< number of values of the document before it
    std::size_t level = 0;          ///< number of enclosing lists and maps
    std::size_t depth = 1;          ///< depth of nesting, itself included
    bool is_map = false;
    bool awaits_key = true;      ///< the next node of this map is a key
    std::set<std::string> keys;  ///< the map's keys so far
  };
  /// A value with an anchor.
  struct Anchored {
    std::size_t values = 0;
    std::size_t depth = 0;
    std::optional<std::string> scalar;
  };

  [[noreturn]] void Refuse(const YAML::Mark& mark, const std::string& message, const std::string& fix) const {
    throw InputError({source_ + ":" + std::to_string(mark.line + 1), "", "", message, fix});
  }
  [[noreturn]] void RefuseDepth(const YAML::Mark& mark) const {
    Refuse(mark, "nested more than " + std::to_string(limits_.depth) + " deep", kSyntaxFix);
  }

  bool IsKey() const { return !open_.empty() && open_.back().is_map && open_.back().awaits_key; }
  std::size_t Above(const Open& container) const { return open_.size() - container.level; }

  /// Counts a node of `values` values. `scalar`: its text, null for lists and maps.
  void Add(const YAML::Mark& mark, std::size_t values, const std::string* scalar) {
    RequireFirstDocument(mark);
    values_ += values;
    if (values_ > limits_.values) {
      Refuse(mark, "holds more than " + std::to_string(limits_.values) + " values, aliases expanded",
             "write less, or fewer aliases");
    }
    if (open_.empty() || !open_.back().is_map) return;
    Open& map = open_.back();
    if (map.awaits_key) TakeKey(mark, scalar, map);
    map.awaits_key = !map.awaits_key;
  }

  void TakeKey(const YAML::Mark& mark, const std::string* scalar, Open& map) const {
    if (scalar == nullptr)
      Refuse(mark, "a list or map stands as a key", "write a word as the key; " + std::string(kSyntaxFix));
    if (!map.keys.insert(*scalar).second) Refuse(mark, "the key '" + *scalar + "' is given twice", "keep one of them");
  }

  void AddScalar(const YAML::Mark& mark, YAML::anchor_t anchor, const std::string& value) {
    Add(mark, 1, &value);
    if (anchor != 0) anchors_[anchor] = {1, 0, value};
  }

  void Begin(const YAML::Mark& mark, YAML::anchor_t anchor, bool is_map) {
    const std::size_t before = values_;
    Add(mark, 1, nullptr);
    if (open_.size() >= limits_.depth) RefuseDepth(mark);
    open_.push_back({anchor, before, open_.size(), 1, is_map, true, {}});
    for (Open& container : open_) container.depth = std::max(container.depth, Above(container));
  }

  void End() {
    const Open& ended = open_.back();
    if (ended.anchor != 0) anchors_[ended.anchor] = {values_ - ended.values_before, ended.depth, std::nullopt};
    open_.pop_back();
  }

  // Empty documents, as after a last '---', are ignored.
  void RequireFirstDocument(const YAML::Mark& mark) {
    if (!first_with_content_) first_with_content_ = documents_;
    if (*first_with_content_ == documents_ && documents_ == 1) return;
    Refuse(mark, "a second YAML document begins here, which would not be read",
           "remove the '---' before it, or make it a file of its own");
  }

  const std::string& source_;
  const YamlLimits& limits_;
  YAML::Mark start_;
  int documents_ = 0;
  std::optional<int> first_with_content_;  // number of the first document that is not empty
  std::size_t values_ = 0;
  std::vector<Open> open_;
  std::unordered_map<YAML::anchor_t, Anchored> anchors_;  // finished ones only
};

// yaml-cpp returns empty documents for ever, without advancing, for text that cannot begin a document (a comma, for
// example).
void CheckText(const std::string& text, const std::string& source, const YamlLimits& limits) {
  ClassicInput stream(text);
  YAML::Parser parser(stream);
  DocumentCheck document(source, limits);
  for (int last_start = -1; parser.HandleNextDocument(document); last_start = document.start().pos) {
    if (document.start().pos != last_start) continue;
    throw InputError({source + ":" + std::to_string(document.start().line + 1), "", "",
                      "is not valid YAML: no value can begin here", kSyntaxFix});
  }
}

// YAML allows no control characters. yaml-cpp ends a text at some of them, and reads others as a backslash.
void RequireNoControls(const std::string& text, const std::string& source) {
  const auto is_control = [](char c) {
    const auto byte = static_cast<unsigned char>(c);
    return (byte < 0x20 && c != '\t' && c != '\n' && c != '\r') || byte == 0x7F;
  };
  const auto found = std::find_if(text.begin(), text.end(), is_control);
  if (found == text.end()) return;
  constexpr std::string_view kDigits = "0123456789abcdef";
  const auto byte = static_cast<unsigned char>(*found);
  const auto line = 1 + std::count(text.begin(), found, '\n');
  throw InputError({source + ":" + std::to_string(line),
                    "byte " + std::to_string(found - text.begin()),
                    {'0', 'x', kDigits[byte >> 4U], kDigits[byte & 0xFU]},
                    "is not valid YAML: a control character",
                    "remove it; a file in UTF-16 begins with a byte order mark, or is saved as UTF-8"});
}

}  // namespace

YAML::Node ParseYaml(const std::string& given, const std::string& source, const YamlLimits& limits) {
  if (given.size() > limits.bytes) {
    throw InputError({source, "", "", "is larger than " + std::to_string(limits.bytes >> 10U) + " KiB",
                      "no file of this kind is that large; check that it is the right one"});
  }
  const std::string text = FromMarkedEncoding(given, source);
  RequireUtf8(text, source);
  RequireNoControls(text, source);
  try {
    CheckText(text, source, limits);
    return YAML::Load(text);
  } catch (const YAML::Exception& error) {
    const std::string place = error.mark.is_null() ? source : source + ":" + std::to_string(error.mark.line + 1);
    throw InputError({place, "", "", "is not valid YAML: " + error.msg, kSyntaxFix});
  }
}

YAML::Node ReadYamlFile(const std::filesystem::path& path, const YamlLimits& limits) {
  return ParseYaml(ReadFileText(path, limits.bytes), path.string(), limits);
}

}  // namespace legopt
