#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <exception>
#include <functional>
#include <mutex>
#include <system_error>
#include <thread>
#include <vector>

namespace legopt {

/// Returns the number of threads that this machine runs at once, at least 1.
inline int NumProcessors() { return std::max(1, static_cast<int>(std::thread::hardware_concurrency())); }

/// Calls work(worker, index) once for every index below `count` on `threads` threads, or on fewer if the system starts
/// no more. `worker` < threads identifies the calling thread's workspace. For reproducible results, the place of a
/// result must depend on the index only. The first exception is rethrown after all threads have ended.
inline void ForEachIndex(int threads, std::size_t count, const std::function<void(int, std::size_t)>& work) {
  std::atomic<std::size_t> next{0};
  std::exception_ptr failure;
  std::mutex mutex;
  const auto run = [&](int worker) {
    try {
      for (std::size_t i = next++; i < count; i = next++) work(worker, i);
    } catch (...) {
      const std::scoped_lock lock(mutex);
      if (!failure) failure = std::current_exception();
      next = count;
    }
  };
  std::vector<std::thread> others;
  others.reserve(static_cast<std::size_t>(std::max(threads, 1)));
  try {
    for (int worker = 1; worker < threads && static_cast<std::size_t>(worker) < count; ++worker) {
      others.emplace_back(run, worker);
    }
  } catch (const std::system_error&) {  // a limit of processes: the threads that there are do all the work
  }
  run(0);
  for (std::thread& thread : others) thread.join();
  if (failure) std::rethrow_exception(failure);
}

}  // namespace legopt
