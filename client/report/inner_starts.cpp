#include "client/report/inner_starts.h"

namespace legopt::client {

TableText FormatStarts(std::int64_t multi_starts, std::int64_t inner_starts) {
  const std::string attempts = std::to_string(multi_starts);
  if (inner_starts == 0) return {attempts};
  const std::string inside = std::to_string(inner_starts);
  return {attempts + " + " + inside + " inside", attempts + "+" + inside};
}

}  // namespace legopt::client
