/* The walk: per control tick read the sensors, run the controller, step the physics, measure.
   Included after vec.h, the emitted function `step`, and the sizes NJ (joints), NI (numbers of
   the internal state), NP (parameters). ENCODER is where the encoders' angles lie: q + 7, or with
   backlash the internal state. The Python twin is reference.py. */

#define NQ (7 + NJ)
#define NV (6 + NJ)
#define N_INTEGRANDS 8
#define NLOG (NQ + NV + NI + NJ)

enum { OK = 0, DIVERGED = 1, FELL = 2 };

enum { FRACTION_BITS = 16, INTEGRAL_BITS = 32 };
#define CODE_LIMIT 65535

/* Sensors and PWM in coded integers, and the rates; one for a whole batch. */
typedef struct {
  double angle_counts, current_counts, duty_per_count;
  int64_t angle_step, current_step, pwm_step, pwm_counts, substeps;
} Coding;

/* sim.controllers.base.LookupTable; values is NULL where there is none. */
typedef struct {
  const int8_t *values;
  int64_t n_error, n_current, n_velocity;
  int64_t error_gain, current_gain, velocity_gain, output_gain;
} Table;

/* One walker: all it needs and all it leaves behind. Field by field as in native.py. */
typedef struct {
  const double *q0;             /* NQ, initial position; it starts at rest */
  const double *internal_state; /* NI, initial */
  const double *parameters;     /* NP */
  const int32_t *desired;       /* ticks x NJ, coded angles */
  const double *disturbance;    /* ticks x NJ, torque on the links [N m]; or NULL */
  int64_t proportional_gain, integral_gain, derivative_gain;
  Table direct, integrated;
  int64_t ticks;
  double fall_height;  /* of the body over the ground [m] */
  double fall_cosine;  /* of the tilt */
  double current_smoothing; /* of the current's analog low-pass, a step; 1 for none */
  double *sums;        /* N_INTEGRANDS, summed over physics steps */
  double *end;         /* NQ, final position */
  double *log;         /* ticks x NLOG: q, v, internal state, duty; or NULL */
  double peak_current; /* largest |I| of any motor [A] */
  int64_t status;
} Walker;

static int64_t clamp(int64_t x, int64_t low, int64_t high)
{
  return x < low ? low : x > high ? high : x;
}

/* Nearest multiple of step, halves away from the lower one. */
static int64_t coarsen(int64_t x, int64_t step)
{
  if (step == 1) return x;
  const int64_t shifted = x + step / 2;
  const int64_t floored = shifted >= 0 ? shifted / step : -((-shifted + step - 1) / step);
  return floored * step;
}

/* Fixed point to integer, halves up. */
static int64_t descale(int64_t x, int bits)
{
  return (x + ((int64_t)1 << (bits - 1))) >> bits;
}

static int64_t centred(int64_t x, int64_t gain, int64_t n)
{
  return clamp(descale(x * gain, FRACTION_BITS) + n / 2, 0, n - 1);
}

static int64_t look_up(const Table *t, int64_t error, int64_t current, int64_t change)
{
  const int64_t row = centred(error, t->error_gain, t->n_error);
  const int64_t column =
      clamp(descale(current * t->current_gain, FRACTION_BITS), 0, t->n_current - 1);
  const int64_t layer = centred(change, t->velocity_gain, t->n_velocity);
  return t->values[(row * t->n_current + column) * t->n_velocity + layer] * t->output_gain;
}

/* Controller of one joint: coded error, its change and current to PWM counts (thesis 5.3). */
static int64_t control(const Walker *w, const Coding *c, int64_t error, int64_t change,
                       int64_t current, int64_t *integral)
{
  const int64_t full = c->pwm_counts << INTEGRAL_BITS;
  int64_t direct = error * w->proportional_gain + change * w->derivative_gain;
  int64_t grown = *integral + error * w->integral_gain;
  if (w->direct.values) direct += look_up(&w->direct, error, current, change);
  if (w->integrated.values) grown += look_up(&w->integrated, error, current, change);
  *integral = clamp(grown, -full, full);
  const int64_t output = clamp(descale(direct, FRACTION_BITS) + descale(*integral, INTEGRAL_BITS),
                               -c->pwm_counts, c->pwm_counts);
  return clamp(coarsen(output, c->pwm_step), -c->pwm_counts, c->pwm_counts);
}

