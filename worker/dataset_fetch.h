#pragma once

#include <functional>
#include <optional>
#include <string>

#include "worker/server_link.h"

namespace legopt::worker {

/// Result of fetching a dataset.
struct FetchedDataset {
  enum class End {
    kFetched,
    kUnknown,      ///< the server does not offer it
    kUnreachable,  ///< no answer for too long
    kStopped,      ///< ordered to stop
  };
  End end = End::kUnreachable;
  std::string archive;  ///< set for kFetched: as received, unchecked
  std::string error;    ///< reason for the other ends, for humans
};

/// Options of FetchDataset.
struct DatasetFetchOptions {
  microseconds wait_server = microseconds::max();  ///< maximum time without an answer
  int stop_fd = -1;                                ///< readable if there may be an order to stop
  std::function<bool()> take_order = {};           ///< takes an order; false: there is none
  std::function<void(const std::string&)> tell = [](const std::string&) {};  ///< called once if the server is silent
};

/// Requests a dataset from the server piece by piece, and retries while the server does not answer (PROTOCOL.md,
/// section 9, Dataset). Blocks. Call on the link's thread.
FetchedDataset FetchDataset(ServerLink& link, const std::string& hash, const DatasetFetchOptions& options);

}  // namespace legopt::worker
