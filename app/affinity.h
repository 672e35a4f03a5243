#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <vector>

namespace legopt::app {

/// Processors on which this thread may run, ascending; empty: unknown.
std::vector<int> AffinityMask();

/// Returns the first of `processors` on each physical core, in their order, because two processors of a core slow each
/// other down. Reads files below `root` (tests use their own tree). A processor without information counts as a core.
std::vector<int> OneOfEachCore(std::span<const int> processors, const std::filesystem::path& root = "/");

/// Returns the processor to which each of `slots` is pinned: one core per slot, if the slots use all granted cores.
/// Otherwise none is pinned (empty). With more cores than slots other programs may use some, and the kernel can choose.
/// With fewer cores than slots the slots share them.
std::vector<int> ProcessorsOfSlots(int slots, const std::vector<int>& cores);

/// Pins this thread to one processor during its lifetime; child processes started meanwhile inherit that. If the kernel
/// refuses because the grant has changed, the thread is not pinned. Thread rule: one thread.
class PinnedThread {
 public:
  explicit PinnedThread(int processor);
  ~PinnedThread();
  PinnedThread(const PinnedThread&) = delete;
  PinnedThread& operator=(const PinnedThread&) = delete;

 private:
  std::vector<int> before_;
};

}  // namespace legopt::app
