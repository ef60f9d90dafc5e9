/* Control in the actuators: several times per control tick, from the angles and rates that their own
   encoders see, and held in between. The joint PD of torque-controlled actuators, or with SERVO the
   position control of servos. Included by driver.c. The Python twin is in control_tick.py. */

/* Of all lanes. */
typedef struct {
  wide stiffness, damping;    /* with SERVO their P, and 1 */
  wide target[NJ], speed[NJ]; /* of the gait [rad], [rad/s]; with SERVO [counts] */
  wide commanded[NJ];         /* torque besides the PD's, per torque limit; or duty */
  int64_t period[LANES], left[LANES]; /* physics steps of an inner tick, and until the next one */
} Inner;

/* Duty, or torques per torque limit, of lanes whose inner tick begins. ago: time since the angles
   were as the control sees them [s]. */
static void inner_law(const Inner *s, const Coding *c, vec *duty, const wide *angle, const vec *rate,
                      const divec *begins, const dvec *ago)
{
  for (int j = 0; j < NJ; j++)
    for (int h = 0; h < HALVES; h++) {
      const dvec turning = vec_widened(&rate[j], h);
      const dvec seen = angle[j][h] - ago[h] * turning;
#if SERVO
      const double *const servo = c->robot + SERVOS + j;
      const dvec gain = s->stiffness[h] * DSPLAT(servo[0]) + s->damping[h] * DSPLAT(servo[NJ]);
      const dvec error = s->target[j][h] - code_of(seen, c->angle_counts, -4 * CODE_LIMIT,
                                                   4 * CODE_LIMIT, c->angle_step);
      const divec beyond = dvec_max(error, -error) > DSPLAT(servo[2 * NJ]);
      const dvec most = DSPLAT(servo[3 * NJ]);
      const dvec share = s->commanded[j][h] + dvec_select(beyond, error, DSPLAT(0.0)) * gain;
#else
      const dvec pd = s->stiffness[h] * (s->target[j][h] - seen) +
                      s->damping[h] * (s->speed[j][h] - turning);
      const dvec most = DSPLAT(1.0);
      const dvec share = s->commanded[j][h] + pd * DSPLAT(1.0 / c->robot[NJ + j]);
#endif
      vec_narrow(&duty[j], h,
                 dvec_select(begins[h], clamp(share, -most, most), vec_widened(&duty[j], h)));
    }
}

/* Targets in a control tick: the gait's coded angle, and its speed to the next one. */
static void set_targets(Inner *s, int k, const Walker *w, int64_t tick, const Coding *c)
{
  const int64_t last = w->ticks - 1, now = tick < last ? tick : last;
#if SERVO
  for (int j = 0; j < NJ; j++)
    OF_LANE(s->target[j], k) = coarsen(DSPLAT(w->desired[now * NJ + j]), c->angle_step)[0];
#else
  const int64_t next = now < last ? now + 1 : last, before = next > 0 ? next - 1 : 0;
  for (int j = 0; j < NJ; j++) {
    const double step = w->desired[next * NJ + j] - w->desired[before * NJ + j];
    const double carrying = w->feed_forward ? w->feed_forward[now * NJ + j] : 0.0;
    OF_LANE(s->target[j], k) = w->desired[now * NJ + j] / c->angle_counts;
    OF_LANE(s->speed[j], k) = step / c->angle_counts * CONTROL_RATE;
    OF_LANE(s->commanded[j], k) += w->law.feed_forward * carrying / c->robot[NJ + j];
  }
#endif
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
