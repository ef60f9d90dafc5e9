/* Walkers in lock-step: a vector of doubles, one lane a walker.
   Every operation is IEEE-exact or built from such, so a lane's bits do not depend on compiler,
   machine or neighbours. No libm: its last bits differ between systems. */
#include <stdint.h>
#include <string.h>
#ifdef __AVX__
#include <immintrin.h>
#endif

typedef double vec __attribute__((vector_size(8 * LANES)));
typedef int64_t ivec __attribute__((vector_size(8 * LANES)));

/* Not every source uses all of them. */
#define OPERATION static inline __attribute__((unused))

#define SPLAT(x) ((vec){0} + (x))
#define ISPLAT(x) ((ivec){0} + (x))

OPERATION vec vec_select(ivec mask, vec a, vec b)
{
  return (vec)((mask & (ivec)a) | (~mask & (ivec)b));
}

/* Of a NaN and a number, the second operand: what the instruction does, spelt out elsewhere. */
#if defined(__AVX512F__) && LANES == 8
OPERATION vec vec_max(vec a, vec b) { return (vec)_mm512_max_pd((__m512d)a, (__m512d)b); }
OPERATION vec vec_min(vec a, vec b) { return (vec)_mm512_min_pd((__m512d)a, (__m512d)b); }
#elif defined(__AVX__) && LANES == 4
OPERATION vec vec_max(vec a, vec b) { return (vec)_mm256_max_pd((__m256d)a, (__m256d)b); }
OPERATION vec vec_min(vec a, vec b) { return (vec)_mm256_min_pd((__m256d)a, (__m256d)b); }
#else
OPERATION vec vec_max(vec a, vec b) { return vec_select(a > b, a, b); }
OPERATION vec vec_min(vec a, vec b) { return vec_select(a < b, a, b); }
#endif
OPERATION vec vec_less(vec a, vec b) { return (vec)((a < b) & (ivec)SPLAT(1.0)); }
OPERATION vec vec_abs(vec a) { return (vec)((ivec)a & ISPLAT(INT64_MAX)); }

OPERATION vec vec_sqrt(vec a)
{
#if defined(__AVX512F__) && LANES == 8
  return (vec)_mm512_sqrt_pd((__m512d)a);
#elif defined(__AVX__) && LANES == 4
  return (vec)_mm256_sqrt_pd((__m256d)a);
#else
  vec r;
  for (int k = 0; k < LANES; k++) r[k] = __builtin_sqrt(a[k]);
  return r;
#endif
}

/* Adding 1.5 * 2^52 rounds to the nearest integer and leaves it in the low bits. */
#define ROUNDER 6755399441055744.0

OPERATION ivec vec_round_int(vec a)
{
  const ivec bits = (ivec)(a + SPLAT(ROUNDER)) - (ivec)SPLAT(ROUNDER);
  return bits;
}

/* sin and cos: reduction to [-pi/4, pi/4] with pi/2 in three parts (Cody and Waite), then Taylor
   polynomials to x^17 and x^18, whose remainder is below half an ulp there. Joint angles are a
   few radians; beyond 1e5 rad accuracy is lost, and such a walk has long diverged. */
OPERATION void vec_sincos(vec x, vec *sine, vec *cosine)
{
  const vec rounded = x * SPLAT(0x1.45f306dc9c883p-1) + SPLAT(ROUNDER);
  const ivec quadrant = (ivec)rounded;
  const vec n = rounded - SPLAT(ROUNDER);
  vec y = x - n * SPLAT(0x1.921fb54400000p+0);
  y = y - n * SPLAT(0x1.0b4611a600000p-34);
  y = y - n * SPLAT(0x1.3198a2e037073p-69);
  const vec z = y * y;
  vec s = SPLAT(1.0 / 355687428096000.0);
  s = s * z + SPLAT(-1.0 / 1307674368000.0);
  s = s * z + SPLAT(1.0 / 6227020800.0);
  s = s * z + SPLAT(-1.0 / 39916800.0);
  s = s * z + SPLAT(1.0 / 362880.0);
  s = s * z + SPLAT(-1.0 / 5040.0);
  s = s * z + SPLAT(1.0 / 120.0);
  s = s * z + SPLAT(-1.0 / 6.0);
  s = y + y * (z * s);
  vec c = SPLAT(-1.0 / 6402373705728000.0);
  c = c * z + SPLAT(1.0 / 20922789888000.0);
  c = c * z + SPLAT(-1.0 / 87178291200.0);
  c = c * z + SPLAT(1.0 / 479001600.0);
  c = c * z + SPLAT(-1.0 / 3628800.0);
  c = c * z + SPLAT(1.0 / 40320.0);
  c = c * z + SPLAT(-1.0 / 720.0);
  c = c * z + SPLAT(1.0 / 24.0);
  c = SPLAT(1.0) - z * (SPLAT(0.5) - z * c);
  const ivec odd = -(quadrant & 1);
  const ivec sign_s = (quadrant & 2) << 62;
  const ivec sign_c = ((quadrant + 1) & 2) << 62;
  *sine = (vec)((ivec)vec_select(odd, c, s) ^ sign_s);
  *cosine = (vec)((ivec)vec_select(odd, s, c) ^ sign_c);
}
