// SLEEF's sin, exp and other elementary functions under their libm names. A program that links this, and every shared
// library it loads (ODE, urdfdom, assimp, Ipopt, LAPACK), computes the same bits on every machine of an architecture.
// libm selects its code by the processor at run time, and its last bits change with the processor and the release.
//
// SLEEF's "finz" functions give equal bits on all processors with fused multiply-add, its "cinz" functions on those
// without. The error is at most 1 ulp. Unlike libm's functions, they do not set errno.

#include <sleef.h>

#include <cmath>

#if defined(__FMA__) || defined(__ARM_FEATURE_FMA)
#define LEGOPT_SLEEF(name, digits) Sleef_finz_##name##1_##digits##purecfma
#else
#define LEGOPT_SLEEF(name, digits) Sleef_cinz_##name##1_##digits##purec
#endif

#define LEGOPT_PIN(name)                                                              \
  extern "C" double name(double x) noexcept { return LEGOPT_SLEEF(name##d, u10)(x); } \
  extern "C" float name##f(float x) noexcept { return LEGOPT_SLEEF(name##f, u10)(x); }
#define LEGOPT_PIN_OF_TWO(name, digits)                                                               \
  extern "C" double name(double x, double y) noexcept { return LEGOPT_SLEEF(name##d, digits)(x, y); } \
  extern "C" float name##f(float x, float y) noexcept { return LEGOPT_SLEEF(name##f, digits)(x, y); }

LEGOPT_PIN(sin)
LEGOPT_PIN(cos)
LEGOPT_PIN(tan)
LEGOPT_PIN(asin)
LEGOPT_PIN(acos)
LEGOPT_PIN(atan)
LEGOPT_PIN(sinh)
LEGOPT_PIN(cosh)
LEGOPT_PIN(tanh)
LEGOPT_PIN(asinh)
LEGOPT_PIN(acosh)
LEGOPT_PIN(atanh)
LEGOPT_PIN(exp)
LEGOPT_PIN(exp2)
LEGOPT_PIN(expm1)
LEGOPT_PIN(log)
LEGOPT_PIN(log2)
LEGOPT_PIN(log10)
LEGOPT_PIN(log1p)
LEGOPT_PIN(cbrt)
LEGOPT_PIN_OF_TWO(atan2, u10)
LEGOPT_PIN_OF_TWO(pow, u10)
LEGOPT_PIN_OF_TWO(hypot, u05)

extern "C" void sincos(double x, double* sine, double* cosine) noexcept {
  const auto both = LEGOPT_SLEEF(sincosd, u10)(x);
  *sine = both.x;
  *cosine = both.y;
}

extern "C" void sincosf(float x, float* sine, float* cosine) noexcept {
  const auto both = LEGOPT_SLEEF(sincosf, u10)(x);
  *sine = both.x;
  *cosine = both.y;
}
