#pragma once

#include <vector>

namespace legopt {

/// One window of a motion: stances [first_stance, first_stance + num_stances).
struct MotionWindow {
  int first_stance = 0;
  int num_stances = 0;
};

inline constexpr int kWindowStances = 6;
inline constexpr int kWindowOverlap = 1;  ///< stances shared with the window before

/// Windows of a motion with `num_stances` >= 1 stances: 1 + ceil((N - 6) / 5), the last one perhaps shorter.
std::vector<MotionWindow> MotionWindows(int num_stances);

}  // namespace legopt
