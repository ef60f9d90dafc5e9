/* Estimates of a Mamdani inference over a grid, for inference.c; after vec.h.

   By inclusion and exclusion, the area of the union of clipped sets is a sum over groups of sets of
   +-G(least level), where G(t) is the area of the group's common membership, clipped at t. G is
   increasing, so it commutes with min and max: as a level is a maximum of minima of weighted grades,
   G of a level is a maximum of minima of G of weighted grades. These depend on one axis each and are
   tabulated along the axes; a cell needs only a few minima and maxima. The moment about the
   universe's lower end is increasing too. If the system is odd or even in its first input, half of
   the rows mirror the others. */

enum { BLOCK = 4, MAX_SETS = 32, MAX_RULES = 16, MAX_POINTS = 128, MAX_GROUPED = 5 };
enum { AREA, MOMENT, QUANTITIES, GROUPS = 1 << MAX_GROUPED };

/* Bound of an estimate's error relative to the universe. At most 31 groups, each a sum of some
   hundred roundings: the error is below 2e-12. */
#define ERROR_BOUND 1e-11

/* Below this area, products of grades and points may have lost digits to underflow. */
#define TINY 1e-200

/* Keeps blocks in registers, which -O2 alone does not. */
#define UNROLLED _Pragma("GCC unroll 4")

/* The grid has n_outer x n_inner cells, with n_first values of the first input in its rows. By rule:
   outer and inner degrees, weight, consequent. */
typedef struct {
  int64_t n_first, n_outer, n_inner, n_rules, n_sets, n_points;
  const double *outer, *inner, *weight;
  const int64_t *consequent;
  const double *memberships, *points; /* n_sets x n_points, n_points */
} System;

/* Area and moment of a membership clipped at t, n of whose points are above zero: with `rank`
   memberships up to t, below[rank] + t * above[rank]. */
typedef struct {
  int64_t built, n;
  double membership[MAX_POINTS]; /* ascending */
  double below[QUANTITIES][MAX_POINTS + 1], above[QUANTITIES][MAX_POINTS + 1];
} Curve;

/* By group of sets (a bitmask): its curve, and the curve at the inner degrees of every rule. */
typedef struct {
  const System *system;
  Curve *curves;
  double *along; /* GROUPS x n_rules x QUANTITIES x n_inner */
  int64_t varies[MAX_RULES]; /* whether a rule's inner degrees differ */
  int64_t n_rules[MAX_GROUPED], rules[MAX_GROUPED][MAX_RULES]; /* rules by consequent set */
} Groups;

/* Part of a rule in a row whose degree varies along the row. */
typedef struct {
  double held[QUANTITIES];
  const double *along; /* QUANTITIES x n_inner */
} Clause;

/* One set of a group: the maximum of `held` and its clauses. */
typedef struct {
  double held[QUANTITIES];
  int64_t n_clauses;
  Clause clauses[MAX_RULES];
} Member;

/* One group: the minimum of `held` and its members. */
typedef struct {
  double held[QUANTITIES];
  int64_t adds, n_members;
  Member members[MAX_GROUPED];
} Term;

static void build_curve(Curve *curve, const System *s, int64_t group)
{
  double arm[MAX_POINTS];
  int64_t n = 0;
  for (int64_t k = 0; k < s->n_points; k++) {
    double joint = 1.0;
    for (int64_t set = 0; set < s->n_sets; set++) {
      const double membership = s->memberships[set * s->n_points + k];
      if (group >> set & 1 && membership < joint) joint = membership;
    }
    if (!(joint > 0.0)) continue;
    int64_t place = n++;
    for (; place && curve->membership[place - 1] > joint; place--) {
      curve->membership[place] = curve->membership[place - 1];
      arm[place] = arm[place - 1];
    }
    curve->membership[place] = joint;
    arm[place] = s->points[k] - s->points[0];
  }
  curve->built = 1;
  curve->n = n;
  curve->below[AREA][0] = curve->below[MOMENT][0] = 0.0;
  curve->above[AREA][n] = curve->above[MOMENT][n] = 0.0;
  for (int64_t k = 0; k < n; k++) {
    const double membership = curve->membership[k];
    curve->below[AREA][k + 1] = curve->below[AREA][k] + membership;
    curve->below[MOMENT][k + 1] = curve->below[MOMENT][k] + membership * arm[k];
  }
  for (int64_t k = n; k-- > 0;) {
    curve->above[AREA][k] = curve->above[AREA][k + 1] + 1.0;
    curve->above[MOMENT][k] = curve->above[MOMENT][k + 1] + arm[k];
  }
}

