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

/* The lanes: whom each of them walks and how far, and their states. A lane whose walk has ended,
   and to which no other came, computes on; its walker has its results. */
typedef struct {
  Walker *walker[LANES];
  int walking[LANES];
  int64_t tick[LANES];
  vec q[2][NQ], v[2][NV], internal[2][NI + 1], p[NP], duty[NJ], disturbance[NJ], current[NJ];
  vec sensed[NJ], smoothing;
  vec sums[N_INTEGRANDS], peak;
  int64_t integral[NJ][LANES], error[NJ][LANES]; /* what the controllers remember */
  int now;      /* of the two states */
  int filtered; /* whether any lane's current has been */
} Lanes;

/* Lane-ticks that were walked for a walker, and all that were computed. */
typedef struct {
  int64_t walked, computed;
} LaneUse;

/* A walker at its start, and nothing left of who was in the lane before. */
static void enter(Lanes *s, int k, Walker *w)
{
  s->walker[k] = w;
  s->walking[k] = 1;
  s->tick[k] = 0;
  for (int i = 0; i < NQ; i++) s->q[s->now][i][k] = w->q0[i];
  for (int i = 0; i < NV; i++) s->v[s->now][i][k] = 0.0;
  for (int i = 0; i < NI; i++) s->internal[s->now][i][k] = w->internal_state[i];
  for (int i = 0; i < NP; i++) s->p[i][k] = w->parameters[i];
  for (int i = 0; i < N_INTEGRANDS; i++) s->sums[i][k] = 0.0;
  for (int j = 0; j < NJ; j++) {
    s->current[j][k] = s->sensed[j][k] = 0.0;
    s->integral[j][k] = s->error[j][k] = 0;
  }
  s->peak[k] = 0.0;
  s->smoothing[k] = w->current_smoothing;
  if (w->current_smoothing < 1.0) s->filtered = 1;
}

static void leave(Lanes *s, int k, int64_t status)
{
  Walker *w = s->walker[k];
  w->status = status;
  for (int i = 0; i < N_INTEGRANDS; i++) w->sums[i] = s->sums[i][k];
  for (int i = 0; i < NQ; i++) w->end[i] = s->q[s->now][i][k];
  w->peak_current = s->peak[k];
  s->walking[k] = 0;
}

static void control_tick(Lanes *s, const Coding *c)
{
  const vec *encoder = ENCODER(s->q[s->now], s->internal[s->now]);
  const vec *current = s->filtered ? s->sensed : s->current;
  for (int j = 0; j < NJ; j++) {
    const ivec angle = vec_round_int(encoder[j] * SPLAT(c->angle_counts));
    const ivec amperes = vec_round_int(vec_abs(current[j]) * SPLAT(c->current_counts));
    for (int k = 0; k < LANES; k++) {
      const Walker *w = s->walker[k];
      const int64_t at = (s->tick[k] < w->ticks ? s->tick[k] : w->ticks - 1) * NJ + j;
      /* A diverged lane reads nonsense; the clamps keep it inside the tables. */
      const int64_t reading =
          coarsen(clamp(angle[k], -4 * CODE_LIMIT, 4 * CODE_LIMIT), c->angle_step);
      const int64_t error = clamp(w->desired[at] - reading, -CODE_LIMIT, CODE_LIMIT);
      const int64_t change = s->tick[k] ? error - s->error[j][k] : 0;
      const int64_t load = coarsen(clamp(amperes[k], 0, CODE_LIMIT), c->current_step);
      const int64_t counts = control(w, c, error, change, load, &s->integral[j][k]);
      s->error[j][k] = error;
      s->duty[j][k] = (double)counts * c->duty_per_count;
      s->disturbance[j][k] = w->disturbance ? w->disturbance[at] : 0.0;
    }
  }
}

static void write_log(const Lanes *s)
{
  for (int k = 0; k < LANES; k++) {
    if (!s->walker[k]->log || !s->walking[k]) continue;
    double *row = s->walker[k]->log + s->tick[k] * NLOG;
    for (int i = 0; i < NQ; i++) *row++ = s->q[s->now][i][k];
    for (int i = 0; i < NV; i++) *row++ = s->v[s->now][i][k];
    for (int i = 0; i < NI; i++) *row++ = s->internal[s->now][i][k];
    for (int i = 0; i < NJ; i++) *row++ = s->duty[i][k];
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

static void physics_steps(Lanes *s, int64_t substeps)
{
  vec integrands[N_INTEGRANDS], largest;
  for (int64_t n = 0; n < substeps; n++) {
    const int now = s->now, next = 1 - s->now;
    step(s->q[now], s->v[now], s->internal[now], s->duty, s->disturbance, s->p, s->q[next],
         s->v[next], s->internal[next], s->current, integrands, &largest);
    s->now = next;
    for (int i = 0; i < N_INTEGRANDS; i++) s->sums[i] += integrands[i];
    s->peak = vec_max(s->peak, largest);
    if (s->filtered) low_pass(s->sensed, s->current, s->smoothing);
  }
}

/* Walks that have come to an end by now leave their lanes; returns how many were walked. */
static int end_tick(Lanes *s)
{
  const vec *q = s->q[s->now];
  const vec upright = SPLAT(1.0) - SPLAT(2.0) * (q[3] * q[3] + q[4] * q[4]);
  const ivec sound = all_finite(q, s->v[s->now], s->internal[s->now]);
  int walked = 0;
  for (int k = 0; k < LANES; k++) {
    const Walker *w = s->walker[k];
    if (!s->walking[k]) continue;
    walked++;
    s->tick[k]++;
    if (!sound[k]) leave(s, k, DIVERGED);
    else if (q[2][k] < w->fall_height || upright[k] < w->fall_cosine) leave(s, k, FELL);
    else if (s->tick[k] == w->ticks) leave(s, k, OK);
  }
  return walked;
}

/* Any number of walkers, in order; when a walk ends, the next walker enters its lane. */
void gaitswarm_walk(Walker *walkers, int64_t n, const Coding *coding, LaneUse *use)
{
  Lanes s;
  int64_t next = n < LANES ? n : LANES;
  int walking = n > 0;
  memset(use, 0, sizeof *use);
  if (!walking) return;
  memset(&s, 0, sizeof s);
  for (int k = 0; k < LANES; k++) {
    enter(&s, k, &walkers[k < n ? k : 0]);
    s.walking[k] = k < n;
  }
  while (walking) {
    if (s.filtered) unfiltered(s.sensed, s.current, s.smoothing);
    control_tick(&s, coding);
    write_log(&s);
    physics_steps(&s, coding->substeps);
    use->walked += end_tick(&s);
    use->computed += LANES;
    walking = 0;
    for (int k = 0; k < LANES; k++) {
      if (!s.walking[k] && next < n) enter(&s, k, &walkers[next++]);
      walking |= s.walking[k];
    }
  }
}

int64_t gaitswarm_lanes(void) { return LANES; }
int64_t gaitswarm_joints(void) { return NJ; }
int64_t gaitswarm_internal_state_size(void) { return NI; }
int64_t gaitswarm_parameters(void) { return NP; }
int64_t gaitswarm_integrands(void) { return N_INTEGRANDS; }
int64_t gaitswarm_log_width(void) { return NLOG; }
