#include "client/report/method_filter.h"

#include <algorithm>
#include <cctype>
#include <set>
#include <string_view>

#include "app/checks.h"
#include "app/command_line.h"
#include "client/client_error.h"
#include "db/named_queries.h"
#include "legopt/input/json.h"
#include "legopt/types/method_name.h"
#include "legopt/types/nearest_name.h"

namespace legopt::client {
namespace {

std::string Lower(std::string text) {
  for (char& c : text) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return text;
}

// Returns a cell as users write it.
std::string TextOf(const nlohmann::json& cell) { return cell.is_string() ? cell.get<std::string>() : Dump(cell); }

struct Wanted {
  const char* column = nullptr;
  const char* flag = nullptr;
  std::optional<std::string> value;
};

std::optional<std::string> TextOf(const std::optional<std::int64_t>& number) {
  return number ? std::optional(std::to_string(*number)) : std::nullopt;
}

std::optional<std::string> TextOf(const std::optional<SceneRepresentation>& model) {
  return model ? std::optional(std::string(ToString(*model))) : std::nullopt;
}

}  // namespace

void AddMethodFilterOptions(const app::Command& command, MethodFilter* filter) {
  constexpr std::int64_t kMost = 1'000'000;
  command.AddOption("--method", filter->method, "Only methods of this name");
  command.AddOption("--multi-starts", filter->multi_starts, "Only methods with this number of restarts")
      .Check(app::WholeNumber(0, kMost));
  command.AddOption("--sample-size", filter->sample_size, "Only methods with this sample size, in percent")
      .Check(app::WholeNumber(1, 100));
  AddCollisionOption(command, &filter->collision);
}

void AddCollisionOption(const app::Command& command, std::optional<SceneRepresentation>* collision) {
  using app::Alternatives, app::EnumNamesOf;
  command.AddEnum<SceneRepresentation>(
      "--collision", *collision, "Only methods with this model: " + Alternatives(EnumNamesOf<SceneRepresentation>()));
}

ExperimentMethods::ExperimentMethods(ResultSource& source, std::int64_t experiment_id)
    : methods_(source.Query(db::Sql(db::Query::kMethodsOfExperiment, {{"experiment_id", experiment_id}}))),
      experiment_id_(experiment_id) {}

// Applies the flags one by one, so that an error names the flag without matches and the values remaining at that point.
std::vector<std::int64_t> ExperimentMethods::Ids(const MethodFilter& filter) const {
  std::vector<std::size_t> kept(methods_.rows.size());
  for (std::size_t i = 0; i < kept.size(); ++i) kept[i] = i;
  const Wanted wanted[] = {{"method", "--method", filter.method},
                           {"multi_starts", "--multi-starts", TextOf(filter.multi_starts)},
                           {"sample_size", "--sample-size", TextOf(filter.sample_size)},
                           {"collision", "--collision", TextOf(filter.collision)}};
  std::string so_far;
  for (const auto& [column, flag, value] : wanted) {
    if (!value) continue;
    std::vector<std::string> known;
    std::vector<std::size_t> fitting;
    for (const std::size_t row : kept) {
      const std::string text = TextOf(methods_.At(row, column));
      if (std::find(known.begin(), known.end(), text) == known.end()) known.push_back(text);
      const bool is_name = std::string_view(column) == "method";
      if (is_name ? IsMethodName(text, *value) : Lower(text) == Lower(*value)) fitting.push_back(row);
    }
    if (fitting.empty()) {
      throw ClientError(ExitCode::kUsage, std::string(flag) + " " + *value + ": experiment " +
                                              std::to_string(experiment_id_) + " has no such method" + so_far + "; " +
                                              SuggestName(*value, known));
    }
    kept = std::move(fitting);
    so_far += std::string(so_far.empty() ? " among those of " : ", ") + flag + " " + *value;
  }
  if (so_far.empty()) return {};
  std::vector<std::int64_t> ids;
  for (const std::size_t row : kept) ids.push_back(methods_.At(row, "method_id").get<std::int64_t>());
  return ids;
}

std::vector<std::string> ExperimentMethods::DistinguishingColumns() const {
  std::vector<std::string> columns;
  for (const char* column : {"multi_starts", "sample_size", "incremental", "collision"}) {
    std::set<std::string> names, values;
    for (std::size_t i = 0; i < methods_.rows.size(); ++i) {
      names.insert(TextOf(methods_.At(i, "method")));
      values.insert(TextOf(methods_.At(i, "method")) + '\0' + TextOf(methods_.At(i, column)));
    }
    if (values.size() > names.size()) columns.emplace_back(column);
  }
  return columns;
}

}  // namespace legopt::client
