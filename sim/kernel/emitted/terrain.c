/* Uneven ground as a grid of heights, which lanes read at different places. Included before pool.c.
   The Python twin is HeightGrid.under of terrain.py. */

/* Fields as in native.py; heights is NULL on flat ground. */
typedef struct {
  const double *heights;     /* (cells[0] + 1) x (cells[1] + 1) */
  int64_t cells[2];          /* along x and y */
  double origin[2], repeats[2]; /* x and y of the first corner [m]; repeats: 1 / cells or 0 */
  double per_metre, scale;   /* cells per metre, and factor of the heights */
  double top;                /* largest height [m] */
  double corners[4][3];      /* of the body's underside, in its frame [m] */
} Terrain;

#if UNEVEN
typedef struct {
  const double *heights[LANES];
  wide columns, cells[2], origin[2], repeats[2], per_metre, scale, top, corners[4][3];
} Ground;

static void set_ground(Ground *g, int k, const Terrain *t)
{
  g->heights[k] = t->heights;
  OF_LANE(g->columns, k) = (double)(t->cells[1] + 1);
  for (int i = 0; i < 2; i++) {
    OF_LANE(g->cells[i], k) = (double)t->cells[i];
    OF_LANE(g->origin[i], k) = t->origin[i];
    OF_LANE(g->repeats[i], k) = t->repeats[i];
  }
  OF_LANE(g->per_metre, k) = t->per_metre;
  OF_LANE(g->scale, k) = t->scale;
  OF_LANE(g->top, k) = t->top;
  for (int i = 0; i < 4; i++)
    for (int j = 0; j < 3; j++) OF_LANE(g->corners[i][j], k) = t->corners[i][j];
}

/* Share of a cell along x (0) or y (1), and the cell's index; 0 and cell 0 for a NaN. */
static dvec on_grid(const Ground *g, int h, int axis, dvec at, dvec *index, divec *inside)
{
  const dvec cells = g->cells[axis][h], zero = DSPLAT(0.0);
  dvec u = (at - g->origin[axis][h]) * g->per_metre[h];
  u = u - dvec_floor(u * g->repeats[axis][h]) * cells;
  const dvec on = dvec_min(dvec_max(u, zero), cells);
  *index = dvec_min(dvec_floor(on), cells - DSPLAT(1.0));
  *inside = u == on;
  return on - *index;
}

/* Height [m] and slopes along x and y at a point of every lane. */
static void under(const Ground *g, int h, dvec x, dvec y, dvec patch[3])
{
  dvec i, j, corner, left, ahead, across;
  divec inside[2];
  const dvec u = on_grid(g, h, 0, x, &i, &inside[0]), v = on_grid(g, h, 1, y, &j, &inside[1]);
  const divec row = dvec_whole(i * g->columns[h] + j), columns = dvec_whole(g->columns[h]);
  double read[4][DOUBLES];
  for (int n = 0; n < DOUBLES; n++) {
    const double *at = g->heights[h * DOUBLES + n] + row[n];
    read[0][n] = at[0], read[1][n] = at[1];
    read[2][n] = at[columns[n]], read[3][n] = at[columns[n] + 1];
  }
  memcpy(&corner, read[0], sizeof corner), memcpy(&left, read[1], sizeof left);
  memcpy(&ahead, read[2], sizeof ahead), memcpy(&across, read[3], sizeof across);
  const dvec near = corner + v * (left - corner), far = ahead + v * (across - ahead);
  const dvec rise = far - near, sideways = left - corner;
  const dvec steepness = g->scale[h] * g->per_metre[h];
  patch[0] = g->scale[h] * (near + u * rise);
  patch[1] = dvec_select(inside[0], steepness * rise, DSPLAT(0.0));
  patch[2] = dvec_select(inside[1], steepness * (sideways + u * ((across - ahead) - sideways)),
                         DSPLAT(0.0));
}

/* Tangent planes below the feet, (NL, 3). */
static void patch_feet(const Ground *g, vec (*places)[6], vec *patches)
{
  for (int l = 0; l < NL; l++)
    for (int h = 0; h < HALVES; h++) {
      dvec patch[3];
      under(g, h, vec_widened(&places[l][0], h), vec_widened(&places[l][1], h), patch);
      for (int i = 0; i < 3; i++) vec_narrow(&patches[3 * l + i], h, patch[i]);
    }
}

/* Lanes whose point is below the ground; most points are above all of it. */
static divec buried(const Ground *g, int h, dvec x, dvec y, dvec z)
{
  const divec low = z < g->top[h];
  int64_t any = 0;
  dvec patch[3];
  for (int n = 0; n < DOUBLES; n++) any |= low[n];
  if (!any) return low;
  under(g, h, x, y, patch);
  return z < patch[0];
}

/* Lanes of which a knee or a corner of the body is below the ground. */
static divec struck(const Ground *g, int h, const wide *q, vec (*places)[6])
{
  const dvec x = q[3][h], y = q[4][h], z = q[5][h], w = q[6][h], two = DSPLAT(2.0);
  divec below = {0};
  for (int l = 0; l < NL; l++)
    below |= buried(g, h, vec_widened(&places[l][3], h), vec_widened(&places[l][4], h),
                    vec_widened(&places[l][5], h));
  for (int i = 0; i < 4; i++) {
    const dvec a = g->corners[i][0][h], b = g->corners[i][1][h], c = g->corners[i][2][h];
    const dvec ta = two * (y * c - z * b), tb = two * (z * a - x * c), tc = two * (x * b - y * a);
    below |= buried(g, h, q[0][h] + (a + w * ta + (y * tc - z * tb)),
                    q[1][h] + (b + w * tb + (z * ta - x * tc)),
                    q[2][h] + (c + w * tc + (x * tb - y * ta)));
  }
  return below;
}
#endif
