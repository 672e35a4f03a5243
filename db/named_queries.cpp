#include "db/named_queries.h"

#include <algorithm>
#include <map>
#include <set>
#include <stdexcept>

namespace legopt::db {
namespace {

bool IsNameCharacter(char c) { return (c >= 'a' && c <= 'z') || c == '_'; }

// Returns the name at the start of the text.
std::string_view NameAt(std::string_view text) {
  std::size_t length = 0;
  while (length < text.size() && IsNameCharacter(text[length])) ++length;
  return text.substr(0, length);
}

/// Replaces the parameters of one query.
class Writer {
 public:
  Writer(std::initializer_list<QueryParameter> parameters) {
    for (const auto& [name, value] : parameters) values_[name] = value.literal();
  }

  void AddLine(std::string_view line) {
    constexpr std::string_view kIf = "-- if :";
    const std::size_t comment = line.find("--");
    const std::string_view code = line.substr(0, comment);
    if (comment != std::string_view::npos && line.substr(comment).starts_with(kIf)) {
      const std::string_view name = NameAt(line.substr(comment + kIf.size()));
      used_.insert(name);
      const auto found = values_.find(name);
      if (found == values_.end() || !found->second) return;
    }
    AddCode(code.substr(0, code.find_last_not_of(' ') + 1));
  }

  std::string Take(std::string_view file) {
    for (const auto& [name, value] : values_) {
      if (!used_.contains(name)) Fail("does not have the parameter", name, file);
    }
    if (!missing_.empty()) Fail("needs the parameter", *missing_.begin(), file);
    return std::move(sql_);
  }

 private:
  void AddCode(std::string_view code) {
    if (code.empty()) return;
    if (!sql_.empty()) sql_ += '\n';
    bool quoted = false;
    while (!code.empty()) {
      quoted = quoted != (code.front() == '\'');
      const std::string_view name = code.front() == ':' && !quoted ? NameAt(code.substr(1)) : std::string_view();
      if (name.empty()) {
        sql_ += code.front();
        code.remove_prefix(1);
        continue;
      }
      used_.insert(name);
      const auto found = values_.find(name);
      if (found == values_.end()) missing_.insert(name);
      sql_ += found == values_.end() ? "NULL" : found->second.value_or("NULL");
      code.remove_prefix(name.size() + 1);
    }
  }

  [[noreturn]] static void Fail(const std::string& what, std::string_view name, std::string_view file) {
    throw std::logic_error("a named query " + what + " :" + std::string(name) + "\n" + std::string(file));
  }

  std::map<std::string_view, std::optional<std::string>> values_;
  std::set<std::string_view> used_, missing_;
  std::string sql_;
};

}  // namespace

QueryValue::QueryValue(std::string_view text) {
  std::string literal = "'";
  for (const char c : text) {
    if (c == '\'') literal += '\'';
    literal += c;
  }
  literal_ = literal + "'";
}

void QueryValue::Append(const QueryValue& next) {
  literal_ = (literal_ ? *literal_ + ", " : std::string()) + next.literal_.value_or("NULL");
}

std::string Sql(Query query, std::initializer_list<QueryParameter> parameters) {
  const std::string_view file = FileOf(query);
  Writer writer(parameters);
  for (std::size_t begin = 0; begin < file.size();) {
    const std::size_t end = std::min(file.find('\n', begin), file.size());
    writer.AddLine(file.substr(begin, end - begin));
    begin = end + 1;
  }
  return writer.Take(file);
}

}  // namespace legopt::db
