/* Lets another process call a kernel's functions: appended to the kernel's source, with FUNCTIONS
   and a main that is run under an emulator.

   Standard input holds 64-bit integers: number of the function, how many pointers there are to set
   right, size of the memory, ARGUMENTS arguments; then the pointers' places in the memory, then the
   memory itself. A pointer is given as the place it points to; so are arguments from the first one
   on, of which the bit is set in the last number of the head. Standard output is the result, then
   the memory as the function leaves it.

   It asks Linux itself: a C library for another architecture takes a minute to build. */
#include <sched.h>
#include <time.h>

enum { ARGUMENTS = 8, POINTERS = 1 << 16, SIZE = 1 << 28 };
enum { READ = 63, WRITE = 64, EXIT = 93, CLOCK_GETTIME = 113, YIELD = 124 };

typedef int64_t (*Function)(int64_t, int64_t, int64_t, int64_t, int64_t, int64_t, int64_t, int64_t);

static int64_t places[POINTERS];
static _Alignas(64) char memory[SIZE];

static int64_t ask(int64_t number, int64_t a, int64_t b, int64_t c)
{
  register int64_t x8 __asm__("x8") = number;
  register int64_t x0 __asm__("x0") = a;
  register int64_t x1 __asm__("x1") = b;
  register int64_t x2 __asm__("x2") = c;
  __asm__ volatile("svc 0" : "+r"(x0) : "r"(x8), "r"(x1), "r"(x2) : "memory");
  return x0;
}

static void pass(int64_t number, int64_t file, void *at, size_t size)
{
  for (size_t done = 0; done < size;) {
    const int64_t some = ask(number, file, (int64_t)at + (int64_t)done, (int64_t)(size - done));
    if (some <= 0) ask(EXIT, 2, 0, 0);
    done += (size_t)some;
  }
}

/* What compilers call by themselves, what the kernel's threads do while they wait, and its clock.
   Volatile: else a compiler sees in the loop what it is, and calls it. */
void *memcpy(void *restrict to, const void *restrict from, size_t size)
{
  for (size_t k = 0; k < size; k++) ((volatile char *)to)[k] = ((const char *)from)[k];
  return to;
}

void *memmove(void *to, const void *from, size_t size)
{
  const int up = (uintptr_t)to < (uintptr_t)from;
  for (size_t n = 0; n < size; n++) {
    const size_t k = up ? n : size - 1 - n;
    ((volatile char *)to)[k] = ((const char *)from)[k];
  }
  return to;
}

void *memset(void *to, int value, size_t size)
{
  for (size_t k = 0; k < size; k++) ((volatile char *)to)[k] = (char)value;
  return to;
}

int sched_yield(void) { return (int)ask(YIELD, 0, 0, 0); }

int clock_gettime(clockid_t clock, struct timespec *now)
{
  return (int)ask(CLOCK_GETTIME, clock, (int64_t)now, 0);
}

__attribute__((noreturn)) void _start(void)
{
  static const Function functions[] = {FUNCTIONS};
  int64_t head[3 + ARGUMENTS + 1];
  pass(READ, 0, head, sizeof head);
  const size_t n_pointers = (size_t)head[1], size = (size_t)head[2];
  if (n_pointers > POINTERS || size > SIZE) ask(EXIT, 3, 0, 0);
  pass(READ, 0, places, n_pointers * sizeof *places);
  pass(READ, 0, memory, size);
  for (size_t k = 0; k < n_pointers; k++) {
    int64_t at;
    memcpy(&at, memory + places[k], sizeof at);
    at += (int64_t)memory;
    memcpy(memory + places[k], &at, sizeof at);
  }
  int64_t *a = head + 3;
  for (int k = 0; k < ARGUMENTS; k++)
    if (a[ARGUMENTS] >> k & 1) a[k] += (int64_t)memory;
  int64_t result = functions[head[0]](a[0], a[1], a[2], a[3], a[4], a[5], a[6], a[7]);
  pass(WRITE, 1, &result, sizeof result);
  pass(WRITE, 1, memory, size);
  for (;;) ask(EXIT, 0, 0, 0);
}