/* A curve at t; the search for the rank starts at the previous one, as neighbours are near. */
static void look_up(const Curve *curve, double t, int64_t *rank, double *value)
{
  int64_t at = *rank;
  while (at < curve->n && curve->membership[at] <= t) at++;
  while (at > 0 && curve->membership[at - 1] > t) at--;
  for (int q = 0; q < QUANTITIES; q++) value[q] = curve->below[q][at] + t * curve->above[q][at];
  *rank = at;
}

static double *along_inner(const Groups *g, int64_t group, int64_t rule)
{
  return g->along + (group * g->system->n_rules + rule) * QUANTITIES * g->system->n_inner;
}

static const Curve *curve_of(const Groups *g, int64_t group)
{
  const System *s = g->system;
  Curve *curve = &g->curves[group];
  if (curve->built) return curve;
  build_curve(curve, s, group);
  for (int64_t r = 0; r < s->n_rules; r++) {
    if (!(group >> s->consequent[r] & 1) || !g->varies[r]) continue;
    double *along = along_inner(g, group, r), value[QUANTITIES];
    int64_t rank = 0;
    for (int64_t column = 0; column < s->n_inner; column++) {
      look_up(curve, s->weight[r] * s->inner[r * s->n_inner + column], &rank, value);
      for (int q = 0; q < QUANTITIES; q++) along[q * s->n_inner + column] = value[q];
    }
  }
  return curve;
}

/* All groups of the sets that fire in a row. rank: the previous one, by group and rule. */
static int64_t terms_of(const Groups *g, int64_t row, int64_t (*rank)[MAX_RULES], Term *terms)
{
  const System *s = g->system;
  double weighted[MAX_RULES];
  int64_t firing = 0, n = 0;
  for (int64_t r = 0; r < s->n_rules; r++) {
    weighted[r] = s->weight[r] * s->outer[r * s->n_outer + row];
    if (weighted[r] > 0.0) firing |= (int64_t)1 << s->consequent[r];
  }
  for (int64_t group = firing; group; group = (group - 1) & firing) {
    const Curve *curve = curve_of(g, group);
    if (!curve->n) continue;
    Term *term = &terms[n++];
    term->adds = __builtin_parityll((uint64_t)group);
    term->n_members = 0;
    for (int q = 0; q < QUANTITIES; q++) term->held[q] = __builtin_inf();
    for (int64_t sets = group; sets; sets &= sets - 1) {
      const int set = __builtin_ctzll((uint64_t)sets);
      Member *member = &term->members[term->n_members];
      member->n_clauses = 0;
      for (int q = 0; q < QUANTITIES; q++) member->held[q] = 0.0;
      for (int64_t k = 0; k < g->n_rules[set]; k++) {
        const int64_t r = g->rules[set][k];
        if (!(weighted[r] > 0.0)) continue;
        double value[QUANTITIES];
        look_up(curve, weighted[r], &rank[group][r], value);
        if (g->varies[r]) {
          Clause *clause = &member->clauses[member->n_clauses++];
          memcpy(clause->held, value, sizeof value);
          clause->along = along_inner(g, group, r);
        } else {
          for (int q = 0; q < QUANTITIES; q++)
            member->held[q] = value[q] > member->held[q] ? value[q] : member->held[q];
        }
      }
      if (member->n_clauses) {
        term->n_members++;
      } else {
        for (int q = 0; q < QUANTITIES; q++)
          term->held[q] = member->held[q] < term->held[q] ? member->held[q] : term->held[q];
      }
    }
  }
  return n;
}

