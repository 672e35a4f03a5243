#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <vector>

#include "legopt/certify/certificate.h"
#include "legopt/certify/stance_catalogue.h"
#include "legopt/dataset/dataset.h"
#include "words/feasibility.h"
#include "words/task.h"

namespace legopt::certify {

/// How hard to look.
struct CertifyOptions {
  int starts = 10000;  ///< of a stance, from its own starts, before it is open; >= 1
  int threads = 1;     ///< >= 1; decides nothing

  /// A stance has so many starts of its own before its neighbours' postures are tried.
  static constexpr int kFirstStarts = 50;
};

/// What a certification asks of, and tells to, its surroundings; empty functions are not called. What they throw ends
/// it and goes on to the caller.
struct CertifyHooks {
  /// True: end soon, with what there is. Asked by all threads.
  std::function<bool()> stop;
  /// (stage, stances done, of all); one call at a time.
  std::function<void(const char*, std::size_t, std::size_t)> progress;
  /// More is known than at the call before; one call at a time, no thread changes it meanwhile.
  std::function<void(const Certificate&)> learnt;
};

/// Looks for a posture, or a reason why there is none, at every stance of a dataset.
///
/// First every stance from its first own starts. Then those that are left, from the postures which that has found for
/// their neighbours; a proof that there is none (reach_prover.h); all other starts of their own. What remains is open,
/// with what stands in the way.
///
/// `known` is what an earlier call has learnt, or nothing. None of it is believed that can be checked: postures that
/// the judge refuses, and proofs, are looked for again; what is open with fewer starts, too. So a certification that
/// was stopped goes on, and the result is the same as if it had not been, whatever the number of threads.
///
/// Returns an incomplete certificate when it was stopped. Throws InputError when a mesh is corrupt.
Certificate CertifyDataset(const std::shared_ptr<const Dataset>& dataset, const StanceCatalogue& catalogue,
                           const CertifyOptions& options, const Certificate* known, const CertifyHooks& hooks);

/// How many problems of a task are what.
Per<Feasibility, int> CountProblems(const Certificate& certificate, const StanceCatalogue& catalogue, Task task);

}  // namespace legopt::certify
