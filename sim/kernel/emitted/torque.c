/* The joint PD of torque-controlled actuators: several times per control tick, from the angles and
   rates that their own encoders see, and held in between. Included by driver.c for robots with such
   actuators. The Python twin is in control_tick.py. */

/* Of all lanes. */
typedef struct {
  wide stiffness, damping;
  wide target[NJ], speed[NJ]; /* of the gait [rad], [rad/s] */
  wide commanded[NJ];         /* torque besides the PD's, per torque limit */
  int64_t period[LANES], left[LANES]; /* physics steps of an inner tick, and until the next one */
} Inner;

/* Torques per torque limit of lanes whose inner tick begins. ago: time since the angles were as the
   PD sees them [s]. limit: of the joints' torques [N m]. */
static void joint_pd(const Inner *s, vec *duty, const wide *angle, const vec *rate,
                     const double *limit, const divec *begins, const dvec *ago)
{
  const dvec one = DSPLAT(1.0);
  for (int j = 0; j < NJ; j++)
    for (int h = 0; h < HALVES; h++) {
      const dvec turning = vec_widened(&rate[j], h);
      const dvec seen = angle[j][h] - ago[h] * turning;
      const dvec pd = s->stiffness[h] * (s->target[j][h] - seen) +
                      s->damping[h] * (s->speed[j][h] - turning);
      const dvec share = s->commanded[j][h] + pd * DSPLAT(1.0 / limit[j]);
      vec_narrow(&duty[j], h,
                 dvec_select(begins[h], clamp(share, -one, one), vec_widened(&duty[j], h)));
    }
}

/* Targets of the PD in a control tick: the gait's coded angle, and its speed to the next one. */
static void set_targets(Inner *s, int k, const Walker *w, int64_t tick, const Coding *c)
{
  const int64_t last = w->ticks - 1, now = tick < last ? tick : last;
  const int64_t next = now < last ? now + 1 : last, before = next > 0 ? next - 1 : 0;
  for (int j = 0; j < NJ; j++) {
    const double step = w->desired[next * NJ + j] - w->desired[before * NJ + j];
    const double carrying = w->feed_forward ? w->feed_forward[now * NJ + j] : 0.0;
    OF_LANE(s->target[j], k) = w->desired[now * NJ + j] / c->angle_counts;
    OF_LANE(s->speed[j], k) = step / c->angle_counts * CONTROL_RATE;
    OF_LANE(s->commanded[j], k) += w->law.feed_forward * carrying / c->robot[NJ + j];
  }
}

/* Lanes whose inner tick begins with the next physics step. */
static int due(Inner *s, divec *begins)
{
  int any = 0;
  for (int k = 0; k < LANES; k++) {
    const int now = --s->left[k] == 0;
    OF_LANE(begins, k) = -now;
    if (now) s->left[k] = s->period[k];
    any |= now;
  }
  return any;
}
