/* Sensors, control laws and PWM of all lanes, around tick.c. Included after it. */

/* Coded integers of sensors and PWM, and rates; common to a batch. */
typedef struct {
  double angle_counts, current_counts, duty_per_count;
  int64_t angle_step, current_step, pwm_step, pwm_counts;
  int64_t substeps;   /* physics steps in a round */
  int64_t refinement; /* rounds in a control tick in which a foot may touch down; else one */
  int64_t inner_ticks; /* ticks of the actuators' joint PD in a control tick */
  const double *robot; /* NR constants */
} Coding;

/* gaitswarm.sim.controllers.base.LookupTable; values is NULL for no table. */
typedef struct {
  const int8_t *values;
  int64_t n_error, n_current, n_velocity;
  int64_t error_gain, current_gain, velocity_gain, output_gain;
} Table;

/* gaitswarm.sim.controllers.base.ControlLaw. */
typedef struct {
  int64_t proportional_gain, integral_gain, derivative_gain;
  Table direct, integrated;
  double stiffness, damping, feed_forward; /* of the joint PD */
} Law;

static void set_axis(Axis *a, int k, int64_t gain, int64_t middle, int64_t n, int64_t stride)
{
  OF_LANE(a->gain, k) = (double)gain / FRACTION;
  OF_LANE(a->middle, k) = (double)middle;
  OF_LANE(a->last, k) = (double)(n - 1);
  OF_LANE(a->stride, k) = (double)stride;
}

static void set_table(Tables *t, int k, const Table *table, dvec *gain, double unit)
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
  OF_LANE(gain, k) = (double)table->output_gain / unit;
}

/* Sets a lane's control law and clears its state. */
static void set_control(Gains *g, Past *p, int k, const Law *law)
{
  OF_LANE(g->proportional_gain, k) = (double)law->proportional_gain / FRACTION;
  OF_LANE(g->derivative_gain, k) = (double)law->derivative_gain / FRACTION;
  OF_LANE(g->integral_gain, k) = (double)law->integral_gain / INTEGRAL;
  set_table(&g->direct, k, &law->direct, g->direct_gain, FRACTION);
  set_table(&g->integrated, k, &law->integrated, g->integrated_gain, INTEGRAL);
  for (int j = 0; j < NJ; j++) OF_LANE(p->sum[j], k) = OF_LANE(p->error[j], k) = 0.0;
  OF_LANE(p->begun, k) = 0;
}

/* The bounds keep a diverged lane inside the tables. */
static dvec code_of(dvec reading, double counts, double low, double high, int64_t step)
{
  return coarsen(dvec_round(clamp(reading * DSPLAT(counts), DSPLAT(low), DSPLAT(high))), step);
}

/* Readings of joint j from its encoder and its current sensor. */
static void read_joint(Readings *r, const Past *p, const Coding *c, int j, int h, dvec angle,
                       dvec current, dvec desired)
{
  read_codes(r, p, j, h, desired,
             code_of(angle, c->angle_counts, -4 * CODE_LIMIT, 4 * CODE_LIMIT, c->angle_step),
             code_of(current, c->current_counts, 0, CODE_LIMIT, c->current_step));
}
