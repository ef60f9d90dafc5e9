/* A Cortex-M board in qemu, without a C library: start-up, semihosting, and a clock that counts
   instructions. With qemu's -icount shift=10 an instruction takes 1024 ns of the board's time, which
   SysTick counts at the processor's clock. */
#include "controller.h"
#include "machine.h"

enum { SYS_OPEN = 1, SYS_CLOSE = 2, SYS_WRITE0 = 4, SYS_READ = 6, SYS_EXIT = 0x18 };
enum { EXITED = 0x20026, FAILED = 0x20023 };

#define SYSTICK ((volatile uint32_t *)0xE000E010)
#define SYSTICK_MOST 0xFFFFFFu

extern uint32_t stack_top[], data_begin[], data_end[], data_stored[], bss_begin[], bss_end[];
extern int main(void);

static int32_t file;
static uint32_t ticks, most, idle;
static uint64_t total;

static int32_t semihost(int32_t operation, const void *argument)
{
  register int32_t r0 __asm__("r0") = operation;
  register const void *r1 __asm__("r1") = argument;
  __asm__ volatile("bkpt 0xab" : "+r"(r0) : "r"(r1) : "memory");
  return r0;
}

static uint32_t length(const char *text)
{
  uint32_t n = 0;
  while (text[n]) n++;
  return n;
}

int machine_open(const char *path)
{
  const uint32_t block[3] = {(uint32_t)(uintptr_t)path, 1, length(path)};
  file = semihost(SYS_OPEN, block);
  return file != -1;
}

int machine_read(uint8_t *bytes, uint32_t count)
{
  const uint32_t block[3] = {(uint32_t)file, (uint32_t)(uintptr_t)bytes, count};
  return semihost(SYS_READ, block) == 0;
}

void machine_close(void)
{
  const uint32_t block[1] = {(uint32_t)file};
  semihost(SYS_CLOSE, block);
}

void machine_print(const char *text) { semihost(SYS_WRITE0, text); }

/* End of a trace of instructions that began at controller_tick. */
__attribute__((noinline)) void tick_done(void) { __asm__ volatile(""); }

static uint32_t now(void) { return SYSTICK[2]; }

/* Converts clock ticks to instructions. SysTick counts down. */
static uint32_t instructions(uint32_t before, uint32_t after)
{
  const uint64_t clock = (before - after) & SYSTICK_MOST;
  return (uint32_t)((clock * CLOCK_PICOSECONDS + 512000) / 1024000);
}

void machine_tick(const int16_t *desired, const int16_t *angle, const uint16_t *current,
                  int16_t *pwm)
{
  const uint32_t before = now();
  controller_tick(desired, angle, current, pwm);
#ifdef TRACED_TICKS
  tick_done();
#endif
  const uint32_t spent = instructions(before, now()) - idle;
  ticks++;
  total += spent;
  if (spent > most) most = spent;
}

void machine_report(void (*say)(uint32_t number, const char *what))
{
  machine_print("controller_tick: ");
  say((uint32_t)((total + ticks / 2) / ticks), " instructions on average, ");
  say(most, " at most, for ");
  say(CONTROLLER_JOINTS, " joints\n");
}

void *memset(void *to, int value, __SIZE_TYPE__ n)
{
  uint8_t *at = to;
  while (n--) *at++ = (uint8_t)value;
  return to;
}

void *memcpy(void *to, const void *from, __SIZE_TYPE__ n)
{
  uint8_t *at = to;
  const uint8_t *source = from;
  while (n--) *at++ = *source++;
  return to;
}

void reset(void);
void reset(void)
{
  for (uint32_t *to = data_begin, *from = data_stored; to < data_end;) *to++ = *from++;
  for (uint32_t *to = bss_begin; to < bss_end;) *to++ = 0;
  SYSTICK[1] = SYSTICK_MOST;
  SYSTICK[2] = 0;
  SYSTICK[0] = 5; /* enabled, at the processor's clock */
  now();
  const uint32_t before = now();
  idle = instructions(before, now());
  semihost(SYS_EXIT, (const void *)(uintptr_t)(main() ? FAILED : EXITED));
}

static void fault(void) { semihost(SYS_EXIT, (const void *)FAILED); }

__attribute__((section(".vectors"), used)) static void *const vectors[] = {
    stack_top, (void *)reset, (void *)fault, (void *)fault,
};
