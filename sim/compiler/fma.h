/* a b + c, a b - c and c - a b, rounded once: the bits of the instructions of AVX2, AVX-512 and
   NEON. Processors without them (x86-64-v2) compute them exactly from sums and products, with some
   fifty operations instead of one. */
/* Not inlined: a step has thousands of them and would take minutes to compile. */
#define CALLED static __attribute__((noinline, unused))

#ifdef FMA_PD
OPERATION dvec dvec_fma(dvec a, dvec b, dvec c) { return FMA_PD(a, b, c); }
OPERATION dvec dvec_fms(dvec a, dvec b, dvec c) { return FMS_PD(a, b, c); }
OPERATION dvec dvec_fnma(dvec a, dvec b, dvec c) { return FNMA_PD(a, b, c); }
#else
/* The upper half of a, of 26 bits as the lower one (Veltkamp). */
OPERATION dvec upper_half(dvec a)
{
  const dvec scaled = a * DSPLAT(134217729.0);
  return scaled - (scaled - a);
}

/* Rounding error of sum = a + b (Knuth). */
OPERATION dvec lost_of_sum(dvec a, dvec b, dvec sum)
{
  const dvec back = sum - a;
  return (a - (sum - back)) + (b - back);
}

/* a + b rounded to odd: to the neighbour with an odd last bit, unless exact. */
OPERATION dvec sum_to_odd(dvec a, dvec b)
{
  const dvec sum = a + b, lost = lost_of_sum(a, b, sum), zero = DSPLAT(0.0);
  const divec inexact = (lost > zero) | (lost < zero), outwards = (lost > zero) == (sum > zero);
  const divec step = (outwards & 1) | (~outwards & -1);
  return (dvec)((divec)sum + (inexact & (((divec)sum & 1) - 1) & step));
}

OPERATION divec is_below(dvec a, double limit)
{
  return (dvec)((divec)a & INT64_MAX) < DSPLAT(limit);
}

/* Boldo and Melquiond, "Emulation of a FMA and correctly rounded sums", 2008. Where it overflows or
   underflows, libm's fma is used, which the standard requires to be exact too. */
CALLED dvec dvec_fma(dvec a, dvec b, dvec c)
{
  const dvec product = a * b, zero = DSPLAT(0.0);
  const dvec a1 = upper_half(a), b1 = upper_half(b), a2 = a - a1, b2 = b - b1;
  const dvec rest = ((a1 * b1 - product) + a1 * b2 + a2 * b1) + a2 * b2;
  const dvec low = c + rest, low_lost = lost_of_sum(c, rest, low);
  const dvec high = product + low, high_lost = lost_of_sum(product, low, high);
  /* Exact product: one sum, which also has the right sign of zero. */
  dvec r = dvec_select(rest == zero, product + c, high + sum_to_odd(low_lost, high_lost));
  const divec tiny = is_below(product, 0x1p-960) & (a != zero) & (b != zero);
  const divec fit = is_below(a, 0x1p990) & is_below(b, 0x1p990) & is_below(product, 0x1p1000) &
                    is_below(c, 0x1p1000) & ~tiny;
  for (int k = 0; k < DOUBLES; k++)
    if (!fit[k]) r[k] = __builtin_fma(a[k], b[k], c[k]);
  return r;
}
OPERATION dvec dvec_fms(dvec a, dvec b, dvec c) { return dvec_fma(a, b, -c); }
OPERATION dvec dvec_fnma(dvec a, dvec b, dvec c) { return dvec_fma(-a, b, c); }
#endif

#ifndef SINGLE
OPERATION vec vec_fma(vec a, vec b, vec c) { return dvec_fma(a, b, c); }
OPERATION vec vec_fms(vec a, vec b, vec c) { return dvec_fms(a, b, c); }
OPERATION vec vec_fnma(vec a, vec b, vec c) { return dvec_fnma(a, b, c); }
#elif defined(FMA_PS)
OPERATION vec vec_fma(vec a, vec b, vec c) { return FMA_PS(a, b, c); }
OPERATION vec vec_fms(vec a, vec b, vec c) { return FMS_PS(a, b, c); }
OPERATION vec vec_fnma(vec a, vec b, vec c) { return FNMA_PS(a, b, c); }
#else
/* A product of floats is exact in doubles, and a sum rounded to odd there can be rounded again
   without error: doubles have more than twice the bits. */
CALLED vec vec_fma(vec a, vec b, vec c)
{
  vec r;
  for (int k = 0; k < LANES; k++) {
    const double product = (double)a[k] * (double)b[k], addend = (double)c[k];
    double sum = product + addend;
    const double back = sum - product, lost = (product - (sum - back)) + (addend - back);
    int64_t bits;
    memcpy(&bits, &sum, sizeof bits);
    if ((lost > 0.0 || lost < 0.0) && !(bits & 1)) bits += (lost > 0.0) == (sum > 0.0) ? 1 : -1;
    memcpy(&sum, &bits, sizeof sum);
    r[k] = (float)sum;
  }
  return r;
}
OPERATION vec vec_fms(vec a, vec b, vec c) { return vec_fma(a, b, -c); }
OPERATION vec vec_fnma(vec a, vec b, vec c) { return vec_fma(-a, b, c); }
#endif
