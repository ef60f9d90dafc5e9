/* Walks in lock-step: a vector of reals, one lane per walk. Reals are doubles, or floats if SINGLE
   is defined, of which twice as many fit a register; DOUBLES is the number of doubles. Every
   operation is IEEE-exact or built from such operations, so a lane's bits do not depend on compiler,
   machine or neighbours. No libm: its last bits differ between systems. */
#include <stdint.h>
#include <string.h>

#ifdef SINGLE
#define LANES (2 * DOUBLES)
typedef float real;
typedef int32_t integer;
#else
#define LANES DOUBLES
typedef double real;
typedef int64_t integer;
#endif

typedef real vec __attribute__((vector_size(sizeof(real) * LANES)));
typedef integer ivec __attribute__((vector_size(sizeof(real) * LANES)));

/* Doubles, whatever a real is: HALVES of these for all lanes. */
#define HALVES (LANES / DOUBLES)
typedef double dvec __attribute__((vector_size(8 * DOUBLES)));
typedef int64_t divec __attribute__((vector_size(8 * DOUBLES)));
typedef real hvec __attribute__((vector_size(sizeof(real) * DOUBLES)));
typedef dvec wide[HALVES];

/* Number k of all lanes' doubles. */
#define OF_LANE(w, k) ((w)[(k) / DOUBLES][(k) % DOUBLES])

/* Not every source uses all of them. */
#define OPERATION static inline __attribute__((unused))

/* x - 0 is x itself and costs no operation; x + 0 is not for -0. */
#define SPLAT(x) ((real)(x) - (vec){0})
#define ISPLAT(x) ((integer)(x) - (ivec){0})
#define DSPLAT(x) ((double)(x) - (dvec){0})
#define DWHOLE(x) ((int64_t)(x) - (divec){0})

OPERATION vec vec_select(ivec mask, vec a, vec b)
{
  return (vec)((mask & (ivec)a) | (~mask & (ivec)b));
}

OPERATION dvec dvec_select(divec mask, dvec a, dvec b)
{
  return (dvec)((mask & (divec)a) | (~mask & (divec)b));
}

#include "instructions.h"

/* For a NaN and a number, the second operand, as the instruction does. */
#ifdef MAX_PD
OPERATION dvec dvec_max(dvec a, dvec b) { return MAX_PD(a, b); }
OPERATION dvec dvec_min(dvec a, dvec b) { return MIN_PD(a, b); }
#else
OPERATION dvec dvec_max(dvec a, dvec b) { return dvec_select(a > b, a, b); }
OPERATION dvec dvec_min(dvec a, dvec b) { return dvec_select(a < b, a, b); }
#endif

#ifndef SINGLE
OPERATION vec vec_max(vec a, vec b) { return dvec_max(a, b); }
OPERATION vec vec_min(vec a, vec b) { return dvec_min(a, b); }
#elif defined(MAX_PS)
OPERATION vec vec_max(vec a, vec b) { return MAX_PS(a, b); }
OPERATION vec vec_min(vec a, vec b) { return MIN_PS(a, b); }
#else
OPERATION vec vec_max(vec a, vec b) { return vec_select(a > b, a, b); }
OPERATION vec vec_min(vec a, vec b) { return vec_select(a < b, a, b); }
#endif

OPERATION vec vec_less(vec a, vec b) { return (vec)((a < b) & (ivec)SPLAT(1.0)); }

#define SIGN_BIT ((integer)((uint64_t)1 << (8 * sizeof(real) - 1)))
OPERATION vec vec_abs(vec a) { return (vec)((ivec)a & ISPLAT(~SIGN_BIT)); }

#include "fma.h"

OPERATION vec vec_sqrt(vec a)
{
#if defined(SQRT_PS) && defined(SINGLE)
  return SQRT_PS(a);
#elif defined(SQRT_PD) && !defined(SINGLE)
  return SQRT_PD(a);
#else
  vec r = a;
  for (int k = 0; k < LANES; k++) r[k] = (real)__builtin_sqrt(a[k]);
  return r;
#endif
}

/* Adding 1.5 * 2^52 rounds a double to the nearest integer, halves to even, and leaves it in the low
   bits; 1.5 * 2^23 does the same for a float. */
