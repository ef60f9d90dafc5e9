/* A Mamdani inference as a table of bytes; the twin of mamdani.py and quantisation.py, after vec.h
   and estimate.c.

   A cell's output is the centroid of the union of clipped sets: sums over some hundred points, in
   order, so that both twins give the same bits. Most cells avoid those sums: they are estimated
   first, and summed only if the estimate's error bound leaves the byte open, or for the table's
   largest output, to which bytes are relative. */

/* Largest value of a byte. */
#define FULL 127.0

typedef int8_t bytes __attribute__((vector_size(LANES)));

static int any(ivec mask)
{
  int result = 0;
  for (int k = 0; k < LANES; k++) result |= mask[k] != 0;
  return result;
}

/* Crisp outputs of a block of cells by the full sums. Sets that fire nowhere in the block, which is
   most, are skipped. */
static void sum_block(const System *s, int64_t row, int64_t column, vec *crisp)
{
  vec level[MAX_SETS][BLOCK], moment[BLOCK], area[BLOCK];
  memset(level, 0, sizeof level);
  for (int64_t r = 0; r < s->n_rules; r++) {
    const vec held = SPLAT(s->outer[r * s->n_outer + row]);
    UNROLLED
    for (int b = 0; b < BLOCK; b++) {
      vec degree;
      memcpy(&degree, s->inner + r * s->n_inner + column + b * LANES, sizeof degree);
      vec *strength = &level[s->consequent[r]][b];
      *strength = vec_max(*strength, vec_min(held, degree) * SPLAT(s->weight[r]));
    }
  }
  int64_t set[MAX_SETS], active = 0;
  for (int64_t n = 0; n < s->n_sets; n++) {
    ivec fires = ISPLAT(0);
    UNROLLED
    for (int b = 0; b < BLOCK; b++) fires |= level[n][b] > SPLAT(0.0);
    if (!any(fires)) continue;
    memmove(level[active], level[n], sizeof level[n]);
    set[active++] = n;
  }
  memset(moment, 0, sizeof moment);
  memset(area, 0, sizeof area);
  for (int64_t k = 0; k < s->n_points; k++) {
    vec joint[BLOCK];
    memset(joint, 0, sizeof joint);
    for (int64_t a = 0; a < active; a++) {
      const vec membership = SPLAT(s->memberships[set[a] * s->n_points + k]);
      UNROLLED
      for (int b = 0; b < BLOCK; b++)
        joint[b] = vec_max(joint[b], vec_min(level[a][b], membership));
    }
    UNROLLED
    for (int b = 0; b < BLOCK; b++) {
      moment[b] += SPLAT(s->points[k]) * joint[b];
      area[b] += joint[b];
    }
  }
  UNROLLED
  for (int b = 0; b < BLOCK; b++) {
    const ivec fired = area[b] > SPLAT(0.0);
    crisp[b] = vec_select(fired, moment[b] / vec_select(fired, area[b], SPLAT(1.0)), SPLAT(0.0));
  }
}

/* The largest absolute output; blocks that may contain it are summed. */
static double largest_of(const System *s, double *crisp)
{
  const int64_t cells = s->n_outer * s->n_inner;
  const double error = ERROR_BOUND * -s->points[0];
  vec estimates = SPLAT(0.0), exact = SPLAT(0.0), block[BLOCK];
  for (int64_t cell = 0; cell < cells; cell += LANES) {
    memcpy(block, crisp + cell, sizeof *block);
    estimates = vec_max(vec_abs(*block), estimates);
  }
  double least = 0.0, largest = 0.0;
  for (int k = 0; k < LANES; k++) least = estimates[k] > least ? estimates[k] : least;
  least -= 2.0 * error;
  for (int64_t cell = 0; cell < cells; cell += BLOCK * LANES) {
    ivec below = ISPLAT(-1);
    memcpy(block, crisp + cell, sizeof block);
    UNROLLED
    for (int b = 0; b < BLOCK; b++) below &= vec_abs(block[b]) < SPLAT(least);
    if (!any(~below)) continue;
    sum_block(s, cell / s->n_inner, cell % s->n_inner, block);
    memcpy(crisp + cell, block, sizeof block);
    UNROLLED
    for (int b = 0; b < BLOCK; b++) exact = vec_max(vec_abs(block[b]), exact);
  }
  for (int k = 0; k < LANES; k++) largest = exact[k] > largest ? exact[k] : largest;
  return largest;
}

/* Shares of the largest output, rounded to bytes; blocks with a cell close to the middle between two
   bytes are summed. */
static void quantise(const System *s, const double *crisp, double largest, int8_t *values)
{
  const vec scale = SPLAT(FULL / (largest > 0.0 ? largest : 1.0));
  const vec clear = SPLAT(0.5 - 1e-12) - scale * SPLAT(ERROR_BOUND * -s->points[0]);
  for (int64_t cell = 0; cell < s->n_outer * s->n_inner; cell += BLOCK * LANES) {
    vec block[BLOCK];
    ivec decided = ISPLAT(-1);
    memcpy(block, crisp + cell, sizeof block);
    UNROLLED
    for (int b = 0; b < BLOCK; b++) {
      const vec share = block[b] * scale;
      decided &= vec_abs(share - dvec_round(share)) < clear;
    }
    if (any(~decided)) sum_block(s, cell / s->n_inner, cell % s->n_inner, block);
    for (int b = 0; b < BLOCK; b++) {
      const bytes rounded = __builtin_convertvector(dvec_round(block[b] * scale), bytes);
      memcpy(values + cell + b * LANES, &rounded, sizeof rounded);
    }
  }
}

/* Computes the table of a system of up to MAX_RULES rules, MAX_SETS sets and MAX_POINTS points;
   n_inner is a multiple of BLOCK * LANES, scratch has gaitswarm_scratch(...) doubles. Returns the
   largest output. */
double gaitswarm_table(int64_t n_first, int64_t n_outer, int64_t n_inner, int64_t n_rules,
                       int64_t n_sets, int64_t n_points, const double *outer,
                       const double *inner, const double *weight, const int64_t *consequent,
                       const double *memberships, const double *points, double *scratch,
                       int8_t *values)
{
  const System system = {n_first, n_outer, n_inner, n_rules,    n_sets,      n_points,
                         outer,   inner,   weight,  consequent, memberships, points};
  const int64_t cells = n_outer * n_inner;
  if (n_sets <= MAX_GROUPED) estimate(&system, scratch + cells, scratch);
  else
    for (int64_t cell = 0; cell < cells; cell++) scratch[cell] = __builtin_nan("");
  const double largest = largest_of(&system, scratch);
  quantise(&system, scratch, largest, values);
  return largest;
}

int64_t gaitswarm_scratch(int64_t n_outer, int64_t n_inner, int64_t n_rules)
{
  const int64_t curves = GROUPS * (int64_t)(sizeof(Curve) / sizeof(double));
  return n_outer * n_inner + curves + GROUPS * n_rules * QUANTITIES * n_inner;
}

int64_t gaitswarm_block(void) { return BLOCK * LANES; }
int64_t gaitswarm_max_rules(void) { return MAX_RULES; }
int64_t gaitswarm_max_sets(void) { return MAX_SETS; }
int64_t gaitswarm_max_points(void) { return MAX_POINTS; }
