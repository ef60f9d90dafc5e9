/* Calls of gaitswarm_walk, each with its walkers, whose threads share a pool. Included after
   sensors.c, control.c and the sizes NJ (joints), NL (legs), NI (internal state) and NP (parameters); before
   driver.c. */

#include <sched.h>
#include <time.h>

#define NQ (7 + NJ)
#define NV (6 + NJ)
#define N_INTEGRANDS 9
#define N_PEAKS 4
#define NLOG (NQ + NV + NI + 2 * NJ)

enum { OK = 0, DIVERGED = 1, FELL = 2, STRUCK = 5 };

/* Inputs and results of one walk. Fields as in native.py. */
typedef struct {
  const double *q0;             /* NQ, initial position; it starts at rest */
  const double *internal_state; /* NI, initial */
  const double *parameters;     /* NP */
  const int32_t *desired;       /* ticks x NJ, coded angles */
  const double *disturbance;    /* ticks x NJ, torque on the links [N m]; or NULL */
  const double *feed_forward;   /* ticks x NJ, torque that carries the robot [N m]; or NULL */
  Terrain terrain;
  SensorErrors sensors;
  int64_t shove[2]; /* first tick of the push, and the tick after its last */
  Law law;
  int64_t ticks, cycle; /* of the walk and of a cycle of its gait */
  double fall_height;  /* of the body over the ground [m] */
  double fall_cosine;  /* of the tilt */
  double smoothing[2]; /* of the current's analog low-pass, by a step and by one of a touchdown; 1
                          for none */
  double *sums;        /* N_INTEGRANDS, summed over physics steps */
  double *end;         /* NQ, final position */
  double *log;         /* ticks x NLOG: q, v, internal state, sensed current, duty; or NULL */
  double peaks[N_PEAKS]; /* largest |I| of any motor [A] and |torque| of any gear [N m]; largest
                            absolute tangent of the body's roll and sine of its pitch */
  double clearance; /* least height [m] to which any leg's sole was lifted in a cycle */
  int64_t status;
} Walker;

/* The walks of one call in order. Fields as in native.py. */
typedef struct Call {
  Walker *walkers;
  int64_t n, begun;
  int64_t left;   /* walks that have not ended, in any thread's lanes; atomic */
  int64_t number; /* order of arrival in the pool */
  struct Call *following;
} Call;

/* Calls with walks that have not begun, in order of arrival. */
typedef struct {
  int64_t busy;  /* spin lock, held for some ten instructions; atomic */
  int64_t calls; /* number of calls so far; atomic */
  Call *first;   /* atomic */
} Pool;

static void lock(Pool *p)
{
  while (__atomic_exchange_n(&p->busy, 1, __ATOMIC_ACQUIRE)) sched_yield();
}

static void unlock(Pool *p) { __atomic_store_n(&p->busy, 0, __ATOMIC_RELEASE); }

int64_t gaitswarm_left(const Call *call) { return __atomic_load_n(&call->left, __ATOMIC_ACQUIRE); }

/* Appends a call to the pool. */
static void offer(Pool *p, Call *call)
{
  Call **at = &p->first;
  lock(p);
  while (*at) at = &(*at)->following;
  __atomic_store_n(at, call, __ATOMIC_RELAXED);
  call->number = __atomic_fetch_add(&p->calls, 1, __ATOMIC_RELAXED);
  unlock(p);
}

/* Takes the next walk of the thread's own call, then of the first call numbered below the bound;
   returns the call, or NULL if there is none. */
static Call *begin_walk(Pool *p, Call *thread_call, int64_t bound, Walker **w)
{
  Call **at = &p->first, *call;
  if (!__atomic_load_n(at, __ATOMIC_RELAXED)) return NULL;
  lock(p);
  if (thread_call->begun < thread_call->n)
    while (*at != thread_call) at = &(*at)->following;
  call = *at;
  if (call && call->number < bound) {
    *w = &call->walkers[call->begun++];
    if (call->begun == call->n) __atomic_store_n(at, call->following, __ATOMIC_RELAXED);
  } else {
    call = NULL;
  }
  unlock(p);
  return call;
}
