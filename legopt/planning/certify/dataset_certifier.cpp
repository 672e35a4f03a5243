#include "legopt/planning/certify/dataset_certifier.h"

#include <algorithm>
#include <mutex>
#include <optional>
#include <utility>

#include "legopt/math/parallel.h"
#include "legopt/planning/certify/reach_prover.h"
#include "legopt/planning/certify/stance_certifier.h"

namespace legopt::certify {
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
      if (auto proof = prover_->Refute(at)) {
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