/* What a walker's controllers remember from tick to tick. */
typedef struct {
  int64_t integral[NJ][LANES], error[NJ][LANES];
} Past;

static void control_tick(Walker *const *lane, const Coding *c, int64_t tick, const vec *encoder,
                         const vec *current, Past *past, vec *duty, vec *disturbance)
{
  for (int j = 0; j < NJ; j++) {
    const ivec angle = vec_round_int(encoder[j] * SPLAT(c->angle_counts));
    const ivec amperes = vec_round_int(vec_abs(current[j]) * SPLAT(c->current_counts));
    for (int k = 0; k < LANES; k++) {
      const Walker *w = lane[k];
      const int64_t at = (tick < w->ticks ? tick : w->ticks - 1) * NJ + j;
      /* A diverged lane reads nonsense; the clamps keep it inside the tables. */
      const int64_t reading =
          coarsen(clamp(angle[k], -4 * CODE_LIMIT, 4 * CODE_LIMIT), c->angle_step);
      const int64_t error = clamp(w->desired[at] - reading, -CODE_LIMIT, CODE_LIMIT);
      const int64_t change = tick ? error - past->error[j][k] : 0;
      const int64_t load = coarsen(clamp(amperes[k], 0, CODE_LIMIT), c->current_step);
      const int64_t counts = control(w, c, error, change, load, &past->integral[j][k]);
      past->error[j][k] = error;
      duty[j][k] = (double)counts * c->duty_per_count;
      disturbance[j][k] = w->disturbance ? w->disturbance[at] : 0.0;
    }
  }
}

static void write_log(Walker *const *lane, const int *walking, int64_t tick, const vec *q,
                      const vec *v, const vec *internal, const vec *duty)
{
  for (int k = 0; k < LANES; k++) {
    if (!lane[k]->log || !walking[k]) continue;
    double *row = lane[k]->log + tick * NLOG;
    for (int i = 0; i < NQ; i++) *row++ = q[i][k];
    for (int i = 0; i < NV; i++) *row++ = v[i][k];
    for (int i = 0; i < NI; i++) *row++ = internal[i][k];
    for (int i = 0; i < NJ; i++) *row++ = duty[i][k];
  }
}

/* The current sensors' analog filter, of |I|, over one physics step. */
static void low_pass(vec *sensed, const vec *current, vec smoothing)
{
  for (int j = 0; j < NJ; j++)
    sensed[j] += smoothing * (vec_abs(current[j]) - sensed[j]);
}

/* Lanes without a filter: its sum may differ from the current itself by a rounding. */
static void unfiltered(vec *sensed, const vec *current, vec smoothing)
{
  for (int k = 0; k < LANES; k++)
    if (smoothing[k] >= 1.0)
      for (int j = 0; j < NJ; j++) sensed[j][k] = current[j][k];
}

/* Lanes whose state is finite; x - x is zero for a finite x only. */
static ivec all_finite(const vec *q, const vec *v, const vec *internal)
{
  vec residue = SPLAT(0.0);
  for (int i = 0; i < NQ; i++) residue += q[i] - q[i];
  for (int i = 0; i < NV; i++) residue += v[i] - v[i];
  for (int i = 0; i < NI; i++) residue += internal[i] - internal[i];
  return residue == SPLAT(0.0);
}

