#include "client/report/method_choice.h"

#include <algorithm>
#include <cctype>
#include <utility>

#include "app/value_list.h"
#include "client/client_error.h"
#include "legopt/types/experiment.h"
#include "legopt/types/nearest_name.h"

namespace legopt::client {
namespace {

using Figures = std::vector<std::pair<std::string, std::string>>;

std::string LowerCase(std::string text) {
  for (char& c : text) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return text;
}

bool EqualNames(const std::string& a, const std::string& b) { return LowerCase(a) == LowerCase(b); }

// Returns the properties that distinguish methods of the same name, the id last.
Figures FiguresOf(const MethodIdentity& method) {
  return {{"multi_starts", std::to_string(method.multi_starts)},
          {"sample_size", std::to_string(method.sample_size)},
          {"incremental", method.incremental ? "yes" : "no"},
          {"collision", std::string(ToString(method.collision))},
          {"id", std::to_string(method.method_id)}};
}

// Throws for an unknown key.
bool HasFigures(const MethodIdentity& method, const Figures& wanted) {
  const Figures mine = FiguresOf(method);
  return std::all_of(wanted.begin(), wanted.end(), [&](const auto& figure) {
    const auto found =
        std::find_if(mine.begin(), mine.end(), [&](const auto& known) { return known.first == figure.first; });
    if (found != mine.end()) return EqualNames(found->second, figure.second);
    std::vector<std::string> keys;
    for (const auto& known : mine) keys.push_back(known.first);
    throw ClientError(ExitCode::kUsage,
                      "'" + figure.first + "' tells no methods apart; " + SuggestName(figure.first, keys));
  });
}

struct NamedFigures {
  std::string name;
  Figures figures;
};

// Parses e.g. "SQP:multi_starts=10,collision=solid". Throws for a part without "=".
NamedFigures ReadChoice(const std::string& text) {
  const std::size_t colon = text.rfind(':');
  NamedFigures read{text.substr(0, colon), {}};
  for (const std::string& figure : app::SplitValues(text.substr(colon + 1))) {
    const std::size_t equals = figure.find('=');
    if (equals == std::string::npos) {
      throw ClientError(ExitCode::kUsage,
                        "'" + text + "': '" + figure + "' is no figure of a method; write it as NAME:multi_starts=10");
    }
    read.figures.emplace_back(figure.substr(0, equals), figure.substr(equals + 1));
  }
  return read;
}

// Returns std::nullopt for a text that is no name with properties.
std::optional<NamedFigures> TryReadChoice(const std::string& text) {
  if (text.find(':') == std::string::npos) return std::nullopt;
  try {
    return ReadChoice(text);
  } catch (const ClientError&) {
    return std::nullopt;
  }
}

std::vector<MethodIdentity> OfName(const std::string& name, std::span<const MethodIdentity> methods) {
  std::vector<MethodIdentity> found;
  for (const MethodIdentity& method : methods) {
    if (IsMethodName(method.name, name)) found.push_back(method);
  }
  // A method with exactly this name has priority over one with an additional mark.
  const auto exact = [&name](const MethodIdentity& method) { return EqualNames(method.name, name); };
  if (std::any_of(found.begin(), found.end(), exact)) std::erase_if(found, std::not_fn(exact));
  return found;
}

std::string Choices(const std::vector<MethodIdentity>& some, std::span<const MethodIdentity> all) {
  std::string text;
  for (const MethodIdentity& method : some) text += (text.empty() ? "'" : ", '") + ChoiceOf(method, all) + "'";
  return text;
}

}  // namespace

MethodIdentity MethodAt(const Listing& cells, std::size_t row) {
  MethodIdentity method;
  method.method_id = cells.At(row, "method_id").get<std::int64_t>();
  method.name = cells.Text(row, "name");
  method.multi_starts = cells.At(row, "multi_starts").get<std::int64_t>();
  method.inner_starts = cells.At(row, "inner_starts").get<std::int64_t>();
  method.sample_size = cells.At(row, "sample_size").get<std::int64_t>();
  method.incremental = cells.At(row, "incremental").get<int>() != 0;
  method.collision = cells.EnumAt<SceneRepresentation>(row, "collision");
  method.hash = cells.Text(row, "hash");
  return method;
}

std::string ChoiceOf(const MethodIdentity& method, std::span<const MethodIdentity> methods) {
  std::vector<MethodIdentity> rivals = OfName(method.name, methods);
  std::string text;
  for (const auto& figure : FiguresOf(method)) {
    if (rivals.size() < 2) break;
    const auto left = std::erase_if(rivals, [&](const MethodIdentity& rival) { return !HasFigures(rival, {figure}); });
    if (left > 0) text += (text.empty() ? ":" : ",") + figure.first + "=" + figure.second;
  }
  return method.name + text;
}

bool IsMethodChoice(const std::string& text, std::span<const MethodIdentity> methods) {
  if (!OfName(text, methods).empty()) return true;
  const std::optional<NamedFigures> wanted = TryReadChoice(text);
  return wanted && !OfName(wanted->name, methods).empty();
}

std::vector<MethodIdentity> FindMethods(const std::string& text, std::span<const MethodIdentity> methods) {
  std::vector<MethodIdentity> found = OfName(text, methods);  // a name may contain a colon itself
  if (!found.empty() || text.find(':') == std::string::npos) return found;
  const NamedFigures wanted = ReadChoice(text);
  const std::vector<MethodIdentity> named = OfName(wanted.name, methods);
  found = named;
  std::erase_if(found, [&](const MethodIdentity& method) { return !HasFigures(method, wanted.figures); });
  if (found.empty() && !named.empty()) {
    throw ClientError(ExitCode::kUsage,
                      "no '" + wanted.name + "' is like '" + text + "'; there is " + Choices(named, methods));
  }
  return found;
}

std::optional<MethodIdentity> FindMethod(const std::string& text, std::span<const MethodIdentity> methods) {
  const std::vector<MethodIdentity> found = FindMethods(text, methods);
  if (found.size() > 1) {
    throw ClientError(ExitCode::kUsage, "'" + text + "' names " + std::to_string(found.size()) +
                                            " methods; say which: " + Choices(found, methods));
  }
  return found.empty() ? std::nullopt : std::optional(found.front());
}

MethodIdentity ChooseMethod(const std::string& text, std::span<const MethodIdentity> methods,
                            std::int64_t experiment_id) {
  if (const auto found = FindMethod(text, methods)) return *found;
  throw ClientError(ExitCode::kUsage, "experiment " + std::to_string(experiment_id) + " has no method '" + text +
                                          "'; " + SuggestMethod(text, methods));
}

std::string SuggestMethod(const std::string& text, std::span<const MethodIdentity> methods) {
  std::vector<std::string> choices;
  for (const MethodIdentity& method : methods) choices.push_back(ChoiceOf(method, methods));
  return SuggestName(text, choices);
}

}  // namespace legopt::client
