/* Mamdani inference over a grid; the twin of mamdani.py, after vec.h. Sums run over the points in
   order and every operation is IEEE-exact, so both give the same bits. */

enum { BLOCK = 4, MAX_SETS = 32 };

/* Blocks must live in registers, which -O2 alone does not see to. */
#define UNROLLED _Pragma("GCC unroll 4")

/* The grid is n_outer x n_inner cells, n_inner a multiple of BLOCK * LANES. By rule: outer and
   inner degrees, weight, consequent; memberships: n_sets x n_points, MAX_SETS at most. A set that fires nowhere in a
   block of cells is skipped, as most are. */
void gaitswarm_infer(int64_t n_outer, int64_t n_inner, int64_t n_rules, int64_t n_sets,
                     int64_t n_points, const double *outer, const double *inner,
                     const double *weight, const int64_t *consequent, const double *memberships,
                     const double *points, double *crisp)
{
  for (int64_t row = 0; row < n_outer; row++) {
    for (int64_t column = 0; column < n_inner; column += BLOCK * LANES) {
      vec level[MAX_SETS][BLOCK], moment[BLOCK], area[BLOCK];
      memset(level, 0, sizeof level);
      for (int64_t r = 0; r < n_rules; r++) {
        const vec held = SPLAT(outer[r * n_outer + row]);
        UNROLLED
        for (int b = 0; b < BLOCK; b++) {
          vec degree;
          memcpy(&degree, inner + r * n_inner + column + b * LANES, sizeof degree);
          vec *known = &level[consequent[r]][b];
          *known = vec_max(*known, vec_min(held, degree) * SPLAT(weight[r]));
        }
      }
      int64_t set[MAX_SETS], active = 0;
      for (int64_t s = 0; s < n_sets; s++) {
        ivec fires = ISPLAT(0);
        UNROLLED
        for (int b = 0; b < BLOCK; b++) fires |= level[s][b] > SPLAT(0.0);
        int any = 0;
        for (int k = 0; k < LANES; k++) any |= fires[k] != 0;
        if (!any) continue;
        memmove(level[active], level[s], sizeof level[s]);
        set[active++] = s;
      }
      memset(moment, 0, sizeof moment);
      memset(area, 0, sizeof area);
      for (int64_t k = 0; k < n_points; k++) {
        vec joint[BLOCK];
        memset(joint, 0, sizeof joint);
        for (int64_t a = 0; a < active; a++) {
          const vec membership = SPLAT(memberships[set[a] * n_points + k]);
          UNROLLED
          for (int b = 0; b < BLOCK; b++)
            joint[b] = vec_max(joint[b], vec_min(level[a][b], membership));
        }
        UNROLLED
        for (int b = 0; b < BLOCK; b++) {
          moment[b] += SPLAT(points[k]) * joint[b];
          area[b] += joint[b];
        }
      }
      UNROLLED
      for (int b = 0; b < BLOCK; b++) {
        const ivec fired = area[b] > SPLAT(0.0);
        const vec mean = vec_select(fired, moment[b] / vec_select(fired, area[b], SPLAT(1.0)),
                                    SPLAT(0.0));
        memcpy(crisp + row * n_inner + column + b * LANES, &mean, sizeof mean);
      }
    }
  }
}

int64_t gaitswarm_block(void) { return BLOCK * LANES; }
int64_t gaitswarm_max_sets(void) { return MAX_SETS; }
