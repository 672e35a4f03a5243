#include "app/command_line.h"

#include <CLI/CLI.hpp>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string_view>
#include <type_traits>
#include <utility>

#include "legopt/types/nearest_name.h"
#include "legopt/types/number_text.h"

namespace legopt::app {
namespace {

// Uses from_chars, because stream conversion depends on the locale and accepts trailing text.
template <class Value>
std::optional<Value> Parse(const std::string& word) {
  Value value{};
  const char* first = word.data() + (word.size() > 1 && word[0] == '+' ? 1 : 0);
  const char* last = word.data() + word.size();
  const auto [end, fault] = std::from_chars(first, last, value);
  if (fault != std::errc() || end != last) return std::nullopt;
  return value;
}

std::string Text(double value) { return FormatGeneral(value, 10); }

std::string Got(const std::string& word) { return word.empty() ? " (got nothing)" : " (got '" + word + "')"; }

}  // namespace

std::string Alternatives(const std::vector<std::string>& words) {
  if (words.size() < 2) return Joined(words);
  return Joined({words.begin(), words.end() - 1}) + " or " + words.back();
}

std::string Joined(const std::vector<std::string>& words) {
  std::string text;
  for (const auto& word : words) text += (text.empty() ? "" : ", ") + word;
  return text;
}

ValueCheck WholeNumber(std::int64_t low, std::int64_t high) {
  const bool bounded = high < std::numeric_limits<std::int64_t>::max();
  const std::string range =
      bounded ? " from " + std::to_string(low) + " to " + std::to_string(high) : " of at least " + std::to_string(low);
  const auto check = [low, high, range](const std::string& word) {
    const auto value = Parse<std::int64_t>(word);
    if (value && *value >= low && *value <= high) return std::string();
    return "must be a whole number" + range + Got(word);
  };
  return {check, "[" + std::to_string(low) + " .. " + (bounded ? std::to_string(high) : "") + "]"};
}

ValueCheck Number(double low, double high) {
  const auto check = [low, high](const std::string& word) {
    const auto value = Parse<double>(word);
    if (value && *value >= low && *value <= high) return std::string();
    return "must be a number from " + Text(low) + " to " + Text(high) + Got(word);
  };
  return {check, "[" + Text(low) + " .. " + Text(high) + "]"};
}

ValueCheck OneOf(std::vector<std::string> words) {
  const std::string list = Joined(words);
  const auto check = [words = std::move(words)](const std::string& word) {
    for (const auto& known : words) {
      if (known == word) return std::string();
    }
    return "'" + word + "' is not known; " + SuggestName(word, words);
  };
  return {check, "{" + list + "}"};
}

namespace {

constexpr char kAnyNumber[] = "any number";

template <class Value>
struct NumberIn {
  using type = Value;
};
template <class Value>
struct NumberIn<std::optional<Value>> {
  using type = Value;
};

std::string_view WithoutPlus(std::string_view word) { return word.substr(word.size() > 1 && word[0] == '+' ? 1 : 0); }

template <class Number>
std::optional<Number> ReadNumber(std::string_view word) {
  if constexpr (std::is_integral_v<Number>) {
    return ParseInteger<Number>(WithoutPlus(word));
  } else {
    const std::optional<Number> number = ParseNumber(word);
    return number && std::isfinite(*number) ? number : std::nullopt;
  }
}

template <class Number>
std::string FaultOfNumber(const std::string& word) {
  if (ReadNumber<Number>(word)) return {};
  const std::string kind = std::is_floating_point_v<Number> ? "must be a number"
                           : std::is_signed_v<Number>       ? "must be a whole number"
                                                            : "must be a whole number of at least 0";
  return kind + " (got '" + word + "')";
}

// CLI11 reads 010 as 8 and accepts 0x10, " 1" and, for unsigned numbers, -1. This function passes it the decimal
// number, and rejects other words. Option::Check replaces the second validator by one that prints the range.
template <class Number>
void ReadAsDecimal(CLI::Option& option) {
  const auto normalize = [](std::string& word) {
    if constexpr (std::is_integral_v<Number>) {
      if (const auto number = ReadNumber<Number>(word)) word = std::to_string(*number);
    }
    return std::string();
  };
  option.transform(CLI::Validator(normalize, ""));
  option.check(CLI::Validator([](const std::string& word) { return FaultOfNumber<Number>(word); }, "", kAnyNumber));
}

}  // namespace

Option Option::Required() const {
  option_->required();
  return *this;
}

Option Option::Check(ValueCheck check) const {
  const auto fault = [fault = std::move(check.fault)](const std::string& word) { return fault(word); };
  try {
    option_->get_validator(kAnyNumber)->active(false);
  } catch (const CLI::OptionNotFound&) {  // not a number
  }
  option_->check(CLI::Validator(fault, check.range));
  return *this;
}

Option Option::Group(const std::string& heading) const {
  option_->group(heading);
  return *this;
}

Option Option::ValueName(const std::string& name) const {
  option_->type_name(name);
  return *this;
}

Option Option::OneArgumentEach() const {
  option_->allow_extra_args(false)->type_name("LIST");
  return *this;
}

Option Option::ValueMayBeLeftOut(const std::string& value) const {
  option_->expected(0, 1)->default_str(value);
  return *this;
}

Option Option::ShowDefault() const {
  option_->capture_default_str();
  return *this;
}

Option Option::Excludes(Option other) const {
  option_->excludes(other.option_);
  return *this;
}

Option Option::Needs(Option other) const {
  option_->needs(other.option_);
  return *this;
}

template <class Value>
Option Command::AddOption(const std::string& name, Value& value, const std::string& help) const {
  CLI::Option* option = app_->add_option(name, value, help);
  using Number = typename NumberIn<Value>::type;
  if constexpr (std::is_arithmetic_v<Number>) ReadAsDecimal<Number>(*option);
  return Option(option);
}

#define LEGOPT_OPTION_OF(...)                                                                                     \
  template Option Command::AddOption<__VA_ARGS__>(const std::string&, __VA_ARGS__&, const std::string&) const;    \
  template Option Command::AddOption<std::optional<__VA_ARGS__>>(const std::string&, std::optional<__VA_ARGS__>&, \
                                                                 const std::string&) const

LEGOPT_OPTION_OF(int);
LEGOPT_OPTION_OF(std::int64_t);
LEGOPT_OPTION_OF(std::uint64_t);
LEGOPT_OPTION_OF(double);
LEGOPT_OPTION_OF(std::string);
LEGOPT_OPTION_OF(std::filesystem::path);
#undef LEGOPT_OPTION_OF

template Option Command::AddOption<std::vector<std::string>>(const std::string&, std::vector<std::string>&,
                                                             const std::string&) const;
template Option Command::AddOption<std::vector<std::filesystem::path>>(const std::string&,
                                                                       std::vector<std::filesystem::path>&,
                                                                       const std::string&) const;

Option Command::AddOption(const std::string& name, const std::string& help) const {
  return Option(app_->add_option(name, help));
}

Option Command::AddList(const std::string& name, std::vector<std::string>& values, const std::string& help,
                        const IsWholeValue& is_whole, const ValueCheck& check) const {
  const std::string shown = name.substr(0, name.find(','));
  const auto take = [&values, shown, is_whole, fault_of = check.fault](const std::vector<std::string>& arguments) {
    values.clear();
    for (const std::string& argument : arguments) {
      for (std::string& value : SplitValues(argument, is_whole)) {
        const std::string fault = fault_of ? fault_of(value) : "";
        if (!fault.empty()) throw CLI::ValidationError(shown, fault);
        values.push_back(std::move(value));
      }
    }
  };
  return Option(app_->add_option_function<std::vector<std::string>>(name, take, help)).OneArgumentEach();
}

Option Command::AddFlag(const std::string& name, bool& value, const std::string& help) const {
  return Option(app_->add_flag(name, value, help));
}

Option Command::AddAction(const std::string& name, const std::function<void(const std::string&)>& action,
                          const std::string& help) const {
  return Option(app_->add_option_function<std::string>(name, action, help));
}

Option Command::AddFlagAction(const std::string& name, std::function<void()> action, const std::string& help) const {
  return Option(app_->add_flag_callback(name, std::move(action), help));
}

Option Command::AddChosen(const std::string& name, std::vector<std::string> words,
                          std::function<void(std::size_t)> choose, const std::string& help) const {
  const auto take = [name, words = std::move(words), choose = std::move(choose)](const std::string& word) {
    for (std::size_t i = 0; i < words.size(); ++i) {
      if (words[i] == word) return choose(i);
    }
    throw CLI::ValidationError(name, "'" + word + "' is not known; " + SuggestName(word, words));
  };
  return AddAction(name, take, help).ValueName("WORD");
}

Command Command::AddCommand(const std::string& name, const std::string& help) const {
  return Command(app_->add_subcommand(name, help));
}

void Command::GroupCommands(const std::string& heading) const {
  const std::string not_grouped = CLI::App().get_group();
  for (CLI::App* command : app_->get_subcommands({})) {
    if (command->get_group() == not_grouped) command->group(heading);
  }
}

void Command::WhenChosen(std::function<void()> action) const { app_->callback(std::move(action)); }

void Command::RequireCommand() const { app_->require_subcommand(1); }

void Command::LetOptionsFollowCommands() const { app_->fallthrough(); }

void Command::AddFlagThroughout(const std::string& name, bool& value, const std::string& help) const {
  AddFlag(name, value, help);
  for (CLI::App* command : app_->get_subcommands({})) Command(command).AddFlagThroughout(name, value, help);
}

void Command::SetFooter(const std::string& text) const { app_->footer(text); }

Program::Program(const std::string& name, const std::string& description)
    : Program(std::make_unique<CLI::App>(description, name)) {}

Program::Program(std::unique_ptr<CLI::App> app) : Command(app.get()), owned_(std::move(app)) {}

Program::~Program() = default;

void Program::SetVersion(const std::string& text, const std::string& report) {
  app().set_version_flag("--version", text,
                         "Show the version; with --verbose, sources, compiler and libraries of the build");
  version_report_ = report;
}

}  // namespace legopt::app
