#include "app/affinity.h"

#include <sched.h>

#include <algorithm>
#include <fstream>
#include <new>
#include <set>

namespace legopt::app {
namespace {

// The kernel rejects a mask smaller than its own, e.g. on machines with more than 1024 processors.
constexpr int kFirstSize = 1024, kLastSize = 1 << 20;

class Mask {
 public:
  explicit Mask(int processors)
      : bytes_(CPU_ALLOC_SIZE(static_cast<std::size_t>(processors))),
        set_(CPU_ALLOC(static_cast<std::size_t>(processors))) {
    if (set_ == nullptr) throw std::bad_alloc();
    CPU_ZERO_S(bytes_, set_);
  }
  ~Mask() { CPU_FREE(set_); }
  Mask(const Mask&) = delete;
  Mask& operator=(const Mask&) = delete;

  bool Read() { return sched_getaffinity(0, bytes_, set_) == 0; }
  void Apply() const { sched_setaffinity(0, bytes_, set_); }
  bool Has(int processor) const { return CPU_ISSET_S(static_cast<std::size_t>(processor), bytes_, set_); }
  void Add(int processor) { CPU_SET_S(static_cast<std::size_t>(processor), bytes_, set_); }

 private:
  std::size_t bytes_;
  cpu_set_t* set_;
};

void RunOn(std::span<const int> processors) {
  Mask mask(std::max(kFirstSize, processors.back() + 1));
  for (const int processor : processors) mask.Add(processor);
  mask.Apply();
}

}  // namespace

std::vector<int> AffinityMask() {
  std::vector<int> processors;
  for (int size = kFirstSize; size <= kLastSize; size *= 2) {
    Mask mask(size);
    if (!mask.Read()) continue;
    for (int i = 0; i < size; ++i) {
      if (mask.Has(i)) processors.push_back(i);
    }
    break;
  }
  return processors;
}

std::vector<int> OneOfEachCore(std::span<const int> processors, const std::filesystem::path& root) {
  std::vector<int> cores;
  std::set<std::string> seen;  // lists of processors that share a core, as written by the kernel
  for (const int processor : processors) {
    const std::string folder = "sys/devices/system/cpu/cpu" + std::to_string(processor);
    std::string siblings;
    std::getline(std::ifstream(root / folder / "topology/thread_siblings_list"), siblings);
    if (siblings.empty() || seen.insert(siblings).second) cores.push_back(processor);
  }
  return cores;
}

std::vector<int> ProcessorsOfSlots(int slots, const std::vector<int>& cores) {
  return static_cast<std::size_t>(slots) == cores.size() ? cores : std::vector<int>{};
}

PinnedThread::PinnedThread(int processor) : before_(AffinityMask()) {
  const std::vector<int> one = {processor};
  RunOn(one);
}

PinnedThread::~PinnedThread() {
  if (!before_.empty()) RunOn(before_);
}

}  // namespace legopt::app
