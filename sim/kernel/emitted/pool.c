/* The walks to be walked: each a walker, in calls of gaitswarm_walk, whose threads share them in a pool.
   Included after sensors.c, control.c and the sizes NJ (joints), NI (numbers of the internal state) and
   NP (parameters); before driver.c. */

#include <sched.h>
#include <time.h>

#define NQ (7 + NJ)
#define NV (6 + NJ)
#define N_INTEGRANDS 8
#define NLOG (NQ + NV + NI + 2 * NJ)

enum { OK = 0, DIVERGED = 1, FELL = 2 };

/* One walker: all it needs and all it leaves behind. Field by field as in native.py. */
typedef struct {
  const double *q0;             /* NQ, initial position; it starts at rest */
  const double *internal_state; /* NI, initial */
  const double *parameters;     /* NP */
  const int32_t *desired;       /* ticks x NJ, coded angles */
  const double *disturbance;    /* ticks x NJ, torque on the links [N m]; or NULL */
  const double *feed_forward;   /* ticks x NJ, torque that carries the robot [N m]; or NULL */
  SensorErrors sensors;
  int64_t shove[2]; /* ticks from which on, and up to which, the body is pushed */
  Law law;
  int64_t ticks;
  double fall_height;  /* of the body over the ground [m] */
  double fall_cosine;  /* of the tilt */
  double smoothing[2]; /* of the current's analog low-pass, by a step and by one of a landing; 1 for none */
  double *sums;        /* N_INTEGRANDS, summed over physics steps */
  double *end;         /* NQ, final position */
  double *log;         /* ticks x NLOG: q, v, internal state, sensed current, duty; or NULL */
  double peak_current; /* largest |I| of any motor [A] */
  int64_t status;
} Walker;

/* The walks of one call, in their order. Field by field as in sharing.py. */
typedef struct Call {
  Walker *walkers;
  int64_t n, begun;
  int64_t left;   /* that have not ended, in whose lanes they may be; atomic */
  int64_t number; /* of the calls of its pool, in the order in which they came */
  struct Call *following;
} Call;

/* Calls with walks that have not begun, in the order in which they came. */
typedef struct {
  int64_t busy;  /* a lock, held for some ten instructions; atomic */
  int64_t calls; /* that have come so far; atomic */
  Call *first;   /* atomic */
} Pool;

static void lock(Pool *p)
{
  while (__atomic_exchange_n(&p->busy, 1, __ATOMIC_ACQUIRE)) sched_yield();
}

static void unlock(Pool *p) { __atomic_store_n(&p->busy, 0, __ATOMIC_RELEASE); }

int64_t gaitswarm_left(const Call *call) { return __atomic_load_n(&call->left, __ATOMIC_ACQUIRE); }

/* The call becomes the last one of the pool. */
static void offer(Pool *p, Call *call)
{
  Call **at = &p->first;
  lock(p);
  while (*at) at = &(*at)->following;
  __atomic_store_n(at, call, __ATOMIC_RELAXED);
  call->number = __atomic_fetch_add(&p->calls, 1, __ATOMIC_RELAXED);
  unlock(p);
}

/* The call whose next walk begins: a thread's own, then the first of those numbered below a bound.
   NULL if there is none. */
static Call *begin_walk(Pool *p, Call *own, int64_t bound, Walker **w)
{
  Call **at = &p->first, *found;
  if (!__atomic_load_n(at, __ATOMIC_RELAXED)) return NULL;
  lock(p);
  if (own->begun < own->n)
    while (*at != own) at = &(*at)->following;
  found = *at;
  if (found && found->number < bound) {
    *w = &found->walkers[found->begun++];
    if (found->begun == found->n) __atomic_store_n(at, found->following, __ATOMIC_RELAXED);
  } else {
    found = NULL;
  }
  unlock(p);
  return found;
}
