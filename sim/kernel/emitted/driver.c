/* The walk: per control tick read the sensors, run the controller, step the physics, measure.
   Included after pool.c, the generated function `kick`, and the sizes NJ (joints), NI (internal
   state) and NP (parameters; TIMESTEP is the index of the physics timestep). With BACKLASH the
   internal state begins with the angles and rates of the motors, which the encoders see. Positions
   and sums are doubles, whatever a real is. The Python twin is reference.py. */

/* The lanes and their states. A lane whose walk has ended computes on until another walk enters; its
   walker has its results. A lane's control tick takes one round of physics steps, or several rounds
   of shorter steps if a foot may touch down, while other lanes advance. */
typedef struct {
  Walker *walker[LANES];
  Call *call[LANES];
  int walking[LANES];
  int64_t tick[LANES], rounds_left[LANES], cycle_left[LANES]; /* ticks until a gait cycle ends */
  divec begins[HALVES]; /* lanes at the beginning of a control tick */
  wide q[NQ];
  wide motor[NJ]; /* motors' angles, with backlash */
  vec v[NV], internal[NI + 1], p[NP], duty[NJ], disturbance[NJ], current[NJ], landing;
  wide timestep, weight; /* length of a physics step [s], and relative to a step without touchdown */
  Gains gains;
  Past past;
  int filtered, disturbed, shoved; /* whether any lane has a current filter, disturbances or a shove */
  vec sensed[NJ], smoothing;
#if INNER
  Inner inner;
#endif
#if UNEVEN
  Ground ground;
  vec places[NL][6]; /* of feet and knees at the last step */
#endif
  wide sums[N_INTEGRANDS];
  vec peaks[N_PEAKS], lifted[NL], clearance; /* lifted: in this cycle */
  Sensors sensors; /* the largest and rarely used: last */
} Lanes;

/* Rounds of physics steps that belonged to a walk, and all of them; time of one in TIMED_EACH
   rounds, and of their control ticks [ns]. */
enum { TIMED_EACH = 64 };
typedef struct {
  int64_t walked, computed, timed, control;
} LaneUse;

static int64_t nanoseconds(void)
{
  struct timespec now;
  clock_gettime(CLOCK_MONOTONIC, &now);
  return (int64_t)now.tv_sec * 1000000000 + now.tv_nsec;
}

/* Starts a walker in a lane, and clears the state of the previous one. */
static void enter(Lanes *s, int k, Call *call, Walker *w)
{
  s->call[k] = call;
  s->walker[k] = w;
  s->walking[k] = 1;
  s->tick[k] = 0;
  for (int i = 0; i < NQ; i++) OF_LANE(s->q[i], k) = w->q0[i];
  for (int i = 0; i < NV; i++) s->v[i][k] = 0;
  for (int i = 0; i < NI; i++) s->internal[i][k] = (real)w->internal_state[i];
  for (int i = 0; i < NP; i++) s->p[i][k] = (real)w->parameters[i];
  for (int i = 0; i < N_INTEGRANDS; i++) OF_LANE(s->sums[i], k) = 0.0;
  for (int j = 0; j < NJ; j++) {
    s->current[j][k] = s->sensed[j][k] = s->disturbance[j][k] = 0;
    OF_LANE(s->motor[j], k) = BACKLASH ? w->internal_state[j] : 0.0;
  }
  for (int i = 0; i < N_PEAKS; i++) s->peaks[i][k] = 0;
  for (int l = 0; l < NL; l++) s->lifted[l][k] = 0;
  s->clearance[k] = (real)__builtin_inf();
  s->landing[k] = 0;
  s->rounds_left[k] = 0;
  s->cycle_left[k] = w->cycle;
  set_control(&s->gains, &s->past, k, &w->law);
  set_sensors(&s->sensors, k, &w->sensors);
#if UNEVEN
  set_ground(&s->ground, k, &w->terrain);
#endif
  if (w->smoothing[0] < 1.0) s->filtered = 1;
  if (w->disturbance) s->disturbed = 1;
  if (w->shove[1]) s->shoved = 1;
#if INNER
  OF_LANE(s->inner.stiffness, k) = w->law.stiffness;
  OF_LANE(s->inner.damping, k) = w->law.damping;
#endif
}

