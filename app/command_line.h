#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "app/value_list.h"
#include "legopt/types/enum_names.h"

namespace legopt::app {

/// Check of an option's value. The error contains the option, the permitted values, and the given one: "--workers: must
/// be a whole number from 1 to 1024 (got 'many')".
struct ValueCheck {
  std::function<std::string(const std::string& word)> fault;  ///< returns the fault of a word as typed; empty: none
  std::string range;                                          ///< shown in the help after the option; empty: nothing
};

/// Check for a decimal integer in [low, high]; without `high`, the error says "of at least LOW".
ValueCheck WholeNumber(std::int64_t low, std::int64_t high = std::numeric_limits<std::int64_t>::max());

/// Check for a finite number in [low, high].
ValueCheck Number(double low, double high);

/// Check for one of some words; the error contains the nearest one.
ValueCheck OneOf(std::vector<std::string> words);

/// Returns the names of an enumeration, in its order.
template <NamedEnum Enum>
std::vector<std::string> EnumNamesOf() {
  std::vector<std::string> words;
  for (const EnumName<Enum>& row : kEnumNames<Enum>) words.emplace_back(row.word);
  return words;
}

/// Returns the names of an enumeration with their enumerators, for Command::AddChoice.
template <NamedEnum Enum>
std::vector<std::pair<std::string, Enum>> EnumChoicesOf() {
  std::vector<std::pair<std::string, Enum>> choices;
  for (const EnumName<Enum>& row : kEnumNames<Enum>) choices.emplace_back(row.word, row.value);
  return choices;
}

/// Returns "a, b or c".
std::string Alternatives(const std::vector<std::string>& words);
/// Returns "a, b, c".
std::string Joined(const std::vector<std::string>& words);

}  // namespace legopt::app

namespace CLI {
class App;
class Option;
}  // namespace CLI

/// Definition of a program's command line: commands, options bound to variables, checks of their values, help. Hides
/// the library CLI11, whose headers take seconds to compile in each file that includes them. Not thread-safe.
namespace legopt::app {

/// Handle of an option, for further settings: `command.AddOption(...).Required().Check(WholeNumber(1))`. Valid as long
/// as its Program.
class Option {
 public:
  explicit Option(CLI::Option* option) : option_(option) {}

  Option Required() const;
  /// Adds a check. Checks run in the order in which they were added.
  Option Check(ValueCheck check) const;
  /// Sets the heading of the option in the help; empty: hidden.
  Option Group(const std::string& heading) const;
  /// Sets the placeholder of the value in the help, e.g. "WORD".
  Option ValueName(const std::string& name) const;
  /// Each use of an option with several values takes one argument, so that it does not consume the following ones.
  Option OneArgumentEach() const;
  /// Makes the value optional; the default is `value`.
  Option ValueMayBeLeftOut(const std::string& value) const;
  /// Shows the current value of the variable in the help.
  Option ShowDefault() const;
  Option Excludes(Option other) const;
  /// The other option must also be given.
  Option Needs(Option other) const;

 private:
  CLI::Option* option_;
};

/// Handle of a command, or of the program itself. Valid as long as its Program. Variables bound to options must outlive
/// parsing.
class Command {
 public:
  explicit Command(CLI::App* app) : app_(app) {}

  /// Adds an option "--name" or "-n,--name", or a positional argument "NAME". `Value` is int, std::int64_t,
  /// std::uint64_t, double, std::string, std::filesystem::path, or a std::optional or std::vector of one (if
  /// command_line.cpp instantiates it).
  template <class Value>
  Option AddOption(const std::string& name, Value& value, const std::string& help) const;
  /// Adds a list option: values separated by commas (value_list.h), in one or several uses of the flag. `check` tests
  /// each value.
  Option AddList(const std::string& name, std::vector<std::string>& values, const std::string& help,
                 const IsWholeValue& is_whole = {}, const ValueCheck& check = {}) const;
  /// Adds an option whose value is ignored.
  Option AddOption(const std::string& name, const std::string& help) const;
  Option AddFlag(const std::string& name, bool& value, const std::string& help) const;
  /// Adds an option; `action` is called with its word during parsing.
  Option AddAction(const std::string& name, const std::function<void(const std::string&)>& action,
                   const std::string& help) const;
  Option AddFlagAction(const std::string& name, std::function<void()> action, const std::string& help) const;
  /// Adds an option with one of `choices` as value; the error contains the nearest one. The help does not list them.
  template <class Choice>
  Option AddChoice(const std::string& name, Choice& value, const std::string& help,
                   std::vector<std::pair<std::string, Choice>> choices) const;
  /// Adds an option with the name of an enumerator as value, restricted by `check`. `value` is an Enum, or a
  /// std::optional of one.
  template <NamedEnum Enum, class Value>
  Option AddEnum(const std::string& name, Value& value, const std::string& help,
                 ValueCheck check = OneOf(EnumNamesOf<Enum>())) const;

  Command AddCommand(const std::string& name, const std::string& help) const;
  /// Sets the heading in the help of all commands added since the last call; empty: hidden.
  void GroupCommands(const std::string& heading) const;
  /// `action` is called at the end of parsing if this command was chosen.
  void WhenChosen(std::function<void()> action) const;
  /// Requires one of its commands.
  void RequireCommand() const;
  /// Permits its options also after the name of one of its commands.
  void LetOptionsFollowCommands() const;
  /// Adds a flag to this command and all below it.
  void AddFlagThroughout(const std::string& name, bool& value, const std::string& help) const;
  /// Sets the text below the help. Commands that are added later inherit it.
  void SetFooter(const std::string& text) const;

  /// For app::ParseCommandLine.
  CLI::App& app() const { return *app_; }

 private:
  Option AddChosen(const std::string& name, std::vector<std::string> words, std::function<void(std::size_t)> choose,
                   const std::string& help) const;

  CLI::App* app_;
};

/// Command line of a whole program.
class Program : public Command {
 public:
  Program(const std::string& name, const std::string& description);
  ~Program();
  Program(const Program&) = delete;
  Program& operator=(const Program&) = delete;

  /// Sets the outputs of --version and "version": `text`, and with --verbose `report`.
  void SetVersion(const std::string& text, const std::string& report);
  const std::string& version_report() const { return version_report_; }

 private:
  explicit Program(std::unique_ptr<CLI::App> app);

  std::unique_ptr<CLI::App> owned_;
  std::string version_report_;
};

template <class Choice>
Option Command::AddChoice(const std::string& name, Choice& value, const std::string& help,
                          std::vector<std::pair<std::string, Choice>> choices) const {
  std::vector<std::string> words;
  for (const auto& choice : choices) words.push_back(choice.first);
  const auto choose = [&value, choices = std::move(choices)](std::size_t chosen) { value = choices[chosen].second; };
  return AddChosen(name, std::move(words), choose, help);
}

template <NamedEnum Enum, class Value>
Option Command::AddEnum(const std::string& name, Value& value, const std::string& help, ValueCheck check) const {
  const auto take = [&value](const std::string& word) {
    if (const auto parsed = ParseEnum<Enum>(word)) value = *parsed;
  };
  return AddAction(name, take, help).Check(std::move(check));
}

}  // namespace legopt::app
