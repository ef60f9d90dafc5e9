/* Sensors, controllers and PWM of all lanes in whole numbers, which are doubles (thesis 5.3).
   Included after vec.h and NJ (joints). The Python twin is reference.py. */

#define FRACTION 0x1p16
#define INTEGRAL 0x1p32
#define CODE_LIMIT 65535

/* Sensors and PWM in coded integers, and the rates; one for a whole batch. */
typedef struct {
  double angle_counts, current_counts, duty_per_count;
  int64_t angle_step, current_step, pwm_step, pwm_counts;
  int64_t substeps;   /* physics steps in a round */
  int64_t refinement; /* rounds in a control tick in which a foot may come down; else one */
  const double *robot; /* NR, its constants */
} Coding;

/* sim.controllers.base.LookupTable; values is NULL where there is none. */
typedef struct {
  const int8_t *values;
  int64_t n_error, n_current, n_velocity;
  int64_t error_gain, current_gain, velocity_gain, output_gain;
} Table;

/* sim.controllers.base.ControlLaw. */
typedef struct {
  int64_t proportional_gain, integral_gain, derivative_gain;
  Table direct, integrated;
} Law;

/* An input of a table: index of x is x * gain + middle, rounded and held in 0..last. */
typedef struct {
  wide gain, middle, last, stride;
} Axis;

typedef struct {
  const int8_t *values[LANES];
  Axis error, current, velocity;
  wide output_gain;
  int used; /* whether any lane has one */
} Tables;

/* The controllers' integers, in doubles: below 2^53, as walk.py sees to, all of them are exact.
   Those of 16 or 32 fraction bits are divided by 2^16 or 2^32. */
typedef struct {
  wide proportional_gain, integral_gain, derivative_gain;
  Tables direct, integrated;
  wide integral[NJ], error[NJ];
  divec begun[HALVES]; /* lanes that have an error to compare with */
} Control;

static void set_axis(Axis *a, int k, int64_t gain, int64_t middle, int64_t n, int64_t stride)
{
  OF_LANE(a->gain, k) = (double)gain / FRACTION;
  OF_LANE(a->middle, k) = (double)middle;
  OF_LANE(a->last, k) = (double)(n - 1);
  OF_LANE(a->stride, k) = (double)stride;
}

static void set_table(Tables *t, int k, const Table *table, double unit)
{
  static const int8_t nothing = 0;
  static const Table none = {&nothing, 1, 1, 1, 0, 0, 0, 0};
  if (table->values) t->used = 1;
  else table = &none;
  t->values[k] = table->values;
  set_axis(&t->error, k, table->error_gain, table->n_error / 2, table->n_error,
           table->n_current * table->n_velocity);
  set_axis(&t->current, k, table->current_gain, 0, table->n_current, table->n_velocity);
  set_axis(&t->velocity, k, table->velocity_gain, table->n_velocity / 2, table->n_velocity, 1);
  OF_LANE(t->output_gain, k) = (double)table->output_gain / unit;
}

static void set_control(Control *s, int k, const Law *law)
{
  OF_LANE(s->proportional_gain, k) = (double)law->proportional_gain / FRACTION;
  OF_LANE(s->derivative_gain, k) = (double)law->derivative_gain / FRACTION;
  OF_LANE(s->integral_gain, k) = (double)law->integral_gain / INTEGRAL;
  set_table(&s->direct, k, &law->direct, FRACTION);
  set_table(&s->integrated, k, &law->integrated, INTEGRAL);
  for (int j = 0; j < NJ; j++) OF_LANE(s->integral[j], k) = OF_LANE(s->error[j], k) = 0.0;
  OF_LANE(s->begun, k) = 0;
}

/* Of a NaN the lower bound. */
static dvec clamp(dvec x, dvec low, dvec high) { return dvec_min(dvec_max(x, low), high); }

static dvec half_up(dvec x) { return dvec_floor(x + DSPLAT(0.5)); }

/* Nearest multiple of step, halves away from the lower one. x is whole, so that the half that is
   added keeps the quotient clear of whole numbers by more than the product's rounding. */