static void leave(Lanes *s, int k, int64_t status)
{
  Walker *w = s->walker[k];
  w->status = status;
  for (int i = 0; i < N_INTEGRANDS; i++) w->sums[i] = OF_LANE(s->sums[i], k);
  for (int i = 0; i < NQ; i++) w->end[i] = OF_LANE(s->q[i], k);
  for (int i = 0; i < N_PEAKS; i++) w->peaks[i] = s->peaks[i][k];
  w->clearance = s->clearance[k];
  s->walking[k] = 0;
  /* The last access to another call's memory. */
  __atomic_sub_fetch(&s->call[k]->left, 1, __ATOMIC_RELEASE);
}

static dvec encoder(const Lanes *s, int j, int h) { return BACKLASH ? s->motor[j][h] : s->q[7 + j][h]; }

#if INNER
/* Control in the actuators of lanes whose inner tick begins. */
static void inner_tick(Lanes *s, const Coding *c, const divec *begins, const dvec *ago)
{
  inner_law(&s->inner, c, s->duty, BACKLASH ? s->motor : s->q + 7,
            BACKLASH ? s->internal + NJ : s->v + 6, begins, ago);
}
#endif

/* Starts the next control tick of lanes that have finished one. */
static void begin_ticks(Lanes *s, const Coding *c)
{
  for (int k = 0; k < LANES; k++) {
    const Walker *w = s->walker[k];
    OF_LANE(s->begins, k) = s->rounds_left[k] ? 0 : -1;
    if (s->rounds_left[k]) continue;
    const int landing = s->landing[k] > 0;
    s->rounds_left[k] = landing ? c->refinement : 1;
    OF_LANE(s->weight, k) = 1.0 / (double)s->rounds_left[k];
    OF_LANE(s->timestep, k) = w->parameters[TIMESTEP] / (double)s->rounds_left[k];
    s->p[TIMESTEP][k] = (real)OF_LANE(s->timestep, k);
    s->smoothing[k] = (real)w->smoothing[landing];
#if INNER
    s->inner.period[k] = s->rounds_left[k] * c->substeps / c->inner_ticks;
    s->inner.left[k] = s->inner.period[k] + 1;
#endif
    if (!s->shoved) continue;
    const int pushed = w->shove[0] <= s->tick[k] && s->tick[k] < w->shove[1];
    for (int i = PUSH; i < PUSH + 3; i++) s->p[i][k] = pushed ? (real)w->parameters[i] : 0;
  }
}

/* Readings of all sensors, if some have errors. */
static void read_sensors(Lanes *s, const vec *current)
{
  for (int j = 0; j < NJ; j++) {
    const vec absolute = vec_abs(current[j]);
    for (int h = 0; h < HALVES; h++) {
      s->sensors.seen[ANGLE][j][h] = encoder(s, j, h);
      s->sensors.seen[CURRENT][j][h] = vec_widened(&absolute, h);
    }
  }
  disturb(&s->sensors, s->tick, s->begins);
}

