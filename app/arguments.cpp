#include "app/arguments.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cctype>
#include <cstddef>
#include <iostream>
#include <map>
#include <utility>
#include <vector>

#include "app/command_line.h"
#include "app/exit_codes.h"
#include "app/network_flags.h"
#include "app/printable.h"
#include "app/program_main.h"
#include "legopt/types/nearest_name.h"

namespace legopt::app {
namespace {

constexpr char kHelpFlag[] = "help";
constexpr char kVerboseFlag[] = "verbose";

std::string OneLine(std::string text) {
  std::replace(text.begin(), text.end(), '\n', ' ');
  return text;
}

// Returns "`--port` INT", "`ID` INT:[1 .. ]" or, for a flag, "`--yes`".
std::string NameOf(const CLI::Option& option) {
  std::string names = "`" + option.get_name(option.get_positional(), true) + "`";
  std::replace(names.begin(), names.end(), ',', ' ');
  if (option.get_items_expected_max() == 0) return names;
  return names + " " + option.get_type_name();
}

std::string MeaningOf(const CLI::Option& option) {
  std::string text = option.get_description();
  if (!option.get_default_str().empty()) text += " (default: " + option.get_default_str() + ")";
  if (option.get_required()) text += "; required";
  return OneLine(text);
}

class Writer {
 public:
  explicit Writer(const CLI::App& app) : app_(app), inherited_footer_(FooterOfCommands(app)) {}

  std::string Write() {
    Options("", app_);
    if (app_.get_subcommands({}).empty()) return text_ + NetworkOptions("##");
    for (const std::string& group : Groups(app_)) {
      text_ += "## " + group + "\n\n";
      for (const CLI::App* command : CommandsOf(app_, group)) Command(app_.get_name(), *command);
    }
    return text_ + NetworkOptions("##");
  }

 private:
  static std::vector<const CLI::App*> CommandsOf(const CLI::App& app, const std::string& group) {
    std::vector<const CLI::App*> commands;
    for (const CLI::App* command : app.get_subcommands({})) {
      if (command->get_group() == group) commands.push_back(command);
    }
    return commands;
  }

  // Returns the headings of the visible commands in order of appearance.
  static std::vector<std::string> Groups(const CLI::App& app) {
    std::vector<std::string> groups;
    for (const CLI::App* command : app.get_subcommands({})) {
      const std::string group = command->get_group();
      const bool seen = std::find(groups.begin(), groups.end(), group) != groups.end();
      if (!group.empty() && !seen) groups.push_back(group);
    }
    return groups;
  }

  static std::string FooterOfCommands(const CLI::App& app) {
    const auto commands = app.get_subcommands({});
    return commands.empty() ? app.get_footer() : commands.front()->get_footer();
  }

  void Command(const std::string& parent, const CLI::App& command) {
    const std::string path = parent + " " + command.get_name();
    text_ += "### " + path + "\n\n" + command.get_description() + ".\n\n";
    const std::string footer = command.get_footer();
    if (footer != inherited_footer_) text_ += OneLine(footer) + "\n\n";
    Options(path, command);
    for (const CLI::App* below : command.get_subcommands({})) Command(path, *below);
  }

  // Appends usage and tables of one command, and collects its network options.
  void Options(const std::string& path, const CLI::App& command) {
    std::string usage = path, rows, network;
    bool has_options = false;
    for (const CLI::Option* option : command.get_options()) {
      if (option->get_group().empty()) continue;
      if (option->get_group() == kNetworkHeading) {
        network += (network.empty() ? "`" : ", `") + option->get_name(false, true) + "`";
        const auto same = [option](const auto& known) { return known->get_name() == option->get_name(); };
        if (std::none_of(network_.begin(), network_.end(), same)) network_.push_back(option);
        continue;
      }
      if (option->check_lname(kHelpFlag) || option->check_lname(kVerboseFlag)) continue;
      const bool positional = option->get_positional();
      if (positional)
        usage += option->get_required() ? " " + option->get_name(true) : " [" + option->get_name(true) + "]";
      has_options = has_options || !positional;
      rows += "* " + NameOf(*option) + ": " + MeaningOf(*option) + "\n";
    }
    if (command.get_require_subcommand_min() > 0) usage += " COMMAND";
    if (!path.empty()) text_ += "    " + usage + (has_options || !network.empty() ? " [OPTIONS]" : "") + "\n\n";
    if (!rows.empty()) text_ += rows + "\n";
    if (!network.empty()) text_ += "[Network options](#network-options): " + network + ".\n\n";
  }

