/* Sensor errors before control.c codes the readings: white noise, and delays by whole control ticks.
   Included before driver.c. The Python twin is sensors.py. */

/* Readings stored for each sensor; a power of two above the longest delay. */
#define KEPT_READINGS 16

enum { ANGLE, CURRENT, SENSORS };

/* gaitswarm.sim.kernel.sensors.SensorErrors. Fields as in native.py. */
typedef struct {
  double noise[SENSORS];  /* per unit of a sum of bytes [rad], [A] */
  int64_t delay[SENSORS]; /* control ticks */
  uint64_t seed;
} SensorErrors;

/* Of all lanes. */
typedef struct {
  int noisy, late; /* whether any lane's sensors are */
  wide noise[SENSORS];
  int64_t delay[SENSORS][LANES];
  divec key[2][HALVES];
  wide seen[SENSORS][NJ]; /* exact before disturb(), then with errors */
  wide stored[SENSORS][KEPT_READINGS][NJ];
} Sensors;

static void set_sensors(Sensors *s, int k, const SensorErrors *e)
{
  for (int n = 0; n < SENSORS; n++) {
    OF_LANE(s->noise[n], k) = e->noise[n];
    s->delay[n][k] = e->delay[n];
    if (e->noise[n] > 0.0) s->noisy = 1;
    if (e->delay[n] > 0) s->late = 1;
  }
  OF_LANE(s->key[0], k) = (int64_t)(e->seed & 0xffffffff);
  OF_LANE(s->key[1], k) = (int64_t)(e->seed >> 32);
}

/* Philox4x32-10 (Salmon et al., Parallel random numbers: as easy as 1, 2, 3, 2011): four words of 32
   bits in 64. */
static void philox(divec *c, divec key0, divec key1)
{
  for (int round = 0; round < 10; round++) {
    const divec a = c[0] * DWHOLE(0xD2511F53), b = c[2] * DWHOLE(0xCD9E8D57);
    c[0] = ((b >> 32) & DWHOLE(0xffffffff)) ^ c[1] ^ key0;
    c[1] = b & DWHOLE(0xffffffff);
    c[2] = ((a >> 32) & DWHOLE(0xffffffff)) ^ c[3] ^ key1;
    c[3] = a & DWHOLE(0xffffffff);
    key0 = (key0 + DWHOLE(0x9E3779B9)) & DWHOLE(0xffffffff);
    key1 = (key1 + DWHOLE(0xBB67AE85)) & DWHOLE(0xffffffff);
  }
}

/* Sum of the eight bytes of two words minus its mean. */
static dvec centred_bytes(divec a, divec b)
{
  const divec even = DWHOLE(0x00ff00ff), low = DWHOLE(0xffff);
  const divec pairs = (a & even) + ((a >> 8) & even) + (b & even) + ((b >> 8) & even);
  return dvec_of((pairs & low) + (pairs >> 16) - DWHOLE(1020));
}

static void add_noise(Sensors *s, const int64_t *tick)
{
  divec at[HALVES];
  for (int k = 0; k < LANES; k++) OF_LANE(at, k) = tick[k];
  for (int j = 0; j < NJ; j++)
    for (int h = 0; h < HALVES; h++) {
      divec words[4] = {at[h], DWHOLE(j), DWHOLE(0), DWHOLE(0)};
      philox(words, s->key[0][h], s->key[1][h]);
      for (int n = 0; n < SENSORS; n++)
        s->seen[n][j][h] += centred_bytes(words[2 * n], words[2 * n + 1]) * s->noise[n][h];
    }
}

/* Delayed readings; those from before the walk equal the first one. */
static void delay_reading(Sensors *s, int k, int n, int64_t tick)
{
  const int64_t then = tick > s->delay[n][k] ? tick - s->delay[n][k] : 0;
  wide *const now = s->stored[n][tick % KEPT_READINGS];
  wide *const past = s->stored[n][then % KEPT_READINGS];
  for (int j = 0; j < NJ; j++) {
    OF_LANE(now[j], k) = OF_LANE(s->seen[n][j], k);
    OF_LANE(s->seen[n][j], k) = OF_LANE(past[j], k);
  }
}

/* Adds errors to the readings; lanes within a control tick read nothing. */
static void disturb(Sensors *s, const int64_t *tick, const divec *begins)
{
  if (s->noisy) add_noise(s, tick);
  if (!s->late) return;
  for (int k = 0; k < LANES; k++)
    for (int n = 0; n < SENSORS; n++)
      if (OF_LANE(begins, k) && s->delay[n][k]) delay_reading(s, k, n, tick[k]);
}
