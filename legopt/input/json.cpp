#include "legopt/input/json.h"

#include <algorithm>
#include <iterator>
#include <utility>
#include <vector>

#include "legopt/input/text.h"
#include "legopt/types/input_error.h"

namespace legopt {
namespace {

/// Iterator over a text that reports how far the parser has read.
class WatchedIterator {
 public:
  using iterator_category = std::input_iterator_tag;
  using value_type = char;
  using difference_type = std::ptrdiff_t;
  using pointer = const char*;
  using reference = const char&;

  WatchedIterator(const char* at, const char** reached) : at_(at), reached_(reached) {}
  reference operator*() const { return *at_; }
  WatchedIterator& operator++() {
    *reached_ = ++at_;
    return *this;
  }
  WatchedIterator operator++(int) {
    WatchedIterator before = *this;
    ++*this;
    return before;
  }
  friend bool operator==(const WatchedIterator& a, const WatchedIterator& b) { return a.at_ == b.at_; }
  friend bool operator!=(const WatchedIterator& a, const WatchedIterator& b) { return a.at_ != b.at_; }

 private:
  const char* at_;
  const char** reached_;
};

/// Message of a library error without its prefix, "[json.exception.parse_error.101] ".
std::string WithoutPrefix(const std::string& message) {
  const auto end = message.find("] ");
  return end == std::string::npos ? message : message.substr(end + 2);
}

/// Builds the value from the parser's events and checks them. Throws InputError.
template <class Json>
class JsonBuilder : public nlohmann::json_sax<Json> {
 public:
  using typename nlohmann::json_sax<Json>::number_integer_t;
  using typename nlohmann::json_sax<Json>::number_unsigned_t;
  using typename nlohmann::json_sax<Json>::number_float_t;
  using typename nlohmann::json_sax<Json>::string_t;
  using typename nlohmann::json_sax<Json>::binary_t;

  JsonBuilder(std::string_view text, const std::string& source, const JsonLimits& limits)
      : text_(text), source_(source), limits_(limits), reached_(text.data()) {}

  Json Build() {
    const WatchedIterator begin(text_.data(), &reached_), end(text_.data() + text_.size(), &reached_);
    Json::sax_parse(begin, end, this);
    return std::move(root_);
  }

  bool null() override { return Add(nullptr); }
  bool boolean(bool value) override { return Add(value); }
  bool number_integer(number_integer_t value) override { return Add(value); }
  bool number_unsigned(number_unsigned_t value) override { return Add(value); }
  bool number_float(number_float_t value, const string_t& /*text*/) override { return Add(value); }
  bool string(string_t& value) override { return Add(std::move(value)); }
  bool binary(binary_t& value) override { return Add(std::move(value)); }
  bool start_object(std::size_t /*size*/) override { return Open(Json::object()); }
  bool end_object() override { return Close(); }
  bool start_array(std::size_t /*size*/) override { return Open(Json::array()); }
  bool end_array() override { return Close(); }

  bool key(string_t& name) override {
    Json& object = *open_.back();
    if (object.find(name) != object.end())
      Refuse("'" + name + "'", "the object has this key twice", "keep one of them");
    member_ = &object[name];
    return true;
  }

  bool parse_error(std::size_t /*position*/, const std::string& /*token*/,
                   const nlohmann::detail::exception& error) override {
    constexpr int kNumberOutOfRange = 406;
    Refuse("", "not valid JSON: " + WithoutPrefix(error.what()),
           error.id == kNumberOutOfRange ? "write numbers below 1.8e308" : "correct the syntax");
    return false;
  }

 private:
  [[noreturn]] void Refuse(const std::string& field, const std::string& message, const std::string& fix) const {
    const auto line = 1 + std::count(text_.data(), reached_, '\n');
    const std::string byte = "byte " + std::to_string(reached_ - text_.data());
    throw InputError(
        {source_ + ":" + std::to_string(line), field.empty() ? byte : byte + ": " + field, "", message, fix});
  }

  template <class Value>
  Json& Place(Value&& value) {
    if (++values_ > limits_.values) {
      Refuse("", "holds more than " + std::to_string(limits_.values) + " values", "check that it is the right file");
    }
    if (open_.empty()) return root_ = Json(std::forward<Value>(value));
    if (open_.back()->is_array()) {
      open_.back()->push_back(Json(std::forward<Value>(value)));
      return open_.back()->back();
    }
    return *member_ = Json(std::forward<Value>(value));
  }

  template <class Value>
  bool Add(Value&& value) {
    Place(std::forward<Value>(value));
    return true;
  }

  bool Open(Json&& container) {
    if (open_.size() >= limits_.depth) {
      Refuse("", "nested more than " + std::to_string(limits_.depth) + " deep", "check that it is the right file");
    }
    open_.push_back(&Place(std::move(container)));
    return true;
  }

  bool Close() {
    open_.pop_back();
    return true;
  }

  std::string_view text_;
  const std::string& source_;
  const JsonLimits& limits_;
  const char* reached_;  // end of the text that the parser has read
  Json root_;
  std::vector<Json*> open_;  // unfinished lists and objects, outermost first
  Json* member_ = nullptr;   // member of the innermost object whose value comes next
  std::size_t values_ = 0;
};

// The library treats NUL as the end of the text and would ignore the rest.
void RequireNoNul(std::string_view text, const std::string& source) {
  const std::size_t at = text.find('\0');
  if (at == std::string_view::npos) return;
  const auto line = 1 + std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(at), '\n');
  throw InputError({source + ":" + std::to_string(line), "byte " + std::to_string(at), "",
                    "not valid JSON: the text holds the character NUL", "remove it; is the file text?"});
}

template <class Json>
Json Parse(std::string_view text, const std::string& source, const JsonLimits& limits) {
  if (text.size() > limits.bytes) {
    throw InputError({source, "", "", "is larger than " + std::to_string(limits.bytes >> 10U) + " KiB",
                      "check that it is the right text"});
  }
  RequireUtf8(text, source);
  RequireNoNul(text, source);
  return JsonBuilder<Json>(text, source, limits).Build();
}

}  // namespace

nlohmann::json ParseJson(std::string_view text, const std::string& source, const JsonLimits& limits) {
  return Parse<nlohmann::json>(text, source, limits);
}

nlohmann::ordered_json ParseOrderedJson(std::string_view text, const std::string& source, const JsonLimits& limits) {
  return Parse<nlohmann::ordered_json>(text, source, limits);
}

std::optional<nlohmann::json> TryParseJson(std::string_view text, const JsonLimits& limits) {
  try {
    return ParseJson(text, "", limits);
  } catch (const InputError&) {
    return std::nullopt;
  }
}

nlohmann::json ReadJsonFile(const std::filesystem::path& path, const JsonLimits& limits) {
  return ParseJson(ReadFileText(path, limits.bytes), path.string(), limits);
}

std::string Dump(const nlohmann::json& json, int indent) {
  return json.dump(indent, ' ', false, nlohmann::json::error_handler_t::replace);
}

std::string Dump(const nlohmann::ordered_json& json, int indent) {
  return json.dump(indent, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
}

}  // namespace legopt
