#include "legopt/terms/motion_windows.h"

#include <algorithm>

namespace legopt {

std::vector<MotionWindow> MotionWindows(int num_stances) {
  std::vector<MotionWindow> windows;
  int first = 0;
  do {
    windows.push_back({first, std::min(kWindowStances, num_stances - first)});
    first += kWindowStances - kWindowOverlap;
  } while (first + kWindowOverlap < num_stances);
  return windows;
}

}  // namespace legopt
