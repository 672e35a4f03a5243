#pragma once

#include <functional>
#include <optional>
#include <string>

#include "worker/server_link.h"

namespace legopt::worker {

/// How the fetching of a dataset went.
struct FetchedDataset {
  enum class End {
    kFetched,
    kUnknown,      ///< the server does not hand it out
    kUnreachable,  ///< no answer for too long
    kStopped,      ///< told to
  };
  End end = End::kUnreachable;
  std::string archive;  ///< of kFetched: as the server gave it, unchecked
  std::string error;    ///< of the others: why, for people
};

/// Asks the server for a dataset, piece by piece, with patience for one that is away (PROTOCOL.md, section 9, Dataset).
struct DatasetFetchOptions {
  microseconds wait_server = microseconds::max();  ///< without an answer, after which to give up
  int stop_fd = -1;                                ///< readable when there may be an order to stop
  std::function<bool()> take_order = {};           ///< takes one; false: there is none
  std::function<void(const std::string&)> tell = [](const std::string&) {};  ///< once, when the server is silent
};

/// Blocks. The link's thread.
FetchedDataset FetchDataset(ServerLink& link, const std::string& hash, const DatasetFetchOptions& options);

}  // namespace legopt::worker