static dvec coarsen(dvec x, int64_t step)
{
  if (step == 1) return x;
  const double middle = (double)(step / 2) + 0.5, inverse = 1.0 / (double)step;
  return dvec_floor((x + DSPLAT(middle)) * DSPLAT(inverse)) * DSPLAT(step);
}

static dvec place(const Axis *a, int h, dvec x)
{
  return clamp(half_up(x * a->gain[h]) + a->middle[h], DSPLAT(0.0), a->last[h]) * a->stride[h];
}

/* Coded angle errors, their change since the tick before, and absolute currents. */
typedef struct {
  wide error[NJ], change[NJ], current[NJ];
} Readings;

/* All joints at once: lanes' numbers are written and read apart, which stalls if it follows at once. */
static void look_up(const Tables *t, const Readings *r, wide *output)
{
  divec at[NJ][HALVES];
  for (int j = 0; j < NJ; j++)
    for (int h = 0; h < HALVES; h++)
      at[j][h] = dvec_whole(place(&t->error, h, r->error[j][h]) +
                            place(&t->current, h, r->current[j][h]) +
                            place(&t->velocity, h, r->change[j][h]));
  for (int j = 0; j < NJ; j++)
    for (int k = 0; k < LANES; k++) OF_LANE(at[j], k) = t->values[k][OF_LANE(at[j], k)];
  for (int j = 0; j < NJ; j++)
    for (int h = 0; h < HALVES; h++) output[j][h] = dvec_of(at[j][h]) * t->output_gain[h];
}

/* A diverged lane reads nonsense; the bounds keep it inside the tables. */
static dvec code_of(dvec reading, double counts, double low, double high, int64_t step)
{
  return coarsen(dvec_round(clamp(reading * DSPLAT(counts), DSPLAT(low), DSPLAT(high))), step);
}

/* Joint j's readings from its encoder and its current's sensor. */
static void read_joint(Readings *r, const Control *s, const Coding *c, int j, int h, dvec angle,
                       dvec current, dvec desired)
{
  const dvec limit = DSPLAT(CODE_LIMIT);
  const dvec code =
      code_of(angle, c->angle_counts, -4 * CODE_LIMIT, 4 * CODE_LIMIT, c->angle_step);
  r->error[j][h] = clamp(desired - code, -limit, limit);
  r->change[j][h] = (dvec)((divec)(r->error[j][h] - s->error[j][h]) & s->begun[h]);
  r->current[j][h] = code_of(current, c->current_counts, 0, CODE_LIMIT, c->current_step);
}

/* PWM counts of all joints (thesis 5.3); lanes in the midst of a tick keep what they remember. */
static void control(Control *s, const Coding *c, const Readings *r, const divec *begins,
                    wide *counts)
{
  const dvec full = DSPLAT(c->pwm_counts);
  wide direct[NJ], integrated[NJ];
  if (s->direct.used) look_up(&s->direct, r, direct);
  else memset(direct, 0, sizeof direct);
  if (s->integrated.used) look_up(&s->integrated, r, integrated);
  else memset(integrated, 0, sizeof integrated);
  for (int j = 0; j < NJ; j++)
    for (int h = 0; h < HALVES; h++) {
      const dvec error = r->error[j][h];
      const dvec now = error * s->proportional_gain[h] +
                       r->change[j][h] * s->derivative_gain[h] + direct[j][h];
      const dvec grown = s->integral[j][h] + error * s->integral_gain[h] + integrated[j][h];
      const dvec integral = clamp(grown, -full, full);
      s->error[j][h] = dvec_select(begins[h], error, s->error[j][h]);
      s->integral[j][h] = dvec_select(begins[h], integral, s->integral[j][h]);
      const dvec output = clamp(half_up(now) + half_up(integral), -full, full);
      counts[j][h] = clamp(coarsen(output, c->pwm_step), -full, full);
    }
  for (int h = 0; h < HALVES; h++) s->begun[h] |= begins[h];
}
