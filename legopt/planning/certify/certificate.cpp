#include "legopt/planning/certify/certificate.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <span>
#include <utility>

#include "legopt/input/json.h"
#include "legopt/types/enum_names.h"
#include "legopt/types/input_error.h"

namespace legopt::certify {
namespace {

using Json = nlohmann::json;
using OrderedJson = nlohmann::ordered_json;

constexpr const char* kFormat = "legopt-certificate/1";
constexpr const char* kFix = "make it anew with 'legopt certify', or take it from where it came again";

/// Returns the JSON text on one line. Third-party names need not be UTF-8.
std::string OneLine(const OrderedJson& json) { return Dump(json); }

OrderedJson ObstructionJson(const Obstruction& obstruction) {
  OrderedJson without = OrderedJson::array();
  for (const auto& groups : obstruction.without) {
    OrderedJson& set = without.emplace_back(OrderedJson::array());
    for (const ConstraintGroup group : groups) set.push_back(std::string(ToString(group)));
  }
  return without;
}

OrderedJson EvidenceJson(int stance, const StanceEvidence& evidence) {
  OrderedJson json{{"stance", stance}, {"feasibility", std::string(ToString(evidence.feasibility))}};
  switch (evidence.feasibility) {
    case Feasibility::kCertified:
      json[evidence.by_neighbour ? "neighbour" : "start"] = evidence.start;
      json["x"] = std::span(evidence.posture.data(), static_cast<std::size_t>(evidence.posture.size()));
      break;
    case Feasibility::kInfeasible:
      json["proof"] = evidence.proof;
      break;
    case Feasibility::kOpen:
      json["starts"] = evidence.starts;
      json["found_without"] = ObstructionJson(evidence.obstruction);
      json["nearest"] = evidence.obstruction.nearest;
      break;
  }
  return json;
}

OrderedJson ProblemJson(int id, const std::vector<int>& stances, const Certificate& certificate) {
  OrderedJson json{{"id", id}, {"feasibility", std::string(ToString(certificate.Of(stances)))}};
  for (std::size_t s = 0; s < stances.size(); ++s) {
    const auto& evidence = certificate.stances[static_cast<std::size_t>(stances[s])];
    if (evidence && evidence->feasibility == Feasibility::kCertified) continue;
    json["uncertified"].push_back({{"place", s}, {"stance", stances[s]}});
  }
  return json;
}

/// Reads one file; every error names it.
class CertificateReader {
 public:
  explicit CertificateReader(const std::filesystem::path& path) : path_(path), root_(ReadJsonFile(path)) {
    if (!root_.is_object() || TextAt(root_, "format", "") != kFormat) {
      Fail("format", "", "is not a certificate of feasibility", std::string("the key must be ") + kFormat);
    }
  }

  std::string dataset() const { return TextAt(Member(root_, "dataset", ""), "name", "dataset"); }
  std::string hash() const { return TextAt(Member(root_, "dataset", ""), "hash", "dataset"); }

  EnumArray<Task, std::map<int, Feasibility>> Problems() const {
    EnumArray<Task, std::map<int, Feasibility>> problems;
    const Json& tasks = Member(root_, "problems", "");
    for (const TaskDescription& description : ProblemTasks()) {
      const auto of_task = tasks.find(ToString(description.task));
      if (of_task == tasks.end()) continue;
      const std::string place = "problems." + std::string(ToString(description.task));
      if (!of_task->is_array()) Fail(place, "", "must be a list", kFix);
      for (const Json& problem : *of_task) {
        problems[description.task][IntegerAt(problem, "id", place)] = FeasibilityAt(problem, place);
      }
    }
    return problems;
  }

  std::vector<std::optional<StanceEvidence>> Stances(std::size_t count, Eigen::Index size) const {
    std::vector<std::optional<StanceEvidence>> stances(count);
    const Json& list = Member(root_, "stances", "");
    if (!list.is_array()) Fail("stances", "", "must be a list", kFix);
    for (const Json& entry : list) {
      const int number = IntegerAt(entry, "stance", "stances");
      if (static_cast<std::size_t>(number) >= count) {
        Fail("stances", std::to_string(number), "the dataset has stances 0 to " + std::to_string(count - 1), kFix);
      }
      stances[static_cast<std::size_t>(number)] = Evidence(entry, "stance " + std::to_string(number), size);
    }
    return stances;
  }

