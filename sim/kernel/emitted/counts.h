/* The arithmetic of tick.c on lanes: whole numbers in vectors of doubles, all of them exact below
   2^53, which walk.py ensures. Numbers of 16 or 32 fraction bits are divided by 2^16 or 2^32.
   sim/firmware/code/counts.h is the same in integers. Included after vec.h and NJ (joints). */

#define FRACTION 0x1p16
#define INTEGRAL 0x1p32

typedef dvec count;    /* angles, currents, PWM [counts] */
typedef dvec fine;     /* of 16 fraction bits */
typedef dvec integral; /* of 32 fraction bits */
typedef divec place;   /* in a table */
typedef divec mask;    /* of lanes, -1 or 0 */

#define COUNTS(x) DSPLAT(x)
#define INTEGRAL_OF(x) (x)

/* A NaN becomes the lower bound. */
static dvec clamp(dvec x, dvec low, dvec high) { return dvec_min(dvec_max(x, low), high); }

static dvec choose(divec where, dvec a, dvec b) { return dvec_select(where, a, b); }

static dvec half_up(dvec x) { return dvec_floor(x + DSPLAT(0.5)); }
static dvec whole_of_fine(dvec x) { return half_up(x); }
static dvec whole_of_integral(dvec x) { return half_up(x); }

/* Nearest multiple of step, halves away from the lower one. x is whole, so the added half keeps the
   quotient away from whole numbers by more than the product's rounding. */
static dvec coarsen(dvec x, int64_t step)
{
  if (step == 1) return x;
  const double middle = (double)(step / 2) + 0.5, inverse = 1.0 / (double)step;
  return dvec_floor((x + DSPLAT(middle)) * DSPLAT(inverse)) * DSPLAT(step);
}

static divec place_of(dvec x) { return dvec_whole(x); }
static dvec count_of(divec x) { return dvec_of(x); }
