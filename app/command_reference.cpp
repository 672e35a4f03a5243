#include "app/command_reference.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <map>
#include <utility>
#include <vector>

#include "app/command_line.h"
#include "app/network_flags.h"

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

}  // namespace legopt::app
