/* Advances velocities by a step at fixed positions; currents and integrands are those of its
   middle, which also raises peaks and, by leg, the heights to which soles were lifted. landing: 1
   if a foot may touch down within a control tick. shoved: whether any walk's body may be pushed.
   patches: uneven ground below the feet. */
static void kick(const vec *q, vec *v, vec *internal, const vec *duty, const vec *disturbance,
                 const vec *p, const double *robot, const vec *patches, int shoved, vec *current,
                 vec *integrands, vec *peaks, vec *lifted, vec *landing)
{
  static const int start[$limbs] = { $starts }, kind[$limbs] = { $kinds };
  vec body[$body], supply, held[$limbs][$held], gathered[$passed];
  vec spun[$joints], springs[$joints], carried[4], falling[6], of_body[5], tallies[$tallies];
  vec total[6];
  (void)patches;
  $before_limbs
  if (shoved) {
    $push_body
  }
  for (int l = 0; l < $limbs; l++) {
    switch (kind[l]) {
$before_calls
    }
$copies
  }
  $solve_body
  *landing = SPLAT(0.0);
  for (int l = 0; l < $limbs; l++) {
    switch (kind[l]) {
$after_calls
    }
    for (int i = 0; i < 6; i++) total[i] = l ? total[i] + tallies[i] : tallies[i];
    for (int i = 0; i < 2; i++) peaks[i] = vec_max(peaks[i], tallies[6 + i]);
    *landing = vec_max(*landing, tallies[8]);
    lifted[l] = vec_max(lifted[l], tallies[9]);
  }
  integrands[0] = total[0] * total[0];
  integrands[1] = of_body[0];
  integrands[2] = of_body[1];
  integrands[3] = total[1];
  integrands[4] = of_body[2];
  for (int i = 2; i < 6; i++) integrands[3 + i] = total[i];
  for (int i = 2; i < 4; i++) peaks[i] = vec_max(peaks[i], of_body[1 + i]);
}
