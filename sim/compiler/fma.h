/* a b + c, a b - c and c - a b, rounded once: the bits of the instructions that AVX2, AVX-512 and
   NEON have. Processors without one (x86-64-v2) compute them from sums and products, exactly but
   with some fifty operations in place of one. */
#if defined(__AVX512F__) && !defined(SINGLE) && LANES == 8
#define FUSED(name, a, b, c) (vec)_mm512_##name##_pd((__m512d)(a), (__m512d)(b), (__m512d)(c))
#elif defined(__AVX512F__) && defined(SINGLE) && LANES == 16
#define FUSED(name, a, b, c) (vec)_mm512_##name##_ps((__m512)(a), (__m512)(b), (__m512)(c))
#elif defined(__FMA__) && !defined(SINGLE) && LANES == 4
#define FUSED(name, a, b, c) (vec)_mm256_##name##_pd((__m256d)(a), (__m256d)(b), (__m256d)(c))
#elif defined(__FMA__) && defined(SINGLE) && LANES == 8
#define FUSED(name, a, b, c) (vec)_mm256_##name##_ps((__m256)(a), (__m256)(b), (__m256)(c))
#endif

#ifdef FUSED
OPERATION vec vec_fma(vec a, vec b, vec c) { return FUSED(fmadd, a, b, c); }
OPERATION vec vec_fms(vec a, vec b, vec c) { return FUSED(fmsub, a, b, c); }
OPERATION vec vec_fnma(vec a, vec b, vec c) { return FUSED(fnmadd, a, b, c); }
#else

#if defined(__aarch64__) && !defined(SINGLE) && LANES == 2
OPERATION vec vec_fma(vec a, vec b, vec c)
{
  return (vec)vfmaq_f64((float64x2_t)c, (float64x2_t)a, (float64x2_t)b);
}
#elif defined(__aarch64__) && defined(SINGLE) && LANES == 4
OPERATION vec vec_fma(vec a, vec b, vec c)
{
  return (vec)vfmaq_f32((float32x4_t)c, (float32x4_t)a, (float32x4_t)b);
}
#elif defined(SINGLE)
/* A product of floats is exact in doubles, and a sum that is rounded to odd there can be rounded
   again without harm: doubles have more than twice the bits (Boldo and Melquiond, 2008). */
OPERATION vec vec_fma(vec a, vec b, vec c)
{
  vec r;
  for (int k = 0; k < LANES; k++) {
    const double product = (double)a[k] * (double)b[k], addend = (double)c[k];
    double sum = product + addend;
    const double back = sum - product;
    const double error = (product - (sum - back)) + (addend - back);
    int64_t bits;
    memcpy(&bits, &sum, sizeof bits);
    if ((error > 0.0 || error < 0.0) && !(bits & 1)) bits += (error > 0.0) == (sum > 0.0) ? 1 : -1;
    memcpy(&sum, &bits, sizeof sum);
    r[k] = (float)sum;
  }
  return r;
}
#else
/* The halves of a, of 26 bits each (Veltkamp). */
OPERATION vec vec_upper(vec a)
{
  const vec scaled = a * SPLAT(134217729.0);
  return scaled - (scaled - a);
}

/* What rounding took from sum = a + b (Knuth). */
OPERATION vec vec_lost(vec a, vec b, vec sum)
{
  const vec back = sum - a;
  return (a - (sum - back)) + (b - back);
}

/* a + b rounded to odd: to the neighbour of odd last bit, unless it is exact. */
OPERATION vec vec_sum_to_odd(vec a, vec b)
{
  const vec sum = a + b, lost = vec_lost(a, b, sum);
  const ivec inexact = (lost > SPLAT(0.0)) | (lost < SPLAT(0.0));
  const ivec outwards = (lost > SPLAT(0.0)) == (sum > SPLAT(0.0));
  const ivec step = (outwards & 1) | (~outwards & -1);
  return (vec)((ivec)sum + (inexact & (((ivec)sum & 1) - 1) & step));
}

/* Boldo and Melquiond, "Emulation of a FMA and correctly rounded sums", 2008. Where parts of it
   overflow or underflow, the fma of libm serves, which the standard says is exact, too. */
OPERATION vec vec_fma(vec a, vec b, vec c)
{
  const vec product = a * b;
  const vec a1 = vec_upper(a), b1 = vec_upper(b), a2 = a - a1, b2 = b - b1;
  const vec rest = ((a1 * b1 - product) + a1 * b2 + a2 * b1) + a2 * b2;
  const vec low = c + rest, low_lost = vec_lost(c, rest, low);
  const vec high = product + low, high_lost = vec_lost(product, low, high);
  vec r = high + vec_sum_to_odd(low_lost, high_lost);
  /* An exact product: one sum, and the sign of a zero as it should be. */
  r = vec_select(rest == SPLAT(0.0), product + c, r);
  const ivec tiny = (vec_abs(product) < SPLAT(0x1p-960)) & (a != SPLAT(0.0)) & (b != SPLAT(0.0));
  const ivec fit = (vec_abs(a) < SPLAT(0x1p990)) & (vec_abs(b) < SPLAT(0x1p990)) &
                   (vec_abs(product) < SPLAT(0x1p1000)) & (vec_abs(c) < SPLAT(0x1p1000)) & ~tiny;
  for (int k = 0; k < LANES; k++)
    if (!fit[k]) r[k] = __builtin_fma(a[k], b[k], c[k]);
  return r;
}
#endif

OPERATION vec vec_fms(vec a, vec b, vec c) { return vec_fma(a, b, -c); }
OPERATION vec vec_fnma(vec a, vec b, vec c) { return vec_fma(-a, b, c); }
#endif