 private:
  [[noreturn]] void Fail(std::string field, std::string value, std::string message, std::string fix) const {
    throw InputError({path_.string(), std::move(field), std::move(value), std::move(message), std::move(fix)});
  }
  const Json& Member(const Json& object, const char* key, const std::string& place) const {
    const std::string field = place.empty() ? key : place + "." + key;
    if (!object.is_object()) Fail(place, "", "must be a map", kFix);
    const auto found = object.find(key);
    if (found == object.end()) Fail(field, "", "the key is missing", kFix);
    return *found;
  }
  std::string TextAt(const Json& object, const char* key, const std::string& place) const {
    const Json& value = Member(object, key, place);
    if (!value.is_string()) Fail(place + "." + key, Dump(value), "must be a text", kFix);
    return value.get<std::string>();
  }
  int IntegerAt(const Json& object, const char* key, const std::string& place) const {
    constexpr std::int64_t kMost = 1'000'000'000;
    const Json& value = Member(object, key, place);
    if (!value.is_number_integer() || value < 0 || value > kMost) {
      Fail(place + "." + key, Dump(value), "must be an integer that is not negative", kFix);
    }
    return value.get<int>();
  }
  template <NamedEnum Enum>
  Enum WordIn(const Json& value, const std::string& place) const {
    if (!value.is_string()) Fail(place, Dump(value), "must be a text", kFix);
    const std::optional<Enum> word = ParseEnum<Enum>(value.get_ref<const std::string&>());
    if (!word) Fail(place, value.get<std::string>(), "is none of the words", kFix);
    return *word;
  }
  Feasibility FeasibilityAt(const Json& object, const std::string& place) const {
    return WordIn<Feasibility>(Member(object, "feasibility", place), place + ".feasibility");
  }
  StanceEvidence Evidence(const Json& entry, const std::string& place, Eigen::Index size) const {
    StanceEvidence evidence;
    evidence.feasibility = FeasibilityAt(entry, place);
    switch (evidence.feasibility) {
      case Feasibility::kCertified:
        evidence.by_neighbour = entry.contains("neighbour");
        evidence.start = IntegerAt(entry, evidence.by_neighbour ? "neighbour" : "start", place);
        evidence.posture = Posture(Member(entry, "x", place), place + ".x", size);
        break;
      case Feasibility::kInfeasible:
        evidence.proof = TextAt(entry, "proof", place);
        break;
      case Feasibility::kOpen:
        evidence.starts = IntegerAt(entry, "starts", place);
        evidence.obstruction = {Without(Member(entry, "found_without", place), place + ".found_without"),
                                TextAt(entry, "nearest", place)};
        break;
    }
    return evidence;
  }
  Eigen::VectorXd Posture(const Json& list, const std::string& place, Eigen::Index size) const {
    const bool numbers =
        list.is_array() && std::all_of(list.begin(), list.end(), [](const Json& number) { return number.is_number(); });
    if (!numbers || static_cast<Eigen::Index>(list.size()) != size) {
      Fail(place, "", "must be a list of " + std::to_string(size) + " numbers", kFix);
    }
    Eigen::VectorXd x(size);
    std::transform(list.begin(), list.end(), x.data(), [](const Json& number) { return number.get<double>(); });
    return x;
  }
  std::vector<std::vector<ConstraintGroup>> Without(const Json& sets, const std::string& place) const {
    std::vector<std::vector<ConstraintGroup>> without;
    if (!sets.is_array()) Fail(place, Dump(sets), "must be a list of lists", kFix);
    for (const Json& set : sets) {
      if (!set.is_array()) Fail(place, Dump(set), "must be a list of lists", kFix);
      auto& groups = without.emplace_back();
      for (const Json& group : set) groups.push_back(WordIn<ConstraintGroup>(group, place));
    }
    return without;
  }

  std::filesystem::path path_;
  Json root_;
};

}  // namespace

bool Certificate::IsComplete() const {
  return std::all_of(stances.begin(), stances.end(), [](const auto& evidence) { return evidence.has_value(); });
}

Feasibility Certificate::Of(const std::vector<int>& of_problem) const {
  bool all = true;
  for (const int stance : of_problem) {
    const auto& evidence = stances[static_cast<std::size_t>(stance)];
    if (evidence && evidence->feasibility == Feasibility::kInfeasible) return Feasibility::kInfeasible;
    all = all && evidence && evidence->feasibility == Feasibility::kCertified;
  }
  return all ? Feasibility::kCertified : Feasibility::kOpen;
}

void RequireCertificateOf(const std::string& certificate_hash, const std::string& dataset_hash,
                          const std::filesystem::path& file, const std::string& dataset) {
  if (certificate_hash == dataset_hash) return;
  throw CertificateMismatch(file.string() + ": is a certificate of dataset content '" + certificate_hash + "', but '" +
                            dataset + "' has '" + dataset_hash +
                            "'; name the dataset that it was made for, or make another one by 'legopt certify' with "
                            "another --out");
}

std::string FormatCertificate(const Certificate& certificate, const StanceCatalogue& catalogue,
                              const Dataset& dataset) {
  const auto lines = [](const std::vector<OrderedJson>& entries) {
    std::string text = "[";
    for (std::size_t i = 0; i < entries.size(); ++i) text += (i > 0 ? ",\n  " : "\n  ") + OneLine(entries[i]);
    return text + "]";
  };
  const OrderedJson about{{"name", certificate.dataset}, {"hash", certificate.dataset_hash}};
  std::string text = std::string("{\"format\": \"") + kFormat + "\",\n \"dataset\": " + OneLine(about) +
                     ",\n \"complete\": " + (certificate.IsComplete() ? "true" : "false") + ",\n \"problems\": {";
  for (const TaskDescription& description : ProblemTasks()) {
    std::vector<OrderedJson> problems;
    for (std::size_t p = 0; p < catalogue.problems(description.task).size(); ++p) {
      problems.push_back(
          ProblemJson(dataset.problems(description.task)[p].id, catalogue.problems(description.task)[p], certificate));
    }
    text += (description.task == kTasks.front().task ? "\"" : ",\n  \"") + std::string(ToString(description.task)) +
            "\": " + lines(problems);
  }
  std::vector<OrderedJson> stances;
  for (std::size_t s = 0; s < certificate.stances.size(); ++s) {
    if (certificate.stances[s]) stances.push_back(EvidenceJson(static_cast<int>(s), *certificate.stances[s]));
  }
  return text + "},\n \"stances\": " + lines(stances) + "}\n";
}

Certificate ReadCertificate(const std::filesystem::path& path, const StanceCatalogue& catalogue,
                            const Dataset& dataset) {
  const CertificateReader reader(path);
  RequireCertificateOf(reader.hash(), dataset.content_hash(), path, dataset.name());
  return {dataset.name(), dataset.content_hash(),
          reader.Stances(catalogue.stances().size(), dataset.robot().configuration_size())};
}

ProblemFeasibility ReadProblemFeasibility(const std::filesystem::path& path) {
  const CertificateReader reader(path);
  return {path.string(), reader.dataset(), reader.hash(), reader.Problems()};
}

}  // namespace legopt::certify