  std::string NetworkOptions(const std::string& level) const {
    if (network_.empty()) return "";
    std::string text = level + " Network options\n\n`--help-network` prints them.\n\n";
    for (const CLI::Option* option : network_) text += "* " + NameOf(*option) + ": " + MeaningOf(*option) + "\n";
    return text;
  }

  const CLI::App& app_;
  std::string inherited_footer_;
  std::string text_;
  std::vector<const CLI::Option*> network_;
};

}  // namespace

std::string CommandReference(const Program& program) { return Writer(program.app()).Write(); }

namespace {

constexpr int kDone = StatusOf(ExitCode::kOk);
constexpr int kWrongUsage = StatusOf(ExitCode::kUsage);
constexpr char kNetworkHelp[] = "--help-network";

using Words = std::vector<std::string>;

// Command named on a command line: "legopt dataset check ...".
struct NamedCommand {
  CLI::App* app = nullptr;
  std::string path;       // "legopt dataset check"
  std::size_t end = 0;    // index of the first word after the command's name
  bool complete = false;  // needs no further command
  std::string unknown;    // word that is not the name of a command
  std::string fault;      // fault of an option before a command
};

Words CommandNames(const CLI::App& app) {
  Words names;
  for (const auto* command : app.get_subcommands({})) names.push_back(command->get_name());
  return names;
}

bool IsOption(const std::string& word) {
  return word.size() > 1 && word[0] == '-' && word != "--" && std::isdigit(static_cast<unsigned char>(word[1])) == 0 &&
         word[1] != '.';
}

// Returns "--port" for "--port=7667", "-v" for "-vx".
std::string OptionName(const std::string& word) {
  return word.rfind("--", 0) == 0 ? word.substr(0, word.find('=')) : word.substr(0, 2);
}

std::string UnknownOption(const CLI::App& app, const std::string& word) {
  Words names;
  for (const auto* option : app.get_options()) {
    if (option->get_group().empty()) continue;  // hidden from users
    for (const auto& name : option->get_lnames()) names.push_back(name);
  }
  const std::string typed = word.substr(0, word.find('='));
  const std::string bare = typed.substr(std::min(typed.find_first_not_of('-'), typed.size()));
  constexpr std::string_view kFormats[] = {"csv", "json", "latex", "markdown", "text"};
  const bool has_formats = std::ranges::find(names, "format") != names.end();
  const std::string close = has_formats && std::ranges::find(kFormats, bare) != std::end(kFormats)
                                ? "format " + bare
                                : CloseName(bare, names);
  return "unknown option '" + typed + "'" + (close.empty() ? "" : "; did you mean '--" + close + "'?");
}

NamedCommand FindCommand(CLI::App& app, const Words& words) {
  NamedCommand command{&app, app.get_name(), 0, false, {}, {}};
  std::size_t next = 0;
  while (true) {
    const Words names = CommandNames(*command.app);
    command.complete = names.empty();
    for (; !command.complete && next < words.size() && IsOption(words[next]); ++next) {
      if (words[next] == kNetworkHelp || command.app->get_option_no_throw(OptionName(words[next])) != nullptr) continue;
      command.fault = UnknownOption(*command.app, words[next]);
      return command;
    }
    if (command.complete || next == words.size()) return command;
    if (std::find(names.begin(), names.end(), words[next]) == names.end()) {
      command.unknown = words[next];
      return command;
    }
    command.app = command.app->get_subcommand(words[next]);
    command.path += " " + words[next];
    command.end = ++next;
  }
}

bool WantsMore(const Words& words) {
  return std::any_of(words.begin(), words.end(), [](const auto& word) { return word == "--verbose" || word == "-v"; });
}

// Converts "help run" to "run --help". Only for the first word, because after an option "help" is the option's value.
Words WithoutHelpCommand(Words words) {
  if (words.empty()) return words;
  if (words.front() == "version") return WantsMore(words) ? Words{"--version", "--verbose"} : Words{"--version"};
  if (words.front() != "help") return words;
  words.erase(words.begin());
  words.emplace_back("--help");
  return words;
}

std::string UnknownCommand(const CLI::App& app, const NamedCommand& command, std::span<const Synonym> synonyms) {
  Words names;
  for (const auto* known : command.app->get_subcommands({})) {
    if (!known->get_group().empty()) names.push_back(known->get_name());
  }
  std::string typed = command.unknown;
  for (const auto& synonym : synonyms) {
    if (typed != synonym.typed) continue;
    const std::string successor = synonym.command;
    if (command.app == &app && successor.find(' ') != std::string::npos) {
      return "unknown command '" + typed + "'; use '" + app.get_name() + " " + successor + "'";
    }
    if (std::find(names.begin(), names.end(), successor) != names.end()) typed = successor;
  }
  return "unknown command '" + command.unknown + "'; " + SuggestName(typed, names);
}

// Checked before other errors, because a misspelt option also causes left-over arguments or a missing required one.
std::string FindUnknownOption(const NamedCommand& command, const Words& words) {
  for (std::size_t i = command.end; i < words.size() && words[i] != "--"; ++i) {
    if (!IsOption(words[i])) continue;
    const auto* option = command.app->get_option_no_throw(OptionName(words[i]));
    if (option == nullptr) return UnknownOption(*command.app, words[i]);
    const bool value_follows = option->get_items_expected_min() > 0 && words[i].find('=') == std::string::npos;
    if (value_follows) ++i;
  }
  return {};
}

// Returns the left-over arguments in the order in which they were typed; CLI11 uses another order.
std::string Unexpected(const CLI::App& app, const Words& words) {
  Words left = app.remaining(true), typed;
  for (const auto& word : words) {
    const auto found = std::find(left.begin(), left.end(), word);
    if (found == left.end()) continue;
    typed.push_back(word);
    left.erase(found);
  }
  std::string text = typed.size() == 1 ? "unexpected argument" : "unexpected arguments";
  for (std::size_t i = 0; i < typed.size(); ++i) text += (i == 0 ? " '" : ", '") + typed[i] + "'";
  return text;
}

// Converts "Could not convert: ID = abc" for an option without a check.
std::string NotConverted(const CLI::App& app, const std::string& words) {
  constexpr char kBegin[] = "Could not convert: ", kEquals[] = " = ";
  const std::size_t equals = words.find(kEquals);
  if (words.rfind(kBegin, 0) != 0 || equals == std::string::npos) return words;
  const std::string name = words.substr(sizeof(kBegin) - 1, equals - sizeof(kBegin) + 1);
  const std::string value = words.substr(equals + sizeof(kEquals) - 1);
  std::string kind = "cannot take this value";
  for (const auto* option : app.get_options()) {
    if (option->get_name() != name) continue;
    const std::string type = option->get_type_name();
    if (type.rfind("INT", 0) == 0) kind = "must be a whole number";
    if (type.rfind("UINT", 0) == 0) kind = "must be a whole number of at least 0";
    if (type.rfind("FLOAT", 0) == 0) kind = "must be a number";
  }
  return name + ": " + kind + " (got '" + value + "')";
}

std::string Explain(const CLI::App& app, const NamedCommand& command, const CLI::ParseError& error,
                    const Words& words) {
  const std::string kind = error.get_name(), what = error.what();
  if (error.get_exit_code() == static_cast<int>(CLI::ExitCodes::ExtrasError)) return Unexpected(app, words);
  if (kind == "ConversionError") return NotConverted(*command.app, what);
  constexpr char kRequired[] = " is required", kMissing[] = " missing";
  const auto ends_with = [&what](const std::string& end) {
    return what.size() > end.size() && what.compare(what.size() - end.size(), end.size(), end) == 0;
  };
  if (kind == "RequiredError" && ends_with(kRequired)) {
    return what.substr(0, what.size() - sizeof(kRequired) + 1) + " is missing";
  }
  if (kind == "ArgumentMismatch" && ends_with(kMissing)) return what.substr(0, what.find(':')) + " needs a value";
  if (kind == "ExcludesError") {
    constexpr char kExcludes[] = " excludes ";
    const std::size_t at = what.find(kExcludes);
    return what.substr(0, at) + " and " + what.substr(at + sizeof(kExcludes) - 1) + " exclude each other";
  }
  return what;
}

int WrongUsage(const CLI::App& app, const NamedCommand& command, const std::string& cause) {
  ReportError(app.get_name(), cause + "; see '" + command.path + " --help'");
  return kWrongUsage;
}

int Print(const CLI::App& app, const std::string& text, int status) {
  std::cout << text << std::flush;
  if (std::cout) return status;
  ReportError(app.get_name(), OutputFault());
  return kWrongUsage;
}

bool IsNetworkOption(const CLI::Option& option) { return option.get_group() == kNetworkHeading; }

// Hides the options that satisfy `condition` from the help. The program ends after its help, so nothing restores them.
void HideOptions(CLI::App& app, bool (*condition)(const CLI::Option&)) {
  for (CLI::Option* option : app.get_options()) {
    if (condition(*option)) option->group("");
  }
}

std::string HelpOf(const CLI::App& app, const NamedCommand& command) {
  const auto options = command.app->get_options();
  if (std::any_of(options.begin(), options.end(), [](const auto* option) { return IsNetworkOption(*option); })) {
    command.app->add_flag_callback(
        kNetworkHelp, [] {}, "Print the network options and exit");
    HideOptions(*command.app, IsNetworkOption);
  }
  const std::string path = command.path.substr(0, command.path.rfind(' '));
  return command.app->help(command.app == &app ? "" : path);
}

// Returns the help of the network options of the command.
std::string NetworkHelpOf(const NamedCommand& command) {
  const auto options = command.app->get_options();
  if (std::none_of(options.begin(), options.end(), [](const auto* option) { return IsNetworkOption(*option); })) {
    return "'" + command.path + "' has no network options\n";
  }
  HideOptions(*command.app, [](const CLI::Option& option) { return !IsNetworkOption(option); });
  command.app->footer("");
  const std::string help = command.app->help();
  return "Options of '" + command.path + "'\n\n" + help.substr(help.find(std::string(kNetworkHeading) + ":"));
}

}  // namespace

std::optional<int> ParseCommandLine(const Program& program, int argc, const char* const* argv,
                                    std::span<const Synonym> synonyms) {
  CLI::App& app = program.app();
  const Words typed(argv + std::min(argc, 1), argv + argc);
  if (typed == Words{"help", "--markdown"}) return Print(app, CommandReference(program), kDone);
  const Words words = WithoutHelpCommand(typed);
  const NamedCommand command = FindCommand(app, words);
  if (!command.fault.empty()) return WrongUsage(app, command, command.fault);
  if (!command.unknown.empty()) return WrongUsage(app, command, UnknownCommand(app, command, synonyms));
  if (std::find(words.begin(), words.end(), kNetworkHelp) != words.end()) {
    return Print(app, NetworkHelpOf(command), kDone);
  }
  const bool asks = std::any_of(words.begin(), words.end(), [](const auto& word) {
    return word == "--help" || word == "-h" || word == "--version";
  });
  if (const std::string fault = FindUnknownOption(command, words); !fault.empty()) {
    return WrongUsage(app, command, fault);
  }
  if (!command.complete && !asks) return Print(app, HelpOf(app, command), kWrongUsage);
  try {
    app.parse(Words(words.rbegin(), words.rend()));
  } catch (const CLI::CallForHelp&) {
    return Print(app, HelpOf(app, command), kDone);
  } catch (const CLI::CallForVersion&) {
    return Print(app, (WantsMore(words) ? program.version_report() : app.version()) + "\n", kDone);
  } catch (const CLI::ParseError& error) {
    return WrongUsage(app, command, Explain(app, command, error, words));
  }
  return std::nullopt;
}

void ReportError(const std::string& program, const std::string& message) {
  std::cout.exceptions(std::ios_base::goodbit);  // this error is reported, not one of standard output
  std::cout.flush();
  std::cerr << program << ": error: " << Printable(message) << std::endl;
}

void ReportError(const std::string& program, const InputError& error) {
  for (const InputError::Fault& fault : error.faults()) ReportError(program, InputError::TextOf(fault));
}

}  // namespace legopt::app
