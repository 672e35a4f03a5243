#include "client/benchmark/benchmark_file.h"

#include <map>
#include <set>
#include <utility>

#include "app/data_folder.h"
#include "client/suite/yaml_map.h"
#include "legopt/input/yaml.h"
#include "legopt/math/blake2b.h"
#include "legopt/types/input_error.h"

namespace legopt::client {
namespace {

template <NamedEnum Enum>
Enum WordOf(const YAML::Node& node, const std::string& file, const std::string& field) {
  const std::string word = YamlString(node, file, field);
  if (const auto value = ParseEnum<Enum>(word)) return *value;
  std::string words;
  for (const auto& [value, name] : kEnumNames<Enum>) words += (words.empty() ? "" : ", ") + std::string(name);
  throw YamlFault(file, node, field, "'" + word + "' is unknown", "use one of: " + words);
}

BenchmarkSet SetOf(const YAML::Node& node, const std::string& file, const std::string& path) {
  const YamlMap map(node, file, path, {"dataset", "hash", "tasks"});
  BenchmarkSet set;
  set.dataset = map.Name("dataset");
  set.hash = map.String("hash");
  if (!IsBlake2bHex(set.hash)) {
    throw YamlFault(file, map.Get("hash"), map.Path("hash"), "must have 64 hex digits",
                    "'legopt dataset info FOLDER' prints it");
  }
  for (const YAML::Node& task : map.List("tasks")) set.tasks.push_back(WordOf<Task>(task, file, map.Path("tasks")));
  return set;
}

BenchmarkTier TierOf(const YAML::Node& node, const std::string& file, const std::string& path) {
  const YamlMap map(node, file, path, {"id", "title", "question", "rule", "infeasible", "sets"});
  BenchmarkTier tier;
  tier.id = map.Name("id");
  if (tier.id.find_first_not_of("abcdefghijklmnopqrstuvwxyz0123456789-") != std::string::npos) {
    throw YamlFault(file, map.Get("id"), map.Path("id"), "'" + tier.id + "' has other characters than a-z, 0-9 and '-'",
                    "choose a short word; it is part of addresses");
  }
  tier.title = map.Name("title");
  tier.question = map.String("question");
  tier.rule = WordOf<Rule>(map.Get("rule"), file, map.Path("rule"));
  tier.infeasible = map.Has("infeasible") && map.Boolean("infeasible");
  const std::vector<YAML::Node> sets = map.List("sets");
  for (std::size_t i = 0; i < sets.size(); ++i) tier.sets.push_back(SetOf(sets[i], file, map.Path("sets", i)));
  return tier;
}

}  // namespace

Benchmark ReadBenchmark(const std::filesystem::path& file) {
  const YAML::Node node = ReadYamlFile(file);
  const YamlMap map(node, file.string(), "", {"name", "edition", "about", "tiers"});
  Benchmark benchmark;
  benchmark.name = map.Name("name");
  benchmark.edition = map.Name("edition");
  benchmark.about = map.String("about");
  const std::vector<YAML::Node> tiers = map.List("tiers");
  std::set<std::string> ids;
  std::set<std::pair<std::string, Task>> problems;
  std::map<std::string, Rule> rules;
  for (std::size_t i = 0; i < tiers.size(); ++i) {
    const std::string path = map.Path("tiers", i);
    benchmark.tiers.push_back(TierOf(tiers[i], map.file(), path));
    const BenchmarkTier& tier = benchmark.tiers.back();
    if (!ids.insert(tier.id).second) {
      throw YamlFault(map.file(), tiers[i], path, "'" + tier.id + "' is the id of two tiers", "rename one");
    }
    for (const BenchmarkSet& set : tier.sets) {
      const auto [known, fresh] = rules.emplace(set.hash, tier.rule);
      if (!fresh && known->second != tier.rule) {
        throw YamlFault(map.file(), tiers[i], path, "another tier judges " + set.dataset + " by another rule",
                        "give tiers with one dataset one rule, by which the pages of its archives count");
      }
      for (const Task task : set.tasks) {
        if (problems.emplace(set.hash, task).second) continue;
        throw YamlFault(map.file(), tiers[i], path,
                        "the " + std::string(ToString(task)) + " problems of " + set.dataset + " are listed twice",
                        "each belongs to one tier");
      }
    }
  }
  return benchmark;
}

std::filesystem::path EmbeddedBenchmark() { return app::DataFolder() / "benchmark.yaml"; }

}  // namespace legopt::client