#define DOUBLE_ROUNDER 6755399441055744.0
#ifdef SINGLE
#define ROUNDER 12582912.0
#else
#define ROUNDER DOUBLE_ROUNDER
#endif

/* Below 2^51 in size; dvec_floor as well. */
OPERATION dvec dvec_round(dvec a) { return (a + DSPLAT(DOUBLE_ROUNDER)) - DSPLAT(DOUBLE_ROUNDER); }

OPERATION dvec dvec_floor(dvec a)
{
  const dvec nearest = dvec_round(a);
  return nearest - (dvec)((nearest > a) & (divec)DSPLAT(1.0));
}

/* A whole number below 2^51 in size as an integer, and back. */
OPERATION divec dvec_whole(dvec a)
{
  return (divec)(a + DSPLAT(DOUBLE_ROUNDER)) - (divec)DSPLAT(DOUBLE_ROUNDER);
}

OPERATION dvec dvec_of(divec a)
{
  return (dvec)(a + (divec)DSPLAT(DOUBLE_ROUNDER)) - DSPLAT(DOUBLE_ROUNDER);
}

/* Half h of a vector of reals as doubles, and back. GCC widens eight floats in two halves without
   the explicit instruction. */
OPERATION dvec vec_widened(const vec *x, int h)
{
  hvec half;
  memcpy(&half, (const char *)x + (size_t)h * sizeof half, sizeof half);
#if defined(SINGLE) && defined(WIDENED_PS)
  return WIDENED_PS(half);
#else
  return __builtin_convertvector(half, dvec);
#endif
}

OPERATION void vec_narrow(vec *x, int h, dvec value)
{
  const hvec half = __builtin_convertvector(value, hvec);
  memcpy((char *)x + (size_t)h * sizeof half, &half, sizeof half);
}

/* sin and cos: reduction to [-pi/4, pi/4] with pi/2 in two parts (for floats three; Cody and Waite),
   whose products are rounded only with their sums. Then polynomials: for doubles those of Sun's
   fdlibm to x^13 and x^14, within 2^-58; for floats Taylor's to x^9 and x^10, whose remainder is
   below half an ulp. Joint angles are a few radians; beyond 1e5 rad (floats 1e4 rad) accuracy is
   lost, and such a walk has long diverged. */
OPERATION void vec_sincos(vec x, vec *sine, vec *cosine)
{
  const vec rounded = vec_fma(x, SPLAT(0x1.45f306dc9c883p-1), SPLAT(ROUNDER));
  const ivec quadrant = (ivec)rounded;
  const vec n = rounded - SPLAT(ROUNDER);
#ifdef SINGLE
  vec y = vec_fnma(n, SPLAT(0x1.92p+0), x);
  y = vec_fnma(n, SPLAT(0x1.fb4p-12), y);
  y = vec_fnma(n, SPLAT(0x1.4442d2p-24), y);
  const vec z = y * y;
  vec s = SPLAT(1.0 / 362880.0);
  s = vec_fma(s, z, SPLAT(-1.0 / 5040.0));
  s = vec_fma(s, z, SPLAT(1.0 / 120.0));
  s = vec_fma(s, z, SPLAT(-1.0 / 6.0));
  vec c = SPLAT(-1.0 / 3628800.0);
  c = vec_fma(c, z, SPLAT(1.0 / 40320.0));
  c = vec_fma(c, z, SPLAT(-1.0 / 720.0));
  c = vec_fma(c, z, SPLAT(1.0 / 24.0));
#else
  vec y = vec_fnma(n, SPLAT(0x1.921fb54442d18p+0), x);
  y = vec_fnma(n, SPLAT(0x1.1a62633145c07p-54), y);
  const vec z = y * y;
  vec s = SPLAT(1.58969099521155010221e-10);
  s = vec_fma(s, z, SPLAT(-2.50507602534068634195e-08));
  s = vec_fma(s, z, SPLAT(2.75573137070700676789e-06));
  s = vec_fma(s, z, SPLAT(-1.98412698298579493134e-04));
  s = vec_fma(s, z, SPLAT(8.33333333332248946124e-03));
  s = vec_fma(s, z, SPLAT(-1.66666666666666324348e-01));
  vec c = SPLAT(-1.13596475577881948265e-11);
  c = vec_fma(c, z, SPLAT(2.08757232129817482790e-09));
  c = vec_fma(c, z, SPLAT(-2.75573143513906633035e-07));
  c = vec_fma(c, z, SPLAT(2.48015872894767294178e-05));
  c = vec_fma(c, z, SPLAT(-1.38888888888741095749e-03));
  c = vec_fma(c, z, SPLAT(4.16666666666666019037e-02));
#endif
  s = vec_fma(y, z * s, y);
  c = vec_fnma(z, vec_fnma(z, c, SPLAT(0.5)), SPLAT(1.0));
  const ivec odd = -(quadrant & 1);
  const ivec sign_s = (quadrant & 2) << (8 * sizeof(real) - 2);
  const ivec sign_c = ((quadrant + 1) & 2) << (8 * sizeof(real) - 2);
  *sine = (vec)((ivec)vec_select(odd, c, s) ^ sign_s);
  *cosine = (vec)((ivec)vec_select(odd, s, c) ^ sign_c);
}

