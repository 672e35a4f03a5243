#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <vector>

namespace legopt::programs {

/// Numbers of the processors that this thread may run on, ascending; empty: not known.
std::vector<int> AffinityMask();

/// The first of `processors` on each physical core, in their order: two that share a core take its time from each
/// other. Files are looked for below `root` (tests bring a tree of their own); a processor of which nothing is known
/// counts as a core.
std::vector<int> OneOfEachCore(std::span<const int> processors, const std::filesystem::path& root = "/");

/// Which processor each of `slots` is pinned to: one core each, when they fill the granted cores. Else none is (empty):
/// of more cores than slots others may use some, and the kernel knows which; fewer cores are taken in turns.
std::vector<int> PlacesOfSlots(int slots, const std::vector<int>& cores);

/// Keeps this thread on one processor while it lives: what is started meanwhile stays there. Where the kernel refuses,
/// as the grant has changed, it stays where it may. Thread rule: one thread.
class PinnedThread {
 public:
  explicit PinnedThread(int processor);
  ~PinnedThread();
  PinnedThread(const PinnedThread&) = delete;
  PinnedThread& operator=(const PinnedThread&) = delete;

 private:
  std::vector<int> before_;
};

}  // namespace legopt::programs
