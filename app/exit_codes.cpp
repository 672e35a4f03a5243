#include "app/exit_codes.h"

#include <algorithm>

namespace legopt::app {

std::string ExitCodeHelp(std::initializer_list<ExitCode> codes) {
  constexpr std::size_t kNumberWidth = 3;
  std::string help = "Exit codes:";
  for (const ExitCodeText& line : kExitCodeTexts) {
    if (codes.size() > 0 && std::find(codes.begin(), codes.end(), line.code) == codes.end()) continue;
    const std::string number = std::to_string(StatusOf(line.code));
    help += "\n" + std::string(kNumberWidth - number.size(), ' ') + number + "  ";
    help += line.text;
  }
  return help;
}

}  // namespace legopt::app