/* Bits of a real's exponent above those of its fraction. */
#ifdef SINGLE
#define FRACTION_BITS_OF_REAL 23
#define BIAS 127
#define MOST_EXPONENT 87.0
#else
#define FRACTION_BITS_OF_REAL 52
#define BIAS 1023
#define MOST_EXPONENT 708.0
#endif

/* e^x, within 1e-15 (floats 1e-7) of its size: 2^n e^y with |y| <= ln 2 / 2, and Taylor's polynomial. */
OPERATION vec vec_exp(vec x)
{
  const vec within = vec_min(vec_max(x, SPLAT(-MOST_EXPONENT)), SPLAT(MOST_EXPONENT));
  const vec rounded = vec_fma(within, SPLAT(0x1.71547652b82fep+0), SPLAT(ROUNDER));
  const vec n = rounded - SPLAT(ROUNDER);
#ifdef SINGLE
  const vec y = vec_fnma(n, SPLAT(-0x1.05c61p-29), vec_fnma(n, SPLAT(0x1.62e43p-1), within));
  int terms = 7;
#else
  const vec y = vec_fnma(n, SPLAT(0x1.abc9e3b39803fp-56), vec_fnma(n, SPLAT(0x1.62e42fefa39efp-1), within));
  int terms = 13;
#endif
  vec sum = SPLAT(1.0);
  for (; terms > 0; terms--) sum = vec_fma(sum * y, SPLAT(1.0 / terms), SPLAT(1.0));
  return sum * (vec)(((ivec)rounded + BIAS) << FRACTION_BITS_OF_REAL);
}

/* ln x of a positive x: e ln 2 + 2 artanh f with x = 2^e (1 + f) / (1 - f); about -BIAS ln 2 for 0. */
OPERATION vec vec_log(vec x)
{
  const ivec one = (ivec)SPLAT(1.0), fraction = ISPLAT(((integer)1 << FRACTION_BITS_OF_REAL) - 1);
  const vec whole = (vec)(((ivec)x & fraction) | one);
  const ivec large = whole > SPLAT(0x1.6a09e667f3bcdp+0);
  const vec m = vec_select(large, whole * SPLAT(0.5), whole);
  const ivec e = ((ivec)x >> FRACTION_BITS_OF_REAL) - BIAS - large;
  const vec f = (m - SPLAT(1.0)) / (m + SPLAT(1.0)), z = f * f;
#ifdef SINGLE
  int terms = 9;
#else
  int terms = 21;
#endif
  vec sum = SPLAT(0.0);
  for (; terms > 0; terms -= 2) sum = vec_fma(sum, z, SPLAT(2.0 / terms));
  const vec exponent = (vec)(e + (ivec)SPLAT(ROUNDER)) - SPLAT(ROUNDER);
  return vec_fma(exponent, SPLAT(0x1.62e42fefa39efp-1), sum * f);
}

/* x^y of x >= 0 and y > 0. */
OPERATION vec vec_pow(vec x, vec y) { return vec_exp(y * vec_log(x)); }
