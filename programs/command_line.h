#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "programs/checks.h"
#include "programs/value_list.h"
#include "words/words.h"

namespace CLI {
class App;
class Option;
}  // namespace CLI

/// What a program takes on its command line: commands, options bound to variables, checks of their values, help. The
/// library behind it, CLI11, stays out of sight: its headers cost seconds in each file that sees them. Not thread-safe.
namespace legopt::programs {

/// Handle of an option, to say more about it: `command.AddOption(...).Required().Check(WholeNumber(1))`. Valid as long
/// as its Program.
class Option {
 public:
  explicit Option(CLI::Option* option) : option_(option) {}

  Option Required() const;
  /// In the order in which they were added.
  Option Check(ValueCheck check) const;
  /// The heading that it stands under in the help; empty: people are not told of it.
  Option Group(const std::string& heading) const;
  /// What the help shows for its value, e.g. "WORD".
  Option ValueName(const std::string& name) const;
  /// Of several values: each use of the flag takes one argument, so that it does not swallow the next ones.
  Option OneArgumentEach() const;
  /// Its value may be left out and is `value` then.
  Option ValueMayBeLeftOut(const std::string& value) const;
  /// The help shows the value that the variable has now.
  Option ShowDefault() const;
  Option Excludes(Option other) const;
  /// The other option has to be given beside it.
  Option Needs(Option other) const;

 private:
  CLI::Option* option_;
};

/// Handle of a command, or of the program itself. Valid as long as its Program. What an option is bound to must outlive
/// the parse.
class Command {
 public:
  explicit Command(CLI::App* app) : app_(app) {}

  /// "--name", "-n,--name", or "NAME" for an argument by its place. `Value` is int, std::int64_t, std::uint64_t,
  /// double, std::string, std::filesystem::path, or a std::optional or std::vector of one (as far as command_line.cpp
  /// instantiates it).
  template <class Value>
  Option AddOption(const std::string& name, Value& value, const std::string& help) const;
  /// A list: values with commas between them (value_list.h), in one use of the flag or several. `check` tests each
  /// value.
  Option AddList(const std::string& name, std::vector<std::string>& values, const std::string& help,
                 const IsWholeValue& is_whole = {}, const ValueCheck& check = {}) const;
  /// One whose value nobody wants.
  Option AddOption(const std::string& name, const std::string& help) const;
  Option AddFlag(const std::string& name, bool& value, const std::string& help) const;
  /// `action` is called with the word that was typed, during the parse.
  Option AddAction(const std::string& name, const std::function<void(const std::string&)>& action,
                   const std::string& help) const;
  Option AddFlagAction(const std::string& name, std::function<void()> action, const std::string& help) const;
  /// One of `choices`; the error names the nearest one. The help does not list them.
  template <class Choice>
  Option AddChoice(const std::string& name, Choice& value, const std::string& help,
                   std::vector<std::pair<std::string, Choice>> choices) const;
  /// The word of an enumerator, which `check` lets pass. `value` is an Enum, or a std::optional of one.
  template <Worded Enum, class Value>
  Option AddWord(const std::string& name, Value& value, const std::string& help,
                 ValueCheck check = OneOf(WordsOf<Enum>())) const;

  Command AddCommand(const std::string& name, const std::string& help) const;
  /// `action` is called at the end of a parse that chose this command.
  void WhenChosen(std::function<void()> action) const;
  /// One of its commands has to be given.
  void RequireCommand() const;
  /// Its options may also stand behind the name of a command of its own.
  void LetOptionsFollowCommands() const;
  /// A flag of this command and of all below it.
  void AddFlagThroughout(const std::string& name, bool& value, const std::string& help) const;
  /// Below the help. Commands that are added later inherit it.
  void SetFooter(const std::string& text) const;

  /// For programs::ParseCommandLine.
  CLI::App& app() const { return *app_; }

 private:
  Option AddChosen(const std::string& name, std::vector<std::string> words, std::function<void(std::size_t)> choose,
                   const std::string& help) const;

  CLI::App* app_;
};

/// The command line of a whole program.
class Program : public Command {
 public:
  Program(const std::string& name, const std::string& description);
  ~Program();
  Program(const Program&) = delete;
  Program& operator=(const Program&) = delete;

  /// What --version and "version" print, and, with --verbose besides, what they print then.
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

template <Worded Enum, class Value>
Option Command::AddWord(const std::string& name, Value& value, const std::string& help, ValueCheck check) const {
  const auto take = [&value](const std::string& word) {
    if (const auto parsed = ParseWord<Enum>(word)) value = *parsed;
  };
  return AddAction(name, take, help).Check(std::move(check));
}

}  // namespace legopt::programs
