/* The controller of one leg: tick.c with the numbers of law.h. */
#include "controller.h"

#include "law.h"
#include "tables.h"
#define NJ CONTROLLER_JOINTS
#include "counts.h"
#include "tick.c"

#if !DIRECT_USED || !INTEGRATED_USED
static const int8_t nothing[1] = {0};
#endif
#if !DIRECT_USED
#define direct_table nothing
#endif
#if !INTEGRATED_USED
#define integrated_table nothing
#endif

#define AXIS(gain, middle, n, stride) {{gain}, {middle}, {(n) - 1}, {stride}}
#define TABLES(values, name)                                                                         \
  {                                                                                                  \
    {values},                                                                                        \
        AXIS(name##_ERROR_GAIN, name##_ERRORS / 2, name##_ERRORS,                                    \
             (count)name##_CURRENTS *name##_VELOCITIES),                                             \
        AXIS(name##_CURRENT_GAIN, 0, name##_CURRENTS, name##_VELOCITIES),                            \
        AXIS(name##_VELOCITY_GAIN, name##_VELOCITIES / 2, name##_VELOCITIES, 1), name##_USED         \
  }

static const Gains gains = {
    {PROPORTIONAL_GAIN},
    {DERIVATIVE_GAIN},
    {DIRECT_GAIN},
    {INTEGRAL_GAIN},
    {INTEGRATED_GAIN},
    TABLES(direct_table, DIRECT),
    TABLES(integrated_table, INTEGRATED),
};

static Past past;

void controller_start(void)
{
  for (int j = 0; j < NJ; j++) past.sum[j][0] = past.error[j][0] = 0;
  past.begun[0] = 0;
}

void controller_tick(const int16_t *desired, const int16_t *angle, const uint16_t *current,
                     int16_t *pwm)
{
  const mask begins[1] = {-1};
  Readings readings;
  count counts[NJ][1];
  for (int j = 0; j < NJ; j++)
    read_codes(&readings, &past, j, 0, desired[j], angle[j], current[j]);
  control(&gains, &past, &readings, begins, CONTROLLER_FULL_SCALE, CONTROLLER_PWM_STEP, counts);
  for (int j = 0; j < NJ; j++) pwm[j] = (int16_t)counts[j][0];
}
