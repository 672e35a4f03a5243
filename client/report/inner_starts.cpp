#include "client/report/inner_starts.h"

namespace legopt::client {

std::string FormatStarts(std::int64_t multi_starts, std::int64_t inner_starts) {
  const std::string attempts = std::to_string(multi_starts);
  return inner_starts == 0 ? attempts : attempts + " + " + std::to_string(inner_starts) + " inside";
}

TableCell ShownStarts(std::int64_t multi_starts, std::int64_t inner_starts) {
  return {multi_starts, FormatStarts(multi_starts, inner_starts)};
}

}  // namespace legopt::client
