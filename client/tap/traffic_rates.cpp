#include "client/tap/traffic_rates.h"

namespace legopt::client {
namespace {

double PerSecond(std::uint64_t count, double seconds) { return static_cast<double>(count) / seconds; }

}  // namespace

void TrafficRates::Add(const CapturedDatagram& heard) {
  Count& count = counts_[{std::string(TypeName(heard)), std::string(KindName(heard))}];
  for (Count* each : {&count, &total_}) {
    ++each->datagrams;
    each->bytes += heard.bytes;
  }
  if (!heard.rejected.empty()) ++rejected_[std::string(heard.rejected)];
}

Listing TrafficRates::Rows(double seconds) const {
  Listing listing;
  listing.columns = {"type", "kind", "datagrams", "bytes", "datagrams_per_s", "bytes_per_s"};
  for (const auto& [key, count] : counts_) {
    listing.rows.push_back({key.first, key.second, count.datagrams, count.bytes, PerSecond(count.datagrams, seconds),
                            PerSecond(count.bytes, seconds)});
  }
  return listing;
}

Listing TrafficRates::ToListing(double seconds) const {
  Listing listing = Rows(seconds);
  listing.rows.push_back({"all", "", total_.datagrams, total_.bytes, PerSecond(total_.datagrams, seconds),
                          PerSecond(total_.bytes, seconds)});
  return listing;
}

nlohmann::ordered_json TrafficRates::ToJson(double seconds) const {
  return {{"seconds", seconds},
          {"datagrams", total_.datagrams},
          {"bytes", total_.bytes},
          {"rates", ListingToJson(Rows(seconds))},
          {"rejected", rejected_}};
}

std::string TrafficRates::RejectedText() const {
  std::string text;
  for (const auto& [cause, count] : rejected_) {
    text += (text.empty() ? "" : ", ") + std::to_string(count) + " " + cause;
  }
  return text;
}

}  // namespace legopt::client
