#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <map>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "legopt/certify/stance_catalogue.h"
#include "legopt/certify/stance_certifier.h"
#include "legopt/dataset/dataset.h"
#include "words/feasibility.h"
#include "words/task.h"

namespace legopt::certify {

/// Name of the file beside a dataset.yaml.
inline constexpr const char* kCertificateFileName = "certificate.json";

/// What is known of one stance.
struct StanceEvidence {
  Feasibility feasibility = Feasibility::kOpen;  ///< decides which of the others count
  Eigen::VectorXd posture;                       ///< certified: n + 7, accepted by the judge
  int start = 0;                                 ///< certified: which one led to it
  bool by_neighbour = false;                     ///< certified: it was a neighbour's posture, else one of its own
  std::string proof;                             ///< infeasible: why, in a sentence
  int starts = 0;                                ///< open: so many have led to nothing
  Obstruction obstruction;                       ///< open: what stands in the way
};

/// What is known of the problems of one dataset. A motion is feasible if and only if every stance has a posture, for no
/// constraint couples waypoints. A value.
struct Certificate {
  std::string dataset;                                 ///< its name, for people
  std::string dataset_hash;                            ///< of its content: what it is about
  std::vector<std::optional<StanceEvidence>> stances;  ///< by number of StanceCatalogue; none: not looked at yet

  /// Whether all stances have been looked at.
  bool IsComplete() const;
  /// Of a problem with these stances: infeasible if one is, certified if all are; what nobody has looked at is open.
  Feasibility Of(const std::vector<int>& of_problem) const;
};

/// What a certificate says of problems, without its evidence.
struct ProblemFeasibility {
  std::string file;                                ///< where it was read
  std::string dataset;                             ///< name
  std::string dataset_hash;                        ///< of the content
  Per<Task, std::map<int, Feasibility>> problems;  ///< by id
};

/// A certificate of another dataset, or of another state of it. what() names both and the fix.
class CertificateMismatch : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Throws CertificateMismatch unless the hashes are equal; `file` is the certificate, `dataset` the name of what it
/// should fit.
void RequireCertificateOf(const std::string& certificate_hash, const std::string& dataset_hash,
                          const std::filesystem::path& file, const std::string& dataset);

/// Text of the file (docs/datasets.md#certificates).
std::string FormatCertificate(const Certificate& certificate, const StanceCatalogue& catalogue, const Dataset& dataset);

/// Reads the evidence of a file. Throws CertificateMismatch when it is about another dataset, InputError when it cannot
/// be read or is damaged. Nothing in it is believed that can be checked: see CertifyDataset.
Certificate ReadCertificate(const std::filesystem::path& path, const StanceCatalogue& catalogue,
                            const Dataset& dataset);

/// Reads what a file says of problems. Throws InputError.
ProblemFeasibility ReadProblemFeasibility(const std::filesystem::path& path);

}  // namespace legopt::certify
