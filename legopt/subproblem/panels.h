#pragma once

#include <cstddef>

/// The innermost sums of the interior-point solver, in vectors as wide as the processor has them.
namespace legopt::kernels {

/// Vectors that panels are computed with. Every entry is the same sum in the same order, so that bits are equal.
enum class PanelVectors {
  kFour,  ///< of four doubles: every processor
  kEight  ///< of eight: AVX-512
};

/// Four rows of M, `columns` wide (a multiple of four), += sign * sum_r a_r b_r^T over `count` rows r: a_r four
/// entries, b_r `columns`. Rows lie a_step, b_step and stride doubles apart. sign: 1 or -1. Any thread.
using Panel = void(double sign, const double* a, std::ptrdiff_t a_step, const double* b, std::ptrdiff_t b_step,
                   int count, double* m, std::ptrdiff_t stride, int columns);

/// The panel of these vectors; null where this processor or build has none.
Panel* PanelOf(PanelVectors vectors);

/// What the kernels use: the widest that there is, unless another was chosen.
Panel* ChosenPanel();
/// For tests and benchmarks: another one from now on; not null. No other thread may be solving.
void ChoosePanel(Panel* panel);

}  // namespace legopt::kernels