static void control_tick(Lanes *s, const Coding *c)
{
  const vec *current = s->filtered ? s->sensed : s->current;
  const int imperfect = s->sensors.noisy || s->sensors.late;
  divec desired[NJ][HALVES];
  wide counts[NJ];
  Readings readings;
  for (int k = 0; k < LANES; k++) {
    const Walker *w = s->walker[k];
    const int64_t row = (s->tick[k] < w->ticks ? s->tick[k] : w->ticks - 1) * NJ;
    for (int j = 0; j < NJ; j++) OF_LANE(desired[j], k) = w->desired[row + j];
    if (s->disturbed && w->disturbance)
      for (int j = 0; j < NJ; j++) s->disturbance[j][k] = (real)w->disturbance[row + j];
  }
  if (imperfect) read_sensors(s, current);
  for (int j = 0; j < NJ; j++) {
    const vec absolute = vec_abs(current[j]);
    for (int h = 0; h < HALVES; h++)
      read_joint(&readings, &s->past, c, j, h,
                 imperfect ? s->sensors.seen[ANGLE][j][h] : encoder(s, j, h),
                 imperfect ? s->sensors.seen[CURRENT][j][h] : vec_widened(&absolute, h),
                 dvec_of(desired[j][h]));
  }
  control(&s->gains, &s->past, &readings, s->begins, DSPLAT(c->pwm_counts), c->pwm_step, counts);
  for (int j = 0; j < NJ; j++)
    for (int h = 0; h < HALVES; h++) {
      const dvec duty = counts[j][h] * DSPLAT(c->duty_per_count);
#if INNER
      wide *const commanded = &s->inner.commanded[j];
      (*commanded)[h] = dvec_select(s->begins[h], duty, (*commanded)[h]);
#else
      vec_narrow(&s->duty[j], h, dvec_select(s->begins[h], duty, vec_widened(&s->duty[j], h)));
#endif
    }
#if INNER
  const wide now = {DSPLAT(0.0)};
  for (int k = 0; k < LANES; k++)
    if (OF_LANE(s->begins, k)) set_targets(&s->inner, k, s->walker[k], s->tick[k], c);
  inner_tick(s, c, s->begins, now);
#endif
}