/* Crisp outputs of a block of cells from the row's terms, NaN if undetermined. */
static void estimate_block(const System *s, const Term *terms, int64_t n_terms, int64_t column,
                           vec *crisp)
{
  vec total[QUANTITIES][BLOCK];
  for (int q = 0; q < QUANTITIES; q++) {
    vec sum[BLOCK];
    memset(sum, 0, sizeof sum);
    for (const Term *term = terms; term < terms + n_terms; term++) {
      vec joint[BLOCK];
      UNROLLED
      for (int b = 0; b < BLOCK; b++) joint[b] = SPLAT(term->held[q]);
      for (const Member *m = term->members; m < term->members + term->n_members; m++) {
        vec level[BLOCK];
        UNROLLED
        for (int b = 0; b < BLOCK; b++) level[b] = SPLAT(m->held[q]);
        for (const Clause *c = m->clauses; c < m->clauses + m->n_clauses; c++) {
          UNROLLED
          for (int b = 0; b < BLOCK; b++) {
            vec along;
            memcpy(&along, c->along + q * s->n_inner + column + b * LANES, sizeof along);
            level[b] = vec_max(level[b], vec_min(SPLAT(c->held[q]), along));
          }
        }
        UNROLLED
        for (int b = 0; b < BLOCK; b++) joint[b] = vec_min(joint[b], level[b]);
      }
      if (term->adds) {
        UNROLLED
        for (int b = 0; b < BLOCK; b++) sum[b] += joint[b];
      } else {
        UNROLLED
        for (int b = 0; b < BLOCK; b++) sum[b] -= joint[b];
      }
    }
    memcpy(total[q], sum, sizeof sum);
  }
  UNROLLED
  for (int b = 0; b < BLOCK; b++)
    crisp[b] = vec_select(total[AREA][b] > SPLAT(TINY),
                          total[MOMENT][b] / total[AREA][b] + SPLAT(s->points[0]),
                          SPLAT(__builtin_nan("")));
}

/* Whether each rule has a partner with equal degrees when the first input is mirrored about its
   middle value, and the same consequent, or the mirrored one. */
static int is_symmetric(const System *s, int odd)
{
  const int64_t width = s->n_outer / s->n_first;
  for (int64_t r = 0; r < s->n_rules; r++) {
    int equal = 0;
    for (int64_t other = 0; other < s->n_rules && !equal; other++) {
      const double *a = s->memberships + s->consequent[r] * s->n_points;
      const double *b = s->memberships + s->consequent[other] * s->n_points;
      equal = s->weight[r] == s->weight[other];
      for (int64_t k = 0; k < s->n_points && equal; k++)
        equal = a[k] == b[odd ? s->n_points - 1 - k : k];
      for (int64_t k = 0; k < s->n_inner && equal; k++)
        equal = s->inner[r * s->n_inner + k] == s->inner[other * s->n_inner + k];
      for (int64_t k = width; k < s->n_outer && equal; k++)
        equal = s->outer[r * s->n_outer + k] ==
                s->outer[other * s->n_outer + (s->n_first - k / width) * width + k % width];
    }
    if (!equal) return 0;
  }
  return 1;
}

static void estimate(const System *s, double *scratch, double *crisp)
{
  Groups g = {.system = s, .curves = (Curve *)scratch, .n_rules = {0}};
  g.along = scratch + GROUPS * sizeof(Curve) / sizeof(double);
  for (int64_t group = 0; group < GROUPS; group++) g.curves[group].built = 0;
  for (int64_t r = 0; r < s->n_rules; r++) {
    g.varies[r] = 0;
    for (int64_t k = 0; k < s->n_inner; k++) g.varies[r] |= s->inner[r * s->n_inner + k] != 1.0;
    const int64_t set = s->consequent[r];
    g.rules[set][g.n_rules[set]++] = r;
  }
  int64_t rank[GROUPS][MAX_RULES];
  Term terms[GROUPS];
  memset(rank, 0, sizeof rank);
  const int64_t width = s->n_outer / s->n_first;
  const int odd = is_symmetric(s, 1), symmetric = odd || is_symmetric(s, 0);
  for (int64_t row = s->n_outer; row-- > 0;) {
    const int64_t mirrored = (s->n_first - row / width) * width + row % width;
    if (symmetric && row < mirrored && mirrored < s->n_outer) {
      const double *twin = crisp + mirrored * s->n_inner;
      for (int64_t k = 0; k < s->n_inner; k++)
        crisp[row * s->n_inner + k] = odd ? -twin[k] : twin[k];
      continue;
    }
    const int64_t n_terms = terms_of(&g, row, rank, terms);
    for (int64_t column = 0; column < s->n_inner; column += BLOCK * LANES) {
      vec block[BLOCK];
      estimate_block(s, terms, n_terms, column, block);
      memcpy(crisp + row * s->n_inner + column, block, sizeof block);
    }
  }
}