/* LANES walkers, all different objects but possibly copies of one another. */
static void walk(Walker *const *lane, const Coding *c)
{
  vec q[2][NQ], v[2][NV], internal[2][NI + 1], p[NP], duty[NJ], disturbance[NJ], current[NJ];
  vec sensed[NJ], smoothing;
  vec sums[N_INTEGRANDS], integrands[N_INTEGRANDS], largest, peak = SPLAT(0.0);
  Past past;
  int walking[LANES];
  int64_t last = 0;
  int filtered = 0;

  memset(&past, 0, sizeof past);
  memset(v, 0, sizeof v);
  memset(current, 0, sizeof current);
  memset(sensed, 0, sizeof sensed);
  memset(sums, 0, sizeof sums);
  for (int k = 0; k < LANES; k++) {
    for (int i = 0; i < NQ; i++) q[0][i][k] = lane[k]->q0[i];
    for (int i = 0; i < NI; i++) internal[0][i][k] = lane[k]->internal_state[i];
    for (int i = 0; i < NP; i++) p[i][k] = lane[k]->parameters[i];
    if (lane[k]->ticks > last) last = lane[k]->ticks;
    smoothing[k] = lane[k]->current_smoothing;
    if (smoothing[k] < 1.0) filtered = 1;
    lane[k]->status = OK;
    walking[k] = 1;
  }

  int now = 0;
  for (int64_t tick = 0; tick < last; tick++) {
    if (filtered) unfiltered(sensed, current, smoothing);
    control_tick(lane, c, tick, ENCODER(q[now], internal[now]), filtered ? sensed : current, &past,
                 duty, disturbance);
    write_log(lane, walking, tick, q[now], v[now], internal[now], duty);
    for (int64_t n = 0; n < c->substeps; n++) {
      step(q[now], v[now], internal[now], duty, disturbance, p, q[1 - now], v[1 - now],
           internal[1 - now], current, integrands, &largest);
      now = 1 - now;
      for (int i = 0; i < N_INTEGRANDS; i++) sums[i] += integrands[i];
      peak = vec_max(peak, largest);
      if (filtered) low_pass(sensed, current, smoothing);
    }
    const vec qx = q[now][3], qy = q[now][4];
    const vec upright = SPLAT(1.0) - SPLAT(2.0) * (qx * qx + qy * qy);
    const ivec sound = all_finite(q[now], v[now], internal[now]);
    int any = 0;
    for (int k = 0; k < LANES; k++) {
      Walker *w = lane[k];
      /* A lane that has ended goes on computing, but its walker has its results. */
      if (!walking[k]) continue;
      if (!sound[k]) w->status = DIVERGED;
      else if (q[now][2][k] < w->fall_height || upright[k] < w->fall_cosine) w->status = FELL;
      if (w->status != OK || tick + 1 == w->ticks) {
        walking[k] = 0;
        for (int i = 0; i < N_INTEGRANDS; i++) w->sums[i] = sums[i][k];
        for (int i = 0; i < NQ; i++) w->end[i] = q[now][i][k];
        w->peak_current = peak[k];
      } else {
        any = 1;
      }
    }
    if (!any) break;
  }
}

/* Any number of walkers; idle lanes of the last group repeat its first walker. */
void gaitswarm_walk(Walker *walkers, int64_t n, const Coding *coding)
{
  for (int64_t first = 0; first < n; first += LANES) {
    Walker copies[LANES];
    double sums[LANES][N_INTEGRANDS], end[LANES][NQ];
    Walker *lane[LANES];
    for (int k = 0; k < LANES; k++) {
      if (first + k < n) {
        lane[k] = &walkers[first + k];
      } else {
        copies[k] = walkers[first];
        copies[k].sums = sums[k];
        copies[k].end = end[k];
        copies[k].log = 0;
        lane[k] = &copies[k];
      }
    }
    walk(lane, coding);
  }
}

int64_t gaitswarm_lanes(void) { return LANES; }
int64_t gaitswarm_joints(void) { return NJ; }
int64_t gaitswarm_internal_state_size(void) { return NI; }
int64_t gaitswarm_parameters(void) { return NP; }
int64_t gaitswarm_integrands(void) { return N_INTEGRANDS; }
int64_t gaitswarm_log_width(void) { return NLOG; }
