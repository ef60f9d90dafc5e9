/* The walk: per control tick read the sensors, run the controller, step the physics, measure.
   Included after control.c, the emitted function `step`, and the sizes NJ (joints), NI (numbers of
   the internal state), NP (parameters, of which TIMESTEP is the physics'). With BACKLASH the
   internal state begins with the motors' angles, which the encoders see, and their rates.
   Positions and sums are doubles, whatever a real is. The Python twin is reference.py. */

#define NQ (7 + NJ)
#define NV (6 + NJ)
#define N_INTEGRANDS 8
#define NLOG (NQ + NV + NI + NJ)

enum { OK = 0, DIVERGED = 1, FELL = 2 };

/* One walker: all it needs and all it leaves behind. Field by field as in native.py. */
typedef struct {
  const double *q0;             /* NQ, initial position; it starts at rest */
  const double *internal_state; /* NI, initial */
  const double *parameters;     /* NP */
  const int32_t *desired;       /* ticks x NJ, coded angles */
  const double *disturbance;    /* ticks x NJ, torque on the links [N m]; or NULL */
  Law law;
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

/* The lanes: whom each of them walks and how far, and their states. A lane whose walk has ended,
   and to which no other came, computes on; its walker has its results. */
typedef struct {
  Walker *walker[LANES];
  int walking[LANES];
  int64_t tick[LANES];
  int now; /* of the two states */
  dvec q[2][HALVES][NQ];
  vec v[2][NV], internal[2][NI + 1], p[NP], duty[NJ], disturbance[NJ], current[NJ];
  dvec timestep[HALVES], motor[HALVES][NJ]; /* motors' angles, where reals do not keep their small increments */
  Control control;
  int filtered; /* whether any lane's current has been */
  vec sensed[NJ], smoothing;
  wide sums[N_INTEGRANDS];
  vec peak;
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
  for (int i = 0; i < NQ; i++) s->q[s->now][k / DOUBLES][i][k % DOUBLES] = w->q0[i];
  for (int i = 0; i < NV; i++) s->v[s->now][i][k] = 0;
  for (int i = 0; i < NI; i++) s->internal[s->now][i][k] = (real)w->internal_state[i];
  for (int i = 0; i < NP; i++) s->p[i][k] = (real)w->parameters[i];
  for (int i = 0; i < N_INTEGRANDS; i++) OF_LANE(s->sums[i], k) = 0.0;
  for (int j = 0; j < NJ; j++) {
    s->current[j][k] = s->sensed[j][k] = s->disturbance[j][k] = 0;
    s->motor[k / DOUBLES][j][k % DOUBLES] = BACKLASH ? w->internal_state[j] : 0.0;
  }
  s->peak[k] = 0;
  s->smoothing[k] = (real)w->current_smoothing;
  OF_LANE(s->timestep, k) = w->parameters[TIMESTEP];
  set_control(&s->control, k, &w->law);
  if (w->current_smoothing < 1.0) s->filtered = 1;
}

static void leave(Lanes *s, int k, int64_t status)
{
  Walker *w = s->walker[k];
  w->status = status;
  for (int i = 0; i < N_INTEGRANDS; i++) w->sums[i] = OF_LANE(s->sums[i], k);
  for (int i = 0; i < NQ; i++) w->end[i] = s->q[s->now][k / DOUBLES][i][k % DOUBLES];
  w->peak_current = s->peak[k];
  s->walking[k] = 0;
}

static dvec encoder(const Lanes *s, int j, int h)
{
#if !BACKLASH
  return s->q[s->now][h][7 + j];
#elif defined(SINGLE)
  return s->motor[h][j];
#else
  return vec_widened(&s->internal[s->now][j], h);
#endif
}

static void control_tick(Lanes *s, const Coding *c)
{
  const vec *current = s->filtered ? s->sensed : s->current;
  wide desired[NJ], counts[NJ];
  Readings readings;
  for (int k = 0; k < LANES; k++) {
    const Walker *w = s->walker[k];
    const int64_t row = (s->tick[k] < w->ticks ? s->tick[k] : w->ticks - 1) * NJ;
    for (int j = 0; j < NJ; j++) OF_LANE(desired[j], k) = w->desired[row + j];
    if (w->disturbance)
      for (int j = 0; j < NJ; j++) s->disturbance[j][k] = (real)w->disturbance[row + j];
  }
  for (int j = 0; j < NJ; j++) {
    const vec absolute = vec_abs(current[j]);
    for (int h = 0; h < HALVES; h++)
      read_joint(&readings, &s->control, c, j, h, encoder(s, j, h), vec_widened(&absolute, h),
                 desired[j][h]);
  }
  control(&s->control, c, &readings, counts);
  for (int j = 0; j < NJ; j++)
    for (int h = 0; h < HALVES; h++)
      vec_narrow(&s->duty[j], h, counts[j][h] * DSPLAT(c->duty_per_count));
}

static void write_log(const Lanes *s)
{
  for (int k = 0; k < LANES; k++) {
    if (!s->walker[k]->log || !s->walking[k]) continue;
    double *row = s->walker[k]->log + s->tick[k] * NLOG;
    for (int i = 0; i < NQ; i++) *row++ = s->q[s->now][k / DOUBLES][i][k % DOUBLES];
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
    if (smoothing[k] >= 1)
      for (int j = 0; j < NJ; j++) sensed[j][k] = current[j][k];
}

/* Lanes whose state is finite; x - x is zero for a finite x only. */
static divec all_finite(const Lanes *s, int h)
{
  const dvec *q = s->q[s->now][h];
  const vec *v = s->v[s->now], *internal = s->internal[s->now];
  dvec precise = DSPLAT(0.0);
  vec residue = SPLAT(0.0);
  for (int i = 0; i < NQ; i++) precise += q[i] - q[i];
  for (int i = 0; i < NV; i++) residue += v[i] - v[i];
  for (int i = 0; i < NI; i++) residue += internal[i] - internal[i];
  return precise + vec_widened(&residue, h) == DSPLAT(0.0);
}

#ifdef SINGLE
/* Positions with the velocities after the step, as integration.py has it. Their increments are too
   small for floats, so they are kept, and grow, in doubles. */
static void drift(Lanes *s, int h)
{
  const dvec *q = s->q[s->now][h];
  dvec *after = s->q[1 - s->now][h];
  const vec *v = s->v[1 - s->now];
  const dvec dt = s->timestep[h], half = DSPLAT(0.5) * dt, one = DSPLAT(1.0);
  const dvec x = q[3], y = q[4], z = q[5], w = q[6];
  const dvec vx = vec_widened(&v[0], h), vy = vec_widened(&v[1], h), vz = vec_widened(&v[2], h);
  const dvec tx = DSPLAT(2.0) * (y * vz - z * vy), ty = DSPLAT(2.0) * (z * vx - x * vz),
             tz = DSPLAT(2.0) * (x * vy - y * vx);
  after[0] = q[0] + dt * (vx + w * tx + (y * tz - z * ty));
  after[1] = q[1] + dt * (vy + w * ty + (z * tx - x * tz));
  after[2] = q[2] + dt * (vz + w * tz + (x * ty - y * tx));
  dvec a = half * vec_widened(&v[3], h), b = half * vec_widened(&v[4], h),
       c = half * vec_widened(&v[5], h);
  const dvec square = a * a + b * b + c * c;
  const dvec e = one - square * (DSPLAT(0.5) - square * DSPLAT(1.0 / 24.0));
  const dvec shorter = one - square * DSPLAT(1.0 / 6.0);
  a *= shorter, b *= shorter, c *= shorter;
  const dvec turned[4] = {w * a + x * e + y * c - z * b, w * b - x * c + y * e + z * a,
                          w * c + x * b - y * a + z * e, w * e - x * a - y * b - z * c};
  const dvec length = turned[0] * turned[0] + turned[1] * turned[1] + turned[2] * turned[2] +
                      turned[3] * turned[3];
  const dvec correction = DSPLAT(1.5) - DSPLAT(0.5) * length;
  for (int i = 0; i < 4; i++) after[3 + i] = turned[i] * correction;
  for (int j = 0; j < NJ; j++) after[7 + j] = q[7 + j] + dt * vec_widened(&v[6 + j], h);
#if BACKLASH
  vec *internal = s->internal[1 - s->now];
  for (int j = 0; j < NJ; j++) {
    s->motor[h][j] += dt * vec_widened(&internal[NJ + j], h);
    vec_narrow(&internal[j], h, s->motor[h][j]);
  }
#endif
}
#endif

/* One physics step: the emitted one. */
static void advance(Lanes *s, vec *integrands, vec *largest)
{
  const int now = s->now, next = 1 - s->now;
#ifdef SINGLE
  vec q[NQ], unused[NQ];
  for (int i = 0; i < NQ; i++)
    for (int h = 0; h < HALVES; h++) vec_narrow(&q[i], h, s->q[now][h][i]);
  step(q, s->v[now], s->internal[now], s->duty, s->disturbance, s->p, unused, s->v[next],
       s->internal[next], s->current, integrands, largest);
  for (int h = 0; h < HALVES; h++) drift(s, h);
#else
  step(s->q[now][0], s->v[now], s->internal[now], s->duty, s->disturbance, s->p, s->q[next][0],
       s->v[next], s->internal[next], s->current, integrands, largest);
#endif
  s->now = next;
}

static void physics_steps(Lanes *s, int64_t substeps)
{
  vec integrands[N_INTEGRANDS], largest;
  for (int64_t n = 0; n < substeps; n++) {
    advance(s, integrands, &largest);
    for (int i = 0; i < N_INTEGRANDS; i++)
      for (int h = 0; h < HALVES; h++) s->sums[i][h] += vec_widened(&integrands[i], h);
    s->peak = vec_max(s->peak, largest);
    if (s->filtered) low_pass(s->sensed, s->current, s->smoothing);
  }
}

/* Walks that have come to an end by now leave their lanes; returns how many were walked. */
static int end_tick(Lanes *s)
{
  int walked = 0;
  for (int h = 0; h < HALVES; h++) {
    const dvec *q = s->q[s->now][h];
    const dvec qx = q[3], qy = q[4], height = q[2];
    const dvec upright = DSPLAT(1.0) - DSPLAT(2.0) * (qx * qx + qy * qy);
    const divec sound = all_finite(s, h);
    for (int n = 0; n < DOUBLES; n++) {
      const int k = h * DOUBLES + n;
      const Walker *w = s->walker[k];
      if (!s->walking[k]) continue;
      walked++;
      s->tick[k]++;
      if (!sound[n]) leave(s, k, DIVERGED);
      else if (height[n] < w->fall_height || upright[n] < w->fall_cosine) leave(s, k, FELL);
      else if (s->tick[k] == w->ticks) leave(s, k, OK);
    }
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
int64_t gaitswarm_single(void) { return sizeof(real) == sizeof(float); }
int64_t gaitswarm_joints(void) { return NJ; }
int64_t gaitswarm_internal_state_size(void) { return NI; }
int64_t gaitswarm_parameters(void) { return NP; }
int64_t gaitswarm_integrands(void) { return N_INTEGRANDS; }
int64_t gaitswarm_log_width(void) { return NLOG; }
int64_t gaitswarm_size_of_coding(void) { return sizeof(Coding); }
int64_t gaitswarm_size_of_table(void) { return sizeof(Table); }
int64_t gaitswarm_size_of_walker(void) { return sizeof(Walker); }
int64_t gaitswarm_size_of_lane_use(void) { return sizeof(LaneUse); }
