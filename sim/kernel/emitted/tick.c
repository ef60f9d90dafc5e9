/* The control tick (thesis 5.3): from coded readings to PWM counts, in whole numbers.

   The single source for simulator and robot: the kernel compiles it for vectors of doubles, one lane
   per walk, the firmware for integers. Included after counts.h, which defines the types count, fine
   and integral and their arithmetic, and after NJ (joints), LANES (walks) and HALVES (vectors for
   all lanes), both 1 on a microcontroller. The Python twin is control_tick.py. */

#define CODE_LIMIT 65535

/* An input of a table: index of x is x * gain + middle, rounded and clamped to 0..last. */
typedef struct {
  fine gain[HALVES];
  count middle[HALVES], last[HALVES], stride[HALVES];
} Axis;

typedef struct {
  const int8_t *values[LANES];
  Axis error, current, velocity;
  int used; /* whether any lane has one */
} Tables;

/* gaitswarm.sim.controllers.base.ControlLaw. */
typedef struct {
  fine proportional_gain[HALVES], derivative_gain[HALVES], direct_gain[HALVES];
  integral integral_gain[HALVES], integrated_gain[HALVES];
  Tables direct, integrated;
} Gains;

/* State of the controllers between ticks. */
typedef struct {
  integral sum[NJ][HALVES];
  count error[NJ][HALVES];
  mask begun[HALVES]; /* lanes that have an error to compare with */
} Past;

/* Coded angle errors, their change since the previous tick, and absolute currents. */
typedef struct {
  count error[NJ][HALVES], change[NJ][HALVES], current[NJ][HALVES];
} Readings;

/* Readings of joint j from the codes of its encoder, its current sensor and the gait. */
static void read_codes(Readings *r, const Past *p, int j, int h, count desired, count angle,
                       count current)
{
  const count limit = COUNTS(CODE_LIMIT);
  r->error[j][h] = clamp(desired - angle, -limit, limit);
  r->change[j][h] = choose(p->begun[h], r->error[j][h] - p->error[j][h], COUNTS(0));
  r->current[j][h] = current;
}

static count index_of(const Axis *a, int h, count x)
{
  const fine index = whole_of_fine((fine)x * a->gain[h]) + (fine)a->middle[h];
  return (count)clamp(index, (fine)COUNTS(0), (fine)a->last[h]) * a->stride[h];
}

/* All joints together: reading a lane's number directly after writing the vector stalls. */
static void look_up(const Tables *t, const Readings *r, count (*values)[HALVES])
{
  place at[NJ][HALVES];
  for (int j = 0; j < NJ; j++)
    for (int h = 0; h < HALVES; h++)
      at[j][h] = place_of(index_of(&t->error, h, r->error[j][h]) +
                          index_of(&t->current, h, r->current[j][h]) +
                          index_of(&t->velocity, h, r->change[j][h]));
  for (int j = 0; j < NJ; j++)
    for (int k = 0; k < LANES; k++) OF_LANE(at[j], k) = t->values[k][OF_LANE(at[j], k)];
  for (int j = 0; j < NJ; j++)
    for (int h = 0; h < HALVES; h++) values[j][h] = count_of(at[j][h]);
}

static void look_up_if_used(const Tables *t, const Readings *r, count (*values)[HALVES])
{
  if (t->used) {
    look_up(t, r, values);
    return;
  }
  for (int j = 0; j < NJ; j++)
    for (int h = 0; h < HALVES; h++) values[j][h] = COUNTS(0);
}

/* PWM counts of all joints, clamped to full scale; lanes that do not begin a tick keep their state. */
static void control(const Gains *g, Past *p, const Readings *r, const mask *begins, count full,
                    int64_t pwm_step, count (*pwm)[HALVES])
{
  const integral most = INTEGRAL_OF(full);
  count direct[NJ][HALVES], integrated[NJ][HALVES];
  look_up_if_used(&g->direct, r, direct);
  look_up_if_used(&g->integrated, r, integrated);
  for (int j = 0; j < NJ; j++)
    for (int h = 0; h < HALVES; h++) {
      const count error = r->error[j][h];
      const fine now = (fine)error * g->proportional_gain[h] +
                       (fine)r->change[j][h] * g->derivative_gain[h] +
                       (fine)direct[j][h] * g->direct_gain[h];
      const integral grown = p->sum[j][h] + (integral)error * g->integral_gain[h] +
                             (integral)integrated[j][h] * g->integrated_gain[h];
      const integral sum = clamp(grown, -most, most);
      p->error[j][h] = choose(begins[h], error, p->error[j][h]);
      p->sum[j][h] = choose(begins[h], sum, p->sum[j][h]);
      const fine output = clamp(whole_of_fine(now) + (fine)whole_of_integral(sum), -full, full);
      pwm[j][h] = clamp(coarsen((count)output, pwm_step), -full, full);
    }
  for (int h = 0; h < HALVES; h++) p->begun[h] |= begins[h];
}
