// Hidden command that prints facts for generated documents, as JSON: options of solvers and columns of results.

#include <cmath>
#include <cstdint>
#include <iostream>
#include <nlohmann/json.hpp>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "app/command_line.h"
#include "client/commands/commands.h"
#include "db/result_record.h"
#include "legopt/input/json.h"
#include "legopt/solvers/methods/method.h"

namespace legopt::client {
namespace {

using Json = nlohmann::ordered_json;

// Describes each visited option: key, type, default and range.
class OptionLister : public ConstOptionFields {
 public:
  void Number(const char* key, const double& value, double low, double high) override {
    options_.push_back({{"key", key}, {"type", "number"}, {"default", value}, {"least", low}, {"most", high}});
  }
  void Integer(const char* key, const int& value, int low, int high) override {
    options_.push_back({{"key", key}, {"type", "integer"}, {"default", value}, {"least", low}, {"most", high}});
  }
  void Boolean(const char* key, const bool& value) override {
    options_.push_back({{"key", key}, {"type", "boolean"}, {"default", value}});
  }
  void Digest(const char* key, const std::string& /*value*/) override {
    options_.push_back({{"key", key}, {"type", "digest"}});
  }
  void Require(bool, const char*, const char*, const std::string&, const std::string&, const std::string&) override {}

  const Json& options() const { return options_; }

 protected:
  void Word(const char* key, const std::size_t& index, std::span<const std::string_view> words) override {
    options_.push_back({{"key", key}, {"type", "choice"}, {"default", words[index]}, {"choices", words}});
  }

 private:
  Json options_ = Json::array();
};

Json SolversJson() {
  Json solvers = Json::array();
  for (const SolverEntry& entry : SolverRegistry()) {
    OptionLister fields;
    entry.defaults.Visit(fields);
    solvers.push_back({{"solver", entry.word},
                       {"name", entry.paper_name},
                       {"contact_range_m", entry.contact_range_m},
                       {"options", fields.options()}});
  }
  return solvers;
}

// Returns the keys and options of every method: those that are not the solver's.
Json CommonJson() {
  const Method defaults;
  OptionLister all, of_solver;
  defaults.Visit(all);
  defaults.options.Visit(of_solver);
  std::set<std::string> known;
  for (const Json& option : of_solver.options()) known.insert(option.at("key").get<std::string>());
  Json common = Json::array();
  for (const Json& option : all.options()) {
    if (!known.contains(option.at("key").get<std::string>())) common.push_back(option);
  }
  return common;
}

template <class Value>
constexpr const char* ColumnType() {
  if constexpr (std::is_same_v<Value, double>) return "REAL";
  if constexpr (std::is_integral_v<Value>) return "INTEGER";
  if constexpr (std::is_same_v<Value, std::vector<std::uint8_t>>) return "BLOB";
  return "TEXT";
}

Json ResultColumnsJson() {
  Json columns = Json::array();
  db::ForEachResultColumn([&columns]<class Value>(const db::ResultColumn<Value>& column) {
    Json json = {{"column", column.name}, {"type", ColumnType<Value>()}, {"also_stale", column.also_stale}};
    if (std::isfinite(column.least)) json["least"] = column.least;
    if (std::isfinite(column.most)) json["most"] = column.most;
    json["may_be_null"] = column.is_null != nullptr || std::is_same_v<Value, double>;
    columns.push_back(std::move(json));
  });
  return columns;
}

Json ChecksJson() {
  Json checks = Json::array();
  for (const CheckDescription& check : kChecks) {
    Json measures = Json::object();
    for (const auto& [rule, name] : kEnumNames<Rule>) {
      const std::string_view measure = check.measures.at(EnumNumber(rule));
      if (!measure.empty()) measures[std::string(name)] = measure;
    }
    checks.push_back({{"check", check.name},
                      {"constraint", check.constraint},
                      {"unit", check.unit},
                      {"tolerance", ToleranceText(check)},
                      {"measures", std::move(measures)},
                      {"drawing", ToString(check.drawing)}});
  }
  return checks;
}

}  // namespace

void AddReferenceCommand(const app::Command& program, Invocation* invocation) {
  const auto command = program.AddCommand("reference", "Print facts for generated documents as JSON");
  command.WhenChosen([=] {
    invocation->body = [] {
      const Json facts = {{"common", CommonJson()},
                          {"contact_range_m", Method().contact_range_m},
                          {"solvers", SolversJson()},
                          {"result_columns", ResultColumnsJson()},
                          {"checks", ChecksJson()}};
      std::cout << Dump(facts, 2) << "\n";
      return ExitCode::kOk;
    };
  });
}

}  // namespace legopt::client
