/* The arithmetic of tick.c on a microcontroller: integers, no floating point. The simulator compiles
   the same source for vectors of doubles, which hold the same whole numbers. law.h defines the
   widths.

   Shifts of negative numbers are arithmetic with every compiler for microcontrollers; C leaves it
   open, so it is checked here. */
#ifndef COUNTS_H
#define COUNTS_H

#include <stdint.h>

#if (-1 >> 1) != -1
#error "right shifts must be arithmetic"
#endif

/* One walker, one vector. */
#define LANES 1
#define HALVES 1
#define OF_LANE(x, k) ((x)[k])

typedef int32_t count;    /* angles, currents, PWM [counts] */
typedef int64_t integral; /* of 32 fraction bits */
typedef int32_t place;    /* in a table */
typedef int32_t mask;     /* -1 or 0 */
#if FINE_BITS == 32
typedef int32_t fine; /* of 16 fraction bits */
#else
typedef int64_t fine;
#endif

#define COUNTS(x) ((count)(x))
#define INTEGRAL_OF(x) ((integral)(x) * ((integral)1 << 32))

#define clamp(x, low, high) ((x) < (low) ? (low) : (x) > (high) ? (high) : (x))
#define choose(mask, a, b) ((mask) ? (a) : (b))

/* Halves up. */
static fine whole_of_fine(fine x) { return (x + ((fine)1 << 15)) >> 16; }
static integral whole_of_integral(integral x) { return (x + ((integral)1 << 31)) >> 32; }

/* Nearest multiple of step, halves up. */
static count coarsen(count x, int64_t step)
{
  if (step == 1) return x;
  const count width = (count)step, raised = x + width / 2;
  const count left = raised % width;
  return raised - (left < 0 ? left + width : left);
}

#define place_of(x) (x)
#define count_of(x) (x)

#endif
