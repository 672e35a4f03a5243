#include "legopt/subproblem/panels.h"

#include <algorithm>

#include "legopt/subproblem/dense_kernels.h"

#if defined(__x86_64__) && defined(__FMA__)
#define LEGOPT_PANELS_OF_EIGHT
#endif

namespace legopt::kernels {
namespace {

// A tile of four rows and kWidth vectors: M += sign * sum_r a_r b_r^T, a_r four entries, kept in registers throughout.
template <int kWidth>
void TileOfFour(double sign, const double* a, std::ptrdiff_t a_step, const double* b, std::ptrdiff_t b_step, int count,
                double* m, std::ptrdiff_t stride) {
  Lanes s[kLanes][kWidth] = {};
  for (int r = 0; r < count; ++r, a += a_step, b += b_step) {
    Lanes v[kWidth];
    for (std::ptrdiff_t q = 0; q < kWidth; ++q) v[q] = Load(b + q * kLanes);
    for (int p = 0; p < kLanes; ++p) {
      const Lanes c = Broadcast(a[p]);
      for (int q = 0; q < kWidth; ++q) s[p][q] = MulAdd(c, v[q], s[p][q]);
    }
  }
  for (int p = 0; p < kLanes; ++p) {
    for (std::ptrdiff_t q = 0; q < kWidth; ++q) {
      double* entry = m + p * stride + q * kLanes;
      Store(entry, MulAdd(Broadcast(sign), s[p][q], Load(entry)));
    }
  }
}

void AddPanelOfFour(double sign, const double* a, std::ptrdiff_t a_step, const double* b, std::ptrdiff_t b_step,
                    int count, double* m, std::ptrdiff_t stride, int columns) {
  constexpr int kTile = 3;  // with it accumulators, factors and one broadcast fill the sixteen vector registers
  int j = 0;
  for (; j + kTile * kLanes <= columns; j += kTile * kLanes) {
    TileOfFour<kTile>(sign, a, a_step, b + j, b_step, count, m + j, stride);
  }
  if (columns - j == 2 * kLanes) TileOfFour<2>(sign, a, a_step, b + j, b_step, count, m + j, stride);
  if (columns - j == kLanes) TileOfFour<1>(sign, a, a_step, b + j, b_step, count, m + j, stride);
}

#ifdef LEGOPT_PANELS_OF_EIGHT
// Compiled for AVX-512 whatever the rest is compiled for; called only where the processor has it.
#define LEGOPT_WIDE __attribute__((target("avx512f,avx512vl")))

// Four rows and kWidth vectors of eight, and one of four behind them where kTail: s in 4 kWidth + 4 of 32 registers.
template <int kWidth, bool kTail>
LEGOPT_WIDE void TileOfEight(double sign, const double* a, std::ptrdiff_t a_step, const double* b,
                             std::ptrdiff_t b_step, int count, double* m, std::ptrdiff_t stride) {
  constexpr int kHeld = std::max(kWidth, 1);
  constexpr std::ptrdiff_t kEight = 8;
  __m512d s[kLanes][kHeld];
  __m256d tail[kLanes];
  for (int p = 0; p < kLanes; ++p) {
    for (int q = 0; q < kHeld; ++q) s[p][q] = _mm512_setzero_pd();
    tail[p] = _mm256_setzero_pd();
  }
  for (int r = 0; r < count; ++r, a += a_step, b += b_step) {
    __m512d v[kHeld];
    for (std::ptrdiff_t q = 0; q < kWidth; ++q) v[q] = _mm512_loadu_pd(b + q * kEight);
    const __m256d last = kTail ? _mm256_loadu_pd(b + kWidth * kEight) : _mm256_setzero_pd();
    for (int p = 0; p < kLanes; ++p) {
      const __m512d c = _mm512_set1_pd(a[p]);
      for (int q = 0; q < kWidth; ++q) s[p][q] = _mm512_fmadd_pd(c, v[q], s[p][q]);
      if (kTail) tail[p] = _mm256_fmadd_pd(_mm512_castpd512_pd256(c), last, tail[p]);
    }
  }
  for (int p = 0; p < kLanes; ++p) {
    double* row = m + p * stride;
    for (std::ptrdiff_t q = 0; q < kWidth; ++q) {
      double* entry = row + q * kEight;
      _mm512_storeu_pd(entry, _mm512_fmadd_pd(_mm512_set1_pd(sign), s[p][q], _mm512_loadu_pd(entry)));
    }
    if (!kTail) continue;
    double* entry = row + kWidth * kEight;
    _mm256_storeu_pd(entry, _mm256_fmadd_pd(_mm256_set1_pd(sign), tail[p], _mm256_loadu_pd(entry)));
  }
}

using Tile = void(double, const double*, std::ptrdiff_t, const double*, std::ptrdiff_t, int, double*, std::ptrdiff_t);

void AddPanelOfEight(double sign, const double* a, std::ptrdiff_t a_step, const double* b, std::ptrdiff_t b_step,
                     int count, double* m, std::ptrdiff_t stride, int columns) {
  // By columns / 4; a window of the Atlas, 36 columns, is one tile.
  static constexpr Tile* kTiles[] = {nullptr,
                                     TileOfEight<0, true>,
                                     TileOfEight<1, false>,
                                     TileOfEight<1, true>,
                                     TileOfEight<2, false>,
                                     TileOfEight<2, true>,
                                     TileOfEight<3, false>,
                                     TileOfEight<3, true>,
                                     TileOfEight<4, false>,
                                     TileOfEight<4, true>};
  constexpr int kWidest = 36, kWhole = 32;
  int j = 0;
  for (; columns - j > kWidest; j += kWhole) {
    TileOfEight<4, false>(sign, a, a_step, b + j, b_step, count, m + j, stride);
  }
  if (columns > j) kTiles[(columns - j) / kLanes](sign, a, a_step, b + j, b_step, count, m + j, stride);
}
#endif

Panel* Widest() {
  Panel* const eight = PanelOf(PanelVectors::kEight);
  return eight != nullptr ? eight : PanelOf(PanelVectors::kFour);
}

Panel* chosen_panel = Widest();

}  // namespace

Panel* PanelOf(PanelVectors vectors) {
  if (vectors == PanelVectors::kFour) return AddPanelOfFour;
#ifdef LEGOPT_PANELS_OF_EIGHT
  if (__builtin_cpu_supports("avx512f") != 0 && __builtin_cpu_supports("avx512vl") != 0) return AddPanelOfEight;
#endif
  return nullptr;
}

Panel* ChosenPanel() { return chosen_panel; }
void ChoosePanel(Panel* panel) { chosen_panel = panel; }

}  // namespace legopt::kernels
