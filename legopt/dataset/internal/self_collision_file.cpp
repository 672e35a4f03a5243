#include "legopt/dataset/internal/self_collision_file.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <set>
#include <utility>
#include <vector>

#include "legopt/types/nearest_name.h"

namespace legopt {
namespace {

constexpr const char* kRow = "write [LINK, LINK, REASON], e.g. [pelvis, l_thigh, adjacent]";

template <class Enum>
std::vector<std::string> WordsOf() {
  std::vector<std::string> words;
  for (const EnumName<Enum>& row : kEnumNames<Enum>) words.emplace_back(row.word);
  return words;
}

DatasetDescription::LinkNames ReadRow(const YamlFields& fields, const std::string& key, const YAML::Node& row) {
  const bool scalars = row.IsSequence() && row.size() == 3 &&
                       std::all_of(row.begin(), row.end(),
                                   [](const YAML::Node& node) { return node.IsScalar() && !node.Scalar().empty(); });
  if (!scalars) fields.Fail(key, DescribeNode(row), "must be two links and a reason", kRow);
  DatasetDescription::LinkNames names{row[0].Scalar(), row[1].Scalar(), {}};
  if (names.first == names.second) fields.Fail(key, names.first, "is a pair of one link with itself", kRow);
  const std::optional<UncheckedReason> reason = ParseEnum<UncheckedReason>(row[2].Scalar());
  if (!reason) {
    const std::vector<std::string> words = WordsOf<UncheckedReason>();
    fields.Fail(key, row[2].Scalar(), "unknown reason", SuggestName(row[2].Scalar(), words));
  }
  names.reason = *reason;
  return names;
}

std::int64_t ReadCount(const YamlFields& fields, const std::string& key, double most) {
  const std::optional<double> value = fields.Number(key);
  if (!value) return 0;
  if (!(*value >= 0.0 && *value <= most && *value == std::floor(*value))) {
    fields.Fail(key, DescribeNode(fields.Get(key)), "must be a whole number that is not negative", "write 10000");
  }
  return static_cast<std::int64_t>(*value);
}

}  // namespace

std::optional<DatasetDescription::SelfCollision> ReadSelfCollision(const YamlFields& fields) {
  constexpr double kMostSamples = 1e9, kMostSeed = 9e15;  // below 2^53, so that the number is exact
  const YAML::Node map = fields.Get("self_collision");
  if (!map.IsDefined()) return std::nullopt;
  if (fields.Get("self_collision_reference").IsDefined()) {
    fields.Fail("self_collision", "", "cannot be combined with self_collision_reference", "remove one of the two keys");
  }
  const YamlFields own(map, fields.file(), fields.Path("self_collision"), {"samples", "seed", "unchecked"});
  DatasetDescription::SelfCollision result;
  result.samples = static_cast<int>(ReadCount(own, "samples", kMostSamples));
  result.seed = ReadCount(own, "seed", kMostSeed);
  const YAML::Node rows = own.Require("unchecked");
  if (!rows.IsSequence()) own.Fail("unchecked", DescribeNode(rows), "must be a list of pairs", kRow);
  std::set<std::pair<std::string, std::string>> seen;
  for (const YAML::Node& row : rows) {
    const std::string key = "unchecked[" + std::to_string(result.unchecked.size()) + "]";
    const DatasetDescription::LinkNames& names = result.unchecked.emplace_back(ReadRow(own, key, row));
    if (!seen.insert(std::minmax(names.first, names.second)).second) {
      own.Fail(key, names.first + ", " + names.second, "the pair is listed twice", "keep one line");
    }
  }
  return result;
}

LinkRepresentation ReadLinkShapes(const YamlFields& fields) {
  const std::optional<std::string> word = fields.Text("link_shapes");
  if (!word) return LinkRepresentation::kHulls;
  const std::optional<LinkRepresentation> shapes = ParseEnum<LinkRepresentation>(*word);
  if (!shapes) fields.Fail("link_shapes", *word, "unknown word", SuggestName(*word, WordsOf<LinkRepresentation>()));
  return *shapes;
}

std::string FormatSelfCollision(const DatasetDescription::SelfCollision& pairs,
                                const std::function<std::string(const std::string&)>& quoted) {
  std::string text = "\nself_collision:\n  samples: " + std::to_string(pairs.samples) +
                     "\n  seed: " + std::to_string(pairs.seed) +
                     "\n  unchecked:" + (pairs.unchecked.empty() ? " []" : "") + "\n";
  for (const DatasetDescription::LinkNames& names : pairs.unchecked) {
    text += "    - [" + quoted(names.first) + ", " + quoted(names.second) + ", " + std::string(ToString(names.reason)) +
            "]\n";
  }
  return text;
}

nlohmann::json CanonicalPairs(const DatasetDescription::SelfCollision& pairs) {
  std::vector<std::array<std::string, 3>> rows;
  for (const DatasetDescription::LinkNames& names : pairs.unchecked) {
    const auto [first, second] = std::minmax(names.first, names.second);
    rows.push_back({first, second, std::string(ToString(names.reason))});
  }
  std::ranges::sort(rows);
  return rows;
}

}  // namespace legopt
