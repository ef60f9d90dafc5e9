/* The control law in integers. Gains have 16 fraction bits, those of the integral part 32. Largest
   values of the numbers of tick.c for any readings, and the bits that hold them:

$ranges
*/
#ifndef LAW_H
#define LAW_H

$numbers

#if FINE_BITS == 32
#define FINE_MOST 2147483647
#else
#define FINE_MOST 9223372036854775807
#endif

/* A half is added before a number is rounded, and the middle of an axis to its index. */
#if 65535 * PROPORTIONAL_GAIN + 131070 * DERIVATIVE_GAIN + DIRECT_LARGEST * DIRECT_GAIN >             \
    FINE_MOST - 32768
#error "the direct part needs wider integers"
#endif
#if 65535 * DIRECT_ERROR_GAIN > FINE_MOST - 98304 || 65535 * DIRECT_CURRENT_GAIN > FINE_MOST - 98304 ||   \
    131070 * DIRECT_VELOCITY_GAIN > FINE_MOST - 98304
#error "the direct table's indices need wider integers"
#endif
#if 65535 * INTEGRATED_ERROR_GAIN > FINE_MOST - 98304 ||                                             \
    65535 * INTEGRATED_CURRENT_GAIN > FINE_MOST - 98304 ||                                           \
    131070 * INTEGRATED_VELOCITY_GAIN > FINE_MOST - 98304
#error "the integrated table's indices need wider integers"
#endif
#if 65535 * INTEGRAL_GAIN + INTEGRATED_LARGEST * INTEGRATED_GAIN > 4611686018427387904
#error "the integral part needs wider integers"
#endif

#endif
