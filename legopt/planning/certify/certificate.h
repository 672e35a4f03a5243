#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <map>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "legopt/dataset/dataset.h"
#include "legopt/planning/certify/stance_catalogue.h"
#include "legopt/planning/certify/stance_certifier.h"
#include "legopt/types/feasibility.h"
#include "legopt/types/task.h"

namespace legopt::certify {

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

}  // namespace legopt::certify
