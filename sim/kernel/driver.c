/* The walk: per control tick read the sensors, run the controller, step the physics, measure.
   Included after vec.h, the emitted function `step`, and the sizes NJ (joints), NP (parameters).
   The Python twin is reference.py. */

#define NQ (7 + NJ)
#define NV (6 + NJ)
#define NTERMS 5
#define NLOG (NQ + NV + NJ)

enum { OK = 0, DIVERGED = 1, FELL = 2 };

enum { TABLE_ROWS = 1024, TABLE_COLUMNS = 64, FRACTION_BITS = 16, INTEGRAL_BITS = 20 };
#define CODE_LIMIT 65535

/* Sensors and PWM in coded integers, and the rates; one for a whole batch. */
typedef struct {
  double angle_counts, current_counts, duty_per_count;
  int64_t angle_step, current_step, pwm_step, pwm_counts, substeps;
} Coding;

/* One walker: all it needs and all it leaves behind. Field by field as in native.py. */
typedef struct {
  const double *q0;         /* NQ, initial position; it starts at rest */
  const double *parameters; /* NP */
  const int32_t *desired;   /* ticks x NJ, coded angles */
  const int8_t *table;      /* TABLE_ROWS x TABLE_COLUMNS, or NULL */
  int64_t proportional_gain, integral_gain, error_gain, current_gain, output_gain;
  int64_t ticks;
  double fall_height;  /* of the body over the ground [m] */
  double fall_cosine;  /* of the tilt */
  double *sums;        /* NTERMS, summed over physics steps */
  double *end;         /* NQ, final position */
  double *log;         /* ticks x NLOG: q, v, duty; or NULL */
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

/* Controller of one joint: coded error and current to PWM counts (thesis 5.3). */
static int64_t control(const Walker *w, const Coding *c, int64_t error, int64_t current,
                       int64_t *integral)
{
  const int64_t full = c->pwm_counts << INTEGRAL_BITS;
  int64_t output;
  if (w->table) {
    const int64_t row = descale(error * w->error_gain, FRACTION_BITS) + TABLE_ROWS / 2;
    const int64_t column = descale(current * w->current_gain, FRACTION_BITS);
    const int8_t entry = w->table[clamp(row, 0, TABLE_ROWS - 1) * TABLE_COLUMNS +
                                  clamp(column, 0, TABLE_COLUMNS - 1)];
    output = descale(entry * w->output_gain, FRACTION_BITS);
  } else {
    output = descale(error * w->proportional_gain, FRACTION_BITS);
  }
  *integral = clamp(*integral + error * w->integral_gain, -full, full);
  output = clamp(output + descale(*integral, INTEGRAL_BITS), -c->pwm_counts, c->pwm_counts);
  return clamp(coarsen(output, c->pwm_step), -c->pwm_counts, c->pwm_counts);
}

static void control_tick(Walker *const *lane, const Coding *c, int64_t tick, const vec *q,
                         const vec *current, int64_t (*integral)[LANES], vec *duty)
{
  for (int j = 0; j < NJ; j++) {
    const ivec angle = vec_round_int(q[7 + j] * SPLAT(c->angle_counts));
    const ivec amperes = vec_round_int(vec_abs(current[j]) * SPLAT(c->current_counts));
    for (int k = 0; k < LANES; k++) {
      const Walker *w = lane[k];
      const int64_t at = tick < w->ticks ? tick : w->ticks - 1;
      /* A diverged lane reads nonsense; the clamps keep it inside the table. */
      const int64_t reading = coarsen(clamp(angle[k], -4 * CODE_LIMIT, 4 * CODE_LIMIT), c->angle_step);
      const int64_t error =
          clamp(w->desired[at * NJ + j] - reading, -CODE_LIMIT, CODE_LIMIT);
      const int64_t load = coarsen(clamp(amperes[k], 0, CODE_LIMIT), c->current_step);
      duty[j][k] = (double)control(w, c, error, load, &integral[j][k]) * c->duty_per_count;
    }
  }
}

static void write_log(Walker *const *lane, int64_t tick, const vec *q, const vec *v,
                      const vec *duty)
{
  for (int k = 0; k < LANES; k++) {
    if (!lane[k]->log || tick >= lane[k]->ticks) continue;
    double *row = lane[k]->log + tick * NLOG;
    for (int i = 0; i < NQ; i++) *row++ = q[i][k];
    for (int i = 0; i < NV; i++) *row++ = v[i][k];
    for (int i = 0; i < NJ; i++) *row++ = duty[i][k];
  }
}

/* Lanes whose state is finite; x - x is zero for a finite x only. */
static ivec all_finite(const vec *q, const vec *v)
{
  vec residue = SPLAT(0.0);
  for (int i = 0; i < NQ; i++) residue += q[i] - q[i];
  for (int i = 0; i < NV; i++) residue += v[i] - v[i];
  return residue == SPLAT(0.0);
}

/* LANES walkers, all different objects but possibly copies of one another. */
static void walk(Walker *const *lane, const Coding *c)
{
  vec q[2][NQ], v[2][NV], p[NP], duty[NJ], current[NJ], sums[NTERMS], terms[NTERMS];
  int64_t integral[NJ][LANES];
  ivec walking = ISPLAT(-1);
  int64_t last = 0;

  memset(integral, 0, sizeof integral);
  memset(v, 0, sizeof v);
  memset(current, 0, sizeof current);
  memset(sums, 0, sizeof sums);
  for (int k = 0; k < LANES; k++) {
    for (int i = 0; i < NQ; i++) q[0][i][k] = lane[k]->q0[i];
    for (int i = 0; i < NP; i++) p[i][k] = lane[k]->parameters[i];
    if (lane[k]->ticks > last) last = lane[k]->ticks;
    lane[k]->status = OK;
  }

  int now = 0;
  for (int64_t tick = 0; tick < last; tick++) {
    control_tick(lane, c, tick, q[now], current, integral, duty);
    write_log(lane, tick, q[now], v[now], duty);
    for (int64_t n = 0; n < c->substeps; n++) {
      step(q[now], v[now], duty, p, q[1 - now], v[1 - now], current, terms);
      now = 1 - now;
      for (int i = 0; i < NTERMS; i++) sums[i] += (vec)((ivec)terms[i] & walking);
    }
    const vec x = q[now][3], y = q[now][4];
    const vec upright = SPLAT(1.0) - SPLAT(2.0) * (x * x + y * y);
    const ivec sound = all_finite(q[now], v[now]);
    int any = 0;
    for (int k = 0; k < LANES; k++) {
      Walker *w = lane[k];
      if (!walking[k]) continue;
      if (!sound[k]) w->status = DIVERGED;
      else if (q[now][2][k] < w->fall_height || upright[k] < w->fall_cosine) w->status = FELL;
      if (w->status != OK || tick + 1 == w->ticks) {
        walking[k] = 0;
        for (int i = 0; i < NTERMS; i++) w->sums[i] = sums[i][k];
        for (int i = 0; i < NQ; i++) w->end[i] = q[now][i][k];
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
    double sums[LANES][NTERMS], end[LANES][NQ];
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

/* The bare functions, for tests: lane 0 of arrays with one column. */
static void load(vec *to, const double *from, int n)
{
  for (int i = 0; i < n; i++) to[i] = SPLAT(from[i]);
}

void gaitswarm_step(const double *q, const double *v, const double *duty, const double *p,
                    double *q1, double *v1, double *current, double *terms)
{
  vec a[NQ], b[NV], d[NJ], e[NP], qn[NQ], vn[NV], i[NJ], t[NTERMS];
  load(a, q, NQ), load(b, v, NV), load(d, duty, NJ), load(e, p, NP);
  step(a, b, d, e, qn, vn, i, t);
  for (int k = 0; k < NQ; k++) q1[k] = qn[k][0];
  for (int k = 0; k < NV; k++) v1[k] = vn[k][0];
  for (int k = 0; k < NJ; k++) current[k] = i[k][0];
  for (int k = 0; k < NTERMS; k++) terms[k] = t[k][0];
}

int64_t gaitswarm_lanes(void) { return LANES; }
int64_t gaitswarm_log_width(void) { return NLOG; }
