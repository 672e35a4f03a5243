#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "legopt/dataset/dataset.h"
#include "legopt/dataset/problem_definition.h"
#include "legopt/planning/certify/internal/stance_certifier.h"
#include "legopt/types/result.h"
#include "legopt/types/task.h"

namespace legopt::certify {

/// The distinct stances of a dataset; problems, and neighbours within a motion, repeat them. Numbered by first
/// occurrence, task by task, problem by problem. Immutable; any thread.
class StanceCatalogue {
 public:
  /// Two stances are identical if all their digits are.
  explicit StanceCatalogue(const Dataset& dataset);

  const std::vector<Stance>& stances() const { return stances_; }  ///< indexed by number
  /// Returns the numbers of the stances of each problem, problems in the order of the dataset.
  const std::vector<std::vector<int>>& problems(Task task) const { return problems_[task]; }
  /// Returns the numbers of the stances at most two places from this one in a problem; ascending, without itself.
  const std::vector<int>& neighbours(int stance) const { return neighbours_[static_cast<std::size_t>(stance)]; }

 private:
  void FindNeighbours();

  std::vector<Stance> stances_;
  EnumArray<Task, std::vector<std::vector<int>>> problems_;
  std::vector<std::vector<int>> neighbours_;
};

/// Name of the certificate next to dataset.yaml.
inline constexpr const char* kCertificateFileName = "certificate.json";

/// Evidence about one stance.
struct StanceEvidence {
  Feasibility feasibility = Feasibility::kOpen;  ///< determines which other members are used
  Eigen::VectorXd posture;                       ///< certified: n + 7 numbers, accepted by the judge
  int start = 0;                                 ///< certified: number of the start that led to it
  bool by_neighbour = false;  ///< certified: the start was a neighbour's posture, otherwise one of the stance's own
  std::string proof;          ///< infeasible: reason, in a sentence
  int starts = 0;             ///< open: number of starts without result
  Obstruction obstruction;    ///< open: constraints that prevent a posture
};

/// Evidence about the problems of one dataset. A motion is feasible if and only if every stance has a posture, because
/// no constraint couples waypoints. A value.
struct Certificate {
  std::string dataset;                                 ///< name of the dataset, for messages
  std::string dataset_hash;                            ///< hash of the dataset's content
  std::vector<std::optional<StanceEvidence>> stances;  ///< indexed by number in StanceCatalogue; none: not examined yet

  /// Returns whether all stances have been examined.
  bool IsComplete() const;
  /// Returns the feasibility of a problem with these stances: infeasible if one of them is, certified if all are, else
  /// open.
  Feasibility Of(const std::vector<int>& of_problem) const;
};

/// Feasibility of problems according to a certificate, without the evidence.
struct ProblemFeasibility {
  std::string file;  ///< path of the certificate
  std::string dataset;
  std::string dataset_hash;                              ///< hash of the dataset's content
  EnumArray<Task, std::map<int, Feasibility>> problems;  ///< feasibility by problem id
  std::string file_hash = {};                            ///< BLAKE2b-256 of the file, 64 hex digits
  int starts = 0;  ///< largest number of starts that found no posture of a stance; 0: none is open
};

/// Thrown for a certificate of another dataset, or of another version of it. what() names both and the fix.
class CertificateMismatch : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Throws CertificateMismatch unless the hashes are equal. `file` is the certificate, `dataset` the name of the dataset
/// that it should fit.
void RequireCertificateOf(const std::string& certificate_hash, const std::string& dataset_hash,
                          const std::filesystem::path& file, const std::string& dataset);

/// Returns the text of the file (docs/reference/datasets.md#certificates).
std::string FormatCertificate(const Certificate& certificate, const StanceCatalogue& catalogue, const Dataset& dataset);

/// Reads the evidence of a file. Throws CertificateMismatch if it is about another dataset, InputError if it cannot be
/// read or is damaged. The evidence is not trusted as far as it can be checked: see CertifyDataset.
Certificate ReadCertificate(const std::filesystem::path& path, const StanceCatalogue& catalogue,
                            const Dataset& dataset);

/// Reads the feasibility of problems from a file. Throws InputError.
ProblemFeasibility ReadProblemFeasibility(const std::filesystem::path& path);

/// Effort of a certification.
struct CertifyOptions {
  int starts = 10000;  ///< number of a stance's own starts before it counts as open, >= 1
  int threads = 1;     ///< >= 1; does not affect the result

  /// Number of a stance's own starts before its neighbours' postures are tried.
  static constexpr int kFirstStarts = 50;
};

/// Callbacks of a certification. Empty functions are not called. Exceptions end the certification and are passed to the
/// caller.
struct CertifyHooks {
  /// Returns true to end soon, with the current results. Called by all threads.
  std::function<bool()> stop;
  /// Called with (stage, finished stances, all stances); one call at a time.
  std::function<void(const char*, std::size_t, std::size_t)> progress;
  /// Called when the certificate contains more than at the last call; one call at a time, and no thread changes it
  /// meanwhile.
  std::function<void(const Certificate&)> on_update;
};

/// Searches for a posture, or a proof that there is none, at every stance of a dataset.
///
/// First, every stance is tried from its first own starts. The remaining stances are tried from the postures found for
/// their neighbours, then by a proof that there is none (balance_prover.h, reach_prover.h), then from all their other
/// starts. The rest is open, with the constraints that prevent a posture.
///
/// `known` is the result of an earlier call, or null. It is not trusted as far as it can be checked: postures that the
/// judge rejects, proofs, and stances that are open after fewer starts are searched again. A certification that was
/// stopped can therefore be continued, and the result is the same as without the stop, for any number of threads.
///
/// Returns an incomplete certificate if it was stopped. Throws InputError if a mesh is corrupt.
Certificate CertifyDataset(const std::shared_ptr<const Dataset>& dataset, const StanceCatalogue& catalogue,
                           const CertifyOptions& options, const Certificate* known, const CertifyHooks& hooks);

/// Returns the number of problems of a task by feasibility.
EnumArray<Feasibility, int> CountProblems(const Certificate& certificate, const StanceCatalogue& catalogue, Task task);

}  // namespace legopt::certify
