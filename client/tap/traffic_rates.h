#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <utility>

#include "client/report/listing.h"
#include "client/tap/captured_datagram.h"

namespace legopt::client {

/// Traffic within an interval by message type and frame kind, and rejected datagrams by cause.
class TrafficRates {
 public:
  void Add(const CapturedDatagram& heard);

  std::uint64_t datagrams() const { return total_.datagrams; }
  std::uint64_t bytes() const { return total_.bytes; }  ///< size of frames, without the headers of LCM, UDP and IP
  const std::map<std::string, std::uint64_t>& rejected() const { return rejected_; }

  /// Returns rows by message type, then kind, with totals last: datagrams and bytes, and both per second of an interval
  /// of `seconds` > 0.
  Listing ToListing(double seconds) const;
  /// Returns {"seconds", "datagrams", "bytes", "rates": [one object per row], "rejected": {cause: datagrams}}.
  nlohmann::ordered_json ToJson(double seconds) const;
  /// Returns e.g. "2 tag, 1 size"; empty if all datagrams were legal.
  std::string RejectedText() const;

 private:
  struct Count {
    std::uint64_t datagrams = 0;
    std::uint64_t bytes = 0;
  };
  using Key = std::pair<std::string, std::string>;  // type, kind
  Listing Rows(double seconds) const;

  Count total_;
  std::map<Key, Count> counts_;
  std::map<std::string, std::uint64_t> rejected_;
};

}  // namespace legopt::client
