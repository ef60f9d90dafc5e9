/* This machine's instructions on a whole register of doubles (PD) or floats (PS) for which C has no
   operator that reliably becomes them. None is defined if a register is not as wide as a vector, or
   has no such instruction.

   GCC has its own names for them, which avoid its header of all instructions: reading that takes
   half as long as compiling a kernel. */
#if defined(__has_builtin) && !defined(__clang__)
#if __has_builtin(__builtin_ia32_vfmsubpd256)
#define NAMED_256
#endif
#if __has_builtin(__builtin_ia32_vfmsubpd512_mask)
#define NAMED_512
/* The current rounding mode: to nearest. */
#define AS_SET 4
/* A mask of all lanes. GCC takes some as unsigned char, others as signed. */
#define ALL -1
#define ALL_UNSIGNED ((unsigned char)0xff)
#endif
#endif

#if defined(__AVX512F__) && DOUBLES == 8 && defined(NAMED_512)
#define MAX_PD(a, b) __builtin_ia32_maxpd512_mask(a, b, (dvec){0}, ALL_UNSIGNED, AS_SET)
#define MAX_PS(a, b) __builtin_ia32_maxps512_mask(a, b, (vec){0}, ALL, AS_SET)
#define MIN_PD(a, b) __builtin_ia32_minpd512_mask(a, b, (dvec){0}, ALL_UNSIGNED, AS_SET)
#define MIN_PS(a, b) __builtin_ia32_minps512_mask(a, b, (vec){0}, ALL, AS_SET)
#define SQRT_PD(a) __builtin_ia32_sqrtpd512_mask(a, (dvec){0}, ALL, AS_SET)
#define SQRT_PS(a) __builtin_ia32_sqrtps512_mask(a, (vec){0}, ALL, AS_SET)
#define WIDENED_PS(half) __builtin_ia32_cvtps2pd512_mask(half, (dvec){0}, ALL, AS_SET)
#define FMA_PD(a, b, c) __builtin_ia32_vfmaddpd512_mask(a, b, c, ALL_UNSIGNED, AS_SET)
#define FMA_PS(a, b, c) __builtin_ia32_vfmaddps512_mask(a, b, c, ALL, AS_SET)
#define FMS_PD(a, b, c) __builtin_ia32_vfmsubpd512_mask(a, b, c, ALL_UNSIGNED, AS_SET)
#define FMS_PS(a, b, c) __builtin_ia32_vfmsubps512_mask(a, b, c, ALL, AS_SET)
#define FNMA_PD(a, b, c) __builtin_ia32_vfnmaddpd512_mask(a, b, c, ALL_UNSIGNED, AS_SET)
#define FNMA_PS(a, b, c) __builtin_ia32_vfnmaddps512_mask(a, b, c, ALL, AS_SET)
#elif defined(__AVX512F__) && DOUBLES == 8
#include <immintrin.h>
#define MAX_PD(a, b) (dvec)_mm512_max_pd((__m512d)(a), (__m512d)(b))
#define MAX_PS(a, b) (vec)_mm512_max_ps((__m512)(a), (__m512)(b))
#define MIN_PD(a, b) (dvec)_mm512_min_pd((__m512d)(a), (__m512d)(b))
#define MIN_PS(a, b) (vec)_mm512_min_ps((__m512)(a), (__m512)(b))
#define SQRT_PD(a) (dvec)_mm512_sqrt_pd((__m512d)(a))
#define SQRT_PS(a) (vec)_mm512_sqrt_ps((__m512)(a))
#define WIDENED_PS(half) (dvec)_mm512_cvtps_pd((__m256)(half))
#define FMA_PD(a, b, c) (dvec)_mm512_fmadd_pd((__m512d)(a), (__m512d)(b), (__m512d)(c))
#define FMA_PS(a, b, c) (vec)_mm512_fmadd_ps((__m512)(a), (__m512)(b), (__m512)(c))
#define FMS_PD(a, b, c) (dvec)_mm512_fmsub_pd((__m512d)(a), (__m512d)(b), (__m512d)(c))
#define FMS_PS(a, b, c) (vec)_mm512_fmsub_ps((__m512)(a), (__m512)(b), (__m512)(c))
#define FNMA_PD(a, b, c) (dvec)_mm512_fnmadd_pd((__m512d)(a), (__m512d)(b), (__m512d)(c))
#define FNMA_PS(a, b, c) (vec)_mm512_fnmadd_ps((__m512)(a), (__m512)(b), (__m512)(c))
#elif defined(__AVX__) && DOUBLES == 4 && defined(NAMED_256)
#define MAX_PD(a, b) __builtin_ia32_maxpd256(a, b)
#define MAX_PS(a, b) __builtin_ia32_maxps256(a, b)
#define MIN_PD(a, b) __builtin_ia32_minpd256(a, b)
#define MIN_PS(a, b) __builtin_ia32_minps256(a, b)
#define SQRT_PD(a) __builtin_ia32_sqrtpd256(a)
#define SQRT_PS(a) __builtin_ia32_sqrtps256(a)
#define WIDENED_PS(half) __builtin_ia32_cvtps2pd256(half)
#ifdef __FMA__
#define FMA_PD(a, b, c) __builtin_ia32_vfmaddpd256(a, b, c)
#define FMA_PS(a, b, c) __builtin_ia32_vfmaddps256(a, b, c)
#define FMS_PD(a, b, c) __builtin_ia32_vfmsubpd256(a, b, c)
#define FMS_PS(a, b, c) __builtin_ia32_vfmsubps256(a, b, c)
#define FNMA_PD(a, b, c) __builtin_ia32_vfnmaddpd256(a, b, c)
#define FNMA_PS(a, b, c) __builtin_ia32_vfnmaddps256(a, b, c)
#endif
#elif defined(__AVX__) && DOUBLES == 4
#include <immintrin.h>
#define MAX_PD(a, b) (dvec)_mm256_max_pd((__m256d)(a), (__m256d)(b))
#define MAX_PS(a, b) (vec)_mm256_max_ps((__m256)(a), (__m256)(b))
#define MIN_PD(a, b) (dvec)_mm256_min_pd((__m256d)(a), (__m256d)(b))
#define MIN_PS(a, b) (vec)_mm256_min_ps((__m256)(a), (__m256)(b))
#define SQRT_PD(a) (dvec)_mm256_sqrt_pd((__m256d)(a))
#define SQRT_PS(a) (vec)_mm256_sqrt_ps((__m256)(a))
#define WIDENED_PS(half) (dvec)_mm256_cvtps_pd((__m128)(half))
#ifdef __FMA__
#define FMA_PD(a, b, c) (dvec)_mm256_fmadd_pd((__m256d)(a), (__m256d)(b), (__m256d)(c))
#define FMA_PS(a, b, c) (vec)_mm256_fmadd_ps((__m256)(a), (__m256)(b), (__m256)(c))
#define FMS_PD(a, b, c) (dvec)_mm256_fmsub_pd((__m256d)(a), (__m256d)(b), (__m256d)(c))
#define FMS_PS(a, b, c) (vec)_mm256_fmsub_ps((__m256)(a), (__m256)(b), (__m256)(c))
#define FNMA_PD(a, b, c) (dvec)_mm256_fnmadd_pd((__m256d)(a), (__m256d)(b), (__m256d)(c))
#define FNMA_PS(a, b, c) (vec)_mm256_fnmadd_ps((__m256)(a), (__m256)(b), (__m256)(c))
#endif
#elif defined(__aarch64__) && DOUBLES == 2
#include <arm_neon.h>
#define FMA_PD(a, b, c) (dvec)vfmaq_f64((float64x2_t)(c), (float64x2_t)(a), (float64x2_t)(b))
#define FMS_PD(a, b, c) FMA_PD(a, b, -(c))
#define FNMA_PD(a, b, c) FMA_PD(-(a), b, c)
#define FMA_PS(a, b, c) (vec)vfmaq_f32((float32x4_t)(c), (float32x4_t)(a), (float32x4_t)(b))
#define FMS_PS(a, b, c) FMA_PS(a, b, -(c))
#define FNMA_PS(a, b, c) FMA_PS(-(a), b, c)
#endif
