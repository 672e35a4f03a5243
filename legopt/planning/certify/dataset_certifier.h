#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <vector>

#include "legopt/dataset/dataset.h"
#include "legopt/planning/certify/certificate.h"
#include "legopt/planning/certify/stance_catalogue.h"
#include "legopt/types/feasibility.h"
#include "legopt/types/task.h"

namespace legopt::certify {

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
/// their neighbours, then by a proof that there is none (reach_prover.h), then from all their other starts. The rest is
/// open, with the constraints that prevent a posture.
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
