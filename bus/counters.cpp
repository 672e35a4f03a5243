#include "bus/counters.h"

namespace legopt::bus {

std::uint64_t Counters::rejected() const {
  return rejected_size + rejected_malformed + rejected_version + rejected_deployment + rejected_tag +
         rejected_unsigned + rejected_replay + rejected_field + rejected_type + rejected_role + rejected_body +
         rejected_object;
}

std::vector<std::pair<std::string_view, std::uint64_t>> Counters::Listing() const {
  return {
      {"datagrams_sent", datagrams_sent},
      {"datagrams_received", datagrams_received},
      {"bytes_sent", bytes_sent},
      {"bytes_received", bytes_received},
      {"not_for_us", not_for_us},
      {"send_failures", send_failures},
      {"kernel_drops", kernel_drops},
      {"kernel_filtered", kernel_filtered},
      {"calls_started", calls_started},
      {"calls_completed", calls_completed},
      {"calls_rejected", calls_rejected},
      {"calls_timed_out", calls_timed_out},
      {"calls_abandoned", calls_abandoned},
      {"requests_retried", requests_retried},
      {"duplicate_replies", duplicate_replies},
      {"requests_handled", requests_handled},
      {"duplicate_requests", duplicate_requests},
      {"replies_resent", replies_resent},
      {"replies_evicted", replies_evicted},
      {"requests_refused_busy", requests_refused_busy},
      {"requests_challenged", requests_challenged},
      {"handler_failures", handler_failures},
      {"objects_sent", objects_sent},
      {"objects_received", objects_received},
      {"objects_expired", objects_expired},
      {"chunks_sent", chunks_sent},
      {"chunks_resent", chunks_resent},
      {"duplicate_chunks", duplicate_chunks},
      {"rejected_size", rejected_size},
      {"rejected_malformed", rejected_malformed},
      {"rejected_version", rejected_version},
      {"rejected_deployment", rejected_deployment},
      {"rejected_tag", rejected_tag},
      {"rejected_unsigned", rejected_unsigned},
      {"rejected_replay", rejected_replay},
      {"rejected_field", rejected_field},
      {"rejected_type", rejected_type},
      {"rejected_role", rejected_role},
      {"rejected_body", rejected_body},
      {"rejected_object", rejected_object},
  };
}

}  // namespace legopt::bus
