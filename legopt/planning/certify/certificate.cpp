#include "legopt/planning/certify/certificate.h"

#include <algorithm>
#include <cstddef>
#include <map>
#include <mutex>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>
#include <string>
#include <utility>

#include "legopt/input/json.h"
#include "legopt/input/text.h"
#include "legopt/math/blake2b.h"
#include "legopt/math/parallel.h"
#include "legopt/planning/certify/internal/balance_prover.h"
#include "legopt/planning/certify/internal/reach_prover.h"
#include "legopt/planning/certify/internal/stance_certifier.h"
#include "legopt/types/enum_names.h"
#include "legopt/types/input_error.h"

namespace legopt::certify {

StanceCatalogue::StanceCatalogue(const Dataset& dataset) {
  std::map<std::string, int> numbers;
  for (const TaskDescription& description : ProblemTasks()) {
    for (const ProblemDefinition& problem : dataset.problems(description.task)) {
      std::vector<int>& of_problem = problems_[description.task].emplace_back();
      for (const Stance& stance : problem.stances) {
        const auto [found, is_new] = numbers.emplace(StanceKey(stance), static_cast<int>(stances_.size()));
        if (is_new) stances_.push_back(stance);
        of_problem.push_back(found->second);
      }
    }
  }
  FindNeighbours();
}

void StanceCatalogue::FindNeighbours() {
  constexpr std::ptrdiff_t kReach = 2;
  neighbours_.resize(stances_.size());
  for (const TaskDescription& description : ProblemTasks()) {
    for (const std::vector<int>& problem : problems_[description.task]) {
      for (std::ptrdiff_t i = 0; i < std::ssize(problem); ++i) {
        const int stance = problem[static_cast<std::size_t>(i)];
        const std::ptrdiff_t last = std::min(i + kReach, std::ssize(problem) - 1);
        for (std::ptrdiff_t k = std::max<std::ptrdiff_t>(i - kReach, 0); k <= last; ++k) {
          const int other = problem[static_cast<std::size_t>(k)];
          if (other != stance) neighbours_[static_cast<std::size_t>(stance)].push_back(other);
        }
      }
    }
  }
  for (std::vector<int>& list : neighbours_) {
    std::sort(list.begin(), list.end());
    list.erase(std::unique(list.begin(), list.end()), list.end());
  }
}

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

  /// Returns the largest number of starts of an open stance; 0 without one.
  int MostStarts() const {
    int most = 0;
    const Json& list = Member(root_, "stances", "");
    if (!list.is_array()) Fail("stances", "", "must be a list", kFix);
    for (const Json& entry : list) {
      if (entry.is_object() && entry.contains("starts")) most = std::max(most, IntegerAt(entry, "starts", "stances"));
    }
    return most;
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
  return {path.string(),
          reader.dataset(),
          reader.hash(),
          reader.Problems(),
          Blake2bHex(ReadFileText(path, JsonLimits{}.bytes)),
          reader.MostStarts()};
}

namespace {

/// State of one certification.
class Certification {
 public:
  Certification(const std::shared_ptr<const Dataset>& dataset, const StanceCatalogue& catalogue,
                const CertifyOptions& options, const CertifyHooks& hooks)
      : dataset_(*dataset), catalogue_(catalogue), options_(options), hooks_(hooks) {
    certificate_.dataset = dataset->name();
    certificate_.dataset_hash = dataset->content_hash();
    certificate_.stances.resize(catalogue.stances().size());
    for (int k = 0; k < options.threads; ++k) certifiers_.push_back(std::make_unique<StanceCertifier>(dataset));
  }

  Certificate Run(const Certificate* known) {
    if (known != nullptr) ForStances("judging known solutions", AllStances(), [&](auto&... a) { Check(*known, a...); });
    ForStances("first starts", Unknown(), [this](auto&... a) { TryFirstStarts(a...); });
    PrepareHardStances();
    ForStances("further starts", Unknown(), [this](auto&... a) { TryRemaining(a...); });
    return std::move(certificate_);
  }

 private:
  std::vector<int> AllStances() const {
    std::vector<int> stances;
    for (int s = 0; s < std::ssize(certificate_.stances); ++s) stances.push_back(s);
    return stances;
  }
  std::vector<int> Unknown() const {
    std::vector<int> stances = AllStances();
    std::erase_if(stances, [this](int s) { return certificate_.stances[static_cast<std::size_t>(s)].has_value(); });
    return stances;
  }
  bool Stopped() const { return hooks_.stop && hooks_.stop(); }
  const Stance& StanceOf(int number) const { return catalogue_.stances()[static_cast<std::size_t>(number)]; }