static void write_log(const Lanes *s)
{
  const vec *current = s->filtered ? s->sensed : s->current;
  for (int k = 0; k < LANES; k++) {
    if (!s->walker[k]->log || !s->walking[k] || !OF_LANE(s->begins, k)) continue;
    double *row = s->walker[k]->log + s->tick[k] * NLOG;
    for (int i = 0; i < NQ; i++) *row++ = OF_LANE(s->q[i], k);
    for (int i = 0; i < NV; i++) *row++ = s->v[i][k];
    for (int i = 0; i < NI; i++) *row++ = s->internal[i][k];
    for (int i = 0; i < NJ; i++) *row++ = current[i][k] < 0 ? -current[i][k] : current[i][k];
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
  dvec precise = DSPLAT(0.0);
  vec residue = SPLAT(0.0);
  for (int i = 0; i < NQ; i++) precise += s->q[i][h] - s->q[i][h];
  for (int i = 0; i < NV; i++) residue += s->v[i] - s->v[i];
  for (int i = 0; i < NI; i++) residue += s->internal[i] - s->internal[i];
  return precise + vec_widened(&residue, h) == DSPLAT(0.0);
}

/* Positions after some steps at these velocities, see body.py. The increments are too small for
   floats. */
static void drift(Lanes *s, int h, double steps)
{
  const dvec one = DSPLAT(1.0), half = DSPLAT(0.5), t = DSPLAT(steps) * s->timestep[h];
  wide *const q = s->q;
  const dvec x = q[3][h], y = q[4][h], z = q[5][h], w = q[6][h];
  dvec a = half * t * vec_widened(&s->v[3], h), b = half * t * vec_widened(&s->v[4], h),
       c = half * t * vec_widened(&s->v[5], h);
  const dvec lx = t * vec_widened(&s->v[0], h), ly = t * vec_widened(&s->v[1], h),
             lz = t * vec_widened(&s->v[2], h);
  const dvec vx = lx + (b * lz - c * ly), vy = ly + (c * lx - a * lz), vz = lz + (a * ly - b * lx);
  const dvec tx = DSPLAT(2.0) * (y * vz - z * vy), ty = DSPLAT(2.0) * (z * vx - x * vz),
             tz = DSPLAT(2.0) * (x * vy - y * vx);
  q[0][h] += vx + w * tx + (y * tz - z * ty);
  q[1][h] += vy + w * ty + (z * tx - x * tz);
  q[2][h] += vz + w * tz + (x * ty - y * tx);
  const dvec square = a * a + b * b + c * c;
  const dvec e = one - square * (half - square * DSPLAT(1.0 / 24.0));
  const dvec shorter = one - square * DSPLAT(1.0 / 6.0);
  a *= shorter, b *= shorter, c *= shorter;
  const dvec turned[4] = {w * a + x * e + y * c - z * b, w * b - x * c + y * e + z * a,
                          w * c + x * b - y * a + z * e, w * e - x * a - y * b - z * c};
  const dvec length = turned[0] * turned[0] + turned[1] * turned[1] + turned[2] * turned[2] +
                      turned[3] * turned[3];
  const dvec correction = DSPLAT(1.5) - half * length;
  for (int i = 0; i < 4; i++) q[3 + i][h] = turned[i] * correction;
  for (int j = 0; j < NJ; j++) q[7 + j][h] += t * vec_widened(&s->v[6 + j], h);
#if BACKLASH
  for (int j = 0; j < NJ; j++) {
    s->motor[j][h] += t * vec_widened(&s->internal[NJ + j], h);
    vec_narrow(&s->internal[j], h, s->motor[j][h]);
  }
#endif
}

static void round_of_steps(Lanes *s, const Coding *c)
{
  vec integrands[N_INTEGRANDS];
#if UNEVEN
  vec patches[3 * NL];
#else
  const vec *const patches = NULL;
#endif
#ifdef SINGLE
  vec q[NQ];
#else
  const vec *const q = *s->q;
#endif
  for (int h = 0; h < HALVES; h++) drift(s, h, 0.5);
  for (int64_t left = c->substeps; left-- > 0;) {
#if INNER
    divec begins[HALVES];
    if (due(&s->inner, begins)) {
      /* Positions are those of the step's middle. */
      wide ago;
      for (int h = 0; h < HALVES; h++) ago[h] = DSPLAT(0.5) * s->timestep[h];
      inner_tick(s, c, begins, ago);
    }
#endif
#ifdef SINGLE
    for (int i = 0; i < NQ; i++)
      for (int h = 0; h < HALVES; h++) vec_narrow(&q[i], h, s->q[i][h]);
#endif
#if UNEVEN
    place_feet(q, c->robot, s->places);
    patch_feet(&s->ground, s->places, patches);
#endif
    kick(q, s->v, s->internal, s->duty, s->disturbance, s->p, c->robot, patches, s->shoved,
         s->current, integrands, s->peaks, s->lifted, &s->landing);
    for (int h = 0; h < HALVES; h++) drift(s, h, left ? 1.0 : 0.5);
    for (int i = 0; i < N_INTEGRANDS; i++)
      for (int h = 0; h < HALVES; h++)
        s->sums[i][h] += s->weight[h] * vec_widened(&integrands[i], h);
    if (s->filtered) low_pass(s->sensed, s->current, s->smoothing);
  }
}

/* Heights of a lane's soles in a cycle that has ended. */
static void end_cycle(Lanes *s, int k)
{
  for (int l = 0; l < NL; l++) {
    if (s->lifted[l][k] < s->clearance[k]) s->clearance[k] = s->lifted[l][k];
    s->lifted[l][k] = 0;
  }
  s->cycle_left[k] = s->walker[k]->cycle;
}

/* Finished walks leave their lanes; returns the number of walks in lanes. */
static int end_round(Lanes *s)
{
  int walked = 0;
  for (int h = 0; h < HALVES; h++) {
    const dvec qx = s->q[3][h], qy = s->q[4][h];
#if UNEVEN
    dvec patch[3];
    under(&s->ground, h, s->q[0][h], s->q[1][h], patch);
    const dvec height = s->q[2][h] - patch[0];
    const divec below = struck(&s->ground, h, s->q, s->places);
#else
    const dvec height = s->q[2][h];
    const divec below = {0};
#endif
    const dvec upright = DSPLAT(1.0) - DSPLAT(2.0) * (qx * qx + qy * qy);
    const divec sound = all_finite(s, h);
    for (int n = 0; n < DOUBLES; n++) {
      const int k = h * DOUBLES + n;
      const Walker *w = s->walker[k];
      walked += s->walking[k];
      if (--s->rounds_left[k] || !s->walking[k]) continue;
      s->tick[k]++;
      if (!--s->cycle_left[k]) end_cycle(s, k);
      if (!sound[n]) leave(s, k, DIVERGED);
      else if (height[n] < w->fall_height || upright[n] < w->fall_cosine) leave(s, k, FELL);
      else if (below[n]) leave(s, k, STRUCK);
      else if (s->tick[k] == w->ticks) leave(s, k, OK);
    }
  }
  return walked;
}

/* A lane whose walk has ended takes the next one; or, if there is none, one of the thread's own call
   whose results are discarded: the memory of another call may already be freed. */
static void fill(Lanes *s, int k, Pool *pool, Call *thread_call, int64_t bound)
{
  Walker *w = thread_call->walkers;
  Call *call = begin_walk(pool, thread_call, bound, &w);
  if (!call && s->call[k] == thread_call) return;
  enter(s, k, call ? call : thread_call, w);
  s->walking[k] = call != NULL;
}

/* Computes all walks of a call in order; when a walk ends, the next one enters its lane. When all
   have begun, lanes take walks of the pool's other calls that came before this call ended. Returns
   how many of the call's walks are still in other threads' lanes. */
int64_t gaitswarm_walk(Pool *pool, Call *thread_call, const Coding *coding, LaneUse *use)
{
  Lanes s;
  int64_t bound = INT64_MAX;
  int walking = 1;
  memset(use, 0, sizeof *use);
  if (!thread_call->n) return 0;
  memset(&s, 0, sizeof s);
  offer(pool, thread_call);
  for (int k = 0; k < LANES; k++) fill(&s, k, pool, thread_call, bound);
  for (int64_t n = 0; walking; n++) {
    const int timed = n % TIMED_EACH == 0;
    const int64_t begun = timed ? nanoseconds() : 0;
    begin_ticks(&s, coding);
    if (s.filtered) unfiltered(s.sensed, s.current, s.smoothing);
    control_tick(&s, coding);
    write_log(&s);
    if (timed) use->control += nanoseconds() - begun;
    round_of_steps(&s, coding);
    use->walked += end_round(&s);
    use->computed += LANES;
    if (timed) use->timed += nanoseconds() - begun;
    if (bound == INT64_MAX && !gaitswarm_left(thread_call))
      bound = __atomic_load_n(&pool->calls, __ATOMIC_RELAXED);
    walking = 0;
    for (int k = 0; k < LANES; k++) {
      if (!s.walking[k]) fill(&s, k, pool, thread_call, bound);
      walking |= s.walking[k];
    }
  }
  return gaitswarm_left(thread_call);
}

int64_t gaitswarm_lanes(void) { return LANES; }
int64_t gaitswarm_single(void) { return sizeof(real) == sizeof(float); }
int64_t gaitswarm_joints(void) { return NJ; }
int64_t gaitswarm_internal_state_size(void) { return NI; }
int64_t gaitswarm_parameters(void) { return NP; }
int64_t gaitswarm_constants(void) { return NR; }
int64_t gaitswarm_integrands(void) { return N_INTEGRANDS; }
int64_t gaitswarm_log_width(void) { return NLOG; }
int64_t gaitswarm_size_of_coding(void) { return sizeof(Coding); }
int64_t gaitswarm_size_of_table(void) { return sizeof(Table); }
int64_t gaitswarm_size_of_walker(void) { return sizeof(Walker); }
int64_t gaitswarm_size_of_lane_use(void) { return sizeof(LaneUse); }
int64_t gaitswarm_size_of_call(void) { return sizeof(Call); }
int64_t gaitswarm_size_of_pool(void) { return sizeof(Pool); }
