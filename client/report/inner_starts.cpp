#include "client/report/inner_starts.h"

namespace legopt::client {

std::string InnerStartsSql(const std::string& alias) {
  const std::string options = alias + ".options_json";
  // The database may contain methods whose options are not JSON.
  return "iif(json_valid(" + options + "), coalesce(json_extract(" + options + ", '$.options.rescues'), 0), 0)";
}

std::string FormatStarts(std::int64_t multi_starts, std::int64_t inner_starts) {
  const std::string attempts = std::to_string(multi_starts);
  return inner_starts == 0 ? attempts : attempts + " + " + std::to_string(inner_starts) + " inside";
}

TableCell ShownStarts(std::int64_t multi_starts, std::int64_t inner_starts) {
  return {multi_starts, FormatStarts(multi_starts, inner_starts)};
}

}  // namespace legopt::client