  /// Calls work(certifier, stance, evidence to fill in) for each stance, on all threads.
  template <class Work>
  void ForStances(const char* stage, const std::vector<int>& stances, const Work& work) {
    std::size_t done = 0;
    ForEachIndex(options_.threads, stances.size(), [&](int worker, std::size_t i) {
      if (Stopped()) return;
      const int stance = stances[i];
      std::optional<StanceEvidence> evidence;
      work(*certifiers_[static_cast<std::size_t>(worker)], stance, evidence);
      const std::scoped_lock lock(mutex_);
      if (hooks_.progress) hooks_.progress(stage, ++done, stances.size());
      if (!evidence) return;
      certificate_.stances[static_cast<std::size_t>(stance)] = std::move(evidence);
      if (hooks_.on_update) hooks_.on_update(certificate_);
    });
  }

  void Check(const Certificate& known, StanceCertifier& certifier, int stance,
             std::optional<StanceEvidence>& evidence) const {
    const auto& before = known.stances[static_cast<std::size_t>(stance)];
    if (!before || before->feasibility == Feasibility::kInfeasible) return;
    const bool holds = before->feasibility == Feasibility::kCertified
                           ? certifier.Accepts(StanceOf(stance), before->posture)
                           : before->starts >= options_.starts;
    if (holds) evidence = before;
  }

  void TryFirstStarts(StanceCertifier& certifier, int stance, std::optional<StanceEvidence>& evidence) const {
    const int last = std::min(options_.starts, CertifyOptions::kFirstStarts);
    if (auto found = certifier.Search(StanceOf(stance), 0, last, hooks_.stop)) evidence = Certified(*found, false);
  }

  void PrepareHardStances() {
    if (Unknown().empty() || Stopped()) return;
    prover_.emplace(dataset_);
    FindFirstPostures();
  }

  /// Collects the postures of the first starts only, which do not depend on the timing of other threads.
  void FindFirstPostures() {
    first_postures_.resize(certificate_.stances.size());
    for (std::size_t s = 0; s < first_postures_.size(); ++s) {
      const auto& evidence = certificate_.stances[s];
      const bool first = evidence && evidence->feasibility == Feasibility::kCertified && !evidence->by_neighbour &&
                         evidence->start < CertifyOptions::kFirstStarts;
      if (first) first_postures_[s] = evidence->posture;
    }
  }

  void TryRemaining(StanceCertifier& certifier, int stance, std::optional<StanceEvidence>& evidence) const {
    const Stance& at = StanceOf(stance);
    std::vector<Eigen::VectorXd> neighbours;
    for (const int other : catalogue_.neighbours(stance)) {
      const Eigen::VectorXd& x = first_postures_[static_cast<std::size_t>(other)];
      if (x.size() > 0) neighbours.push_back(x);
    }
    auto found = certifier.SearchFrom(at, neighbours, hooks_.stop);
    const bool by_neighbour = found.has_value();
    if (!found && !Stopped()) {
      std::optional<std::string> proof = RefuteBalance(dataset_, at);
      if (!proof) proof = prover_->Refute(at);
      if (proof) {
        evidence = Infeasible(std::move(*proof));
        return;
      }
    }
    if (!found) found = certifier.Search(at, CertifyOptions::kFirstStarts, options_.starts, hooks_.stop);
    if (found) {
      evidence = Certified(*found, by_neighbour);
      return;
    }
    StanceEvidence open;
    open.starts = options_.starts;
    open.obstruction =
        certifier.Explain(at, std::min(options_.starts, StanceCertifier::kExplainingStarts), hooks_.stop);
    if (!Stopped()) evidence = std::move(open);
  }

  static StanceEvidence Certified(FoundPosture& found, bool by_neighbour) {
    StanceEvidence evidence;
    evidence.feasibility = Feasibility::kCertified;
    evidence.posture = std::move(found.x);
    evidence.start = found.start;
    evidence.by_neighbour = by_neighbour;
    return evidence;
  }

  static StanceEvidence Infeasible(std::string proof) {
    StanceEvidence evidence;
    evidence.feasibility = Feasibility::kInfeasible;
    evidence.proof = std::move(proof);
    return evidence;
  }

  const Dataset& dataset_;
  const StanceCatalogue& catalogue_;
  const CertifyOptions& options_;
  const CertifyHooks& hooks_;
  std::vector<std::unique_ptr<StanceCertifier>> certifiers_;  // one per thread
  std::mutex mutex_;
  std::optional<ReachProver> prover_;  // created if hard stances remain
  Certificate certificate_;
  std::vector<Eigen::VectorXd> first_postures_;  // one per stance; empty: none
};

}  // namespace

Certificate CertifyDataset(const std::shared_ptr<const Dataset>& dataset, const StanceCatalogue& catalogue,
                           const CertifyOptions& options, const Certificate* known, const CertifyHooks& hooks) {
  return Certification(dataset, catalogue, options, hooks).Run(known);
}

EnumArray<Feasibility, int> CountProblems(const Certificate& certificate, const StanceCatalogue& catalogue, Task task) {
  EnumArray<Feasibility, int> counts;
  for (const std::vector<int>& problem : catalogue.problems(task)) ++counts[certificate.Of(problem)];
  return counts;
}

}  // namespace legopt::certify
