/* Feeds the controller the inputs of simulated walks and compares its outputs, sample by sample.

   A walk's file, of little-endian 16-bit numbers after its head: "GSWALK1\0", legs (32 bits), ticks
   (32 bits); then by leg and tick the leg's desired angles, angles, currents and PWM counts. */
#include "controller.h"
#include "expected.h"
#include "machine.h"
#ifdef WITH_TRAJECTORIES
#include "trajectory.h"
#endif

#define JOINTS CONTROLLER_JOINTS

typedef struct {
  uint32_t samples, differing;           /* PWM counts */
  uint32_t targets, differing_targets;   /* desired angles */
} Tally;

static void print_number(uint32_t x)
{
  char text[11], *at = text + 10;
  *at = 0;
  do *--at = (char)('0' + x % 10);
  while (x /= 10);
  machine_print(at);
}

static void say(uint32_t number, const char *what)
{
  print_number(number);
  machine_print(what);
}

static uint16_t number_at(const uint8_t *bytes) { return (uint16_t)(bytes[0] | bytes[1] << 8); }

static uint32_t long_at(const uint8_t *bytes)
{
  return number_at(bytes) | (uint32_t)number_at(bytes + 2) << 16;
}

static void replay_tick(Tally *tally, const uint8_t *row)
{
  int16_t desired[JOINTS], angle[JOINTS], pwm[JOINTS];
  uint16_t current[JOINTS];
  for (int j = 0; j < JOINTS; j++) {
    desired[j] = (int16_t)number_at(row + 2 * j);
    angle[j] = (int16_t)number_at(row + 2 * (JOINTS + j));
    current[j] = number_at(row + 2 * (2 * JOINTS + j));
  }
  machine_tick(desired, angle, current, pwm);
  for (int j = 0; j < JOINTS; j++) {
    tally->samples++;
    tally->differing += pwm[j] != (int16_t)number_at(row + 2 * (3 * JOINTS + j));
  }
}

#ifdef WITH_TRAJECTORIES
static void compare_targets(Tally *tally, const uint8_t *row, int walk, int leg, uint32_t tick)
{
  for (int j = 0; j < JOINTS; j++) {
    tally->targets++;
    tally->differing_targets += desired_angle(&trajectories[walk], tick, JOINTS * leg + j) !=
                                (int16_t)number_at(row + 2 * j);
  }
}
#endif

/* Returns 0 if the file is not the expected one. */
static int replay(Tally *tally, int walk)
{
  uint8_t head[16], row[8 * JOINTS];
  static const char magic[8] = "GSWALK1";
  if (!machine_open(expected_walks[walk].file) || !machine_read(head, sizeof head)) return 0;
  for (int i = 0; i < 8; i++)
    if (head[i] != (uint8_t)magic[i]) return 0;
  const uint32_t legs = long_at(head + 8), ticks = long_at(head + 12);
  if (ticks != expected_walks[walk].ticks || legs != EXPECTED_LEGS) return 0;
  for (uint32_t leg = 0; leg < legs; leg++) {
    controller_start();
    for (uint32_t tick = 0; tick < ticks; tick++) {
#ifdef TRACED_TICKS
      if (tick == TRACED_TICKS) return 1;
#endif
      if (!machine_read(row, sizeof row)) return 0;
      replay_tick(tally, row);
#ifdef WITH_TRAJECTORIES
      compare_targets(tally, row, walk, (int)leg, tick);
#endif
    }
  }
  machine_close();
  return 1;
}

#ifndef TRACED_TICKS
/* 32-bit FNV-1a: a walk does not visit every cell of a table. */
static int table_is_sound(const Expected_table *table)
{
  uint32_t hash = 2166136261u;
  for (uint32_t i = 0; i < table->size; i++)
    hash = (hash ^ (uint8_t)table->values[i]) * (uint32_t)16777619;
  machine_print(table->name);
  machine_print(": ");
  say(table->size, hash == table->hash ? " cells, unchanged\n" : " cells, CHANGED\n");
  return hash == table->hash;
}
#endif

int main(void)
{
  Tally all = {0, 0, 0, 0};
  int sound = 1;
#ifndef TRACED_TICKS
  for (int k = 0; k < EXPECTED_TABLES; k++) sound &= table_is_sound(&expected_tables[k]);
#endif
  for (int walk = 0; walk < EXPECTED_WALKS; walk++) {
    Tally tally = {0, 0, 0, 0};
    machine_print(expected_walks[walk].file);
    machine_print(": ");
    if (!replay(&tally, walk)) {
      machine_print("missing or damaged\n");
      return 1;
    }
    say(tally.samples, " samples compared, ");
    say(tally.differing, " differing\n");
    all.samples += tally.samples;
    all.differing += tally.differing;
    all.targets += tally.targets;
    all.differing_targets += tally.differing_targets;
  }
  if (all.targets) {
    machine_print("trajectories: ");
    say(all.targets, " desired angles compared, ");
    say(all.differing_targets, " differing\n");
  }
  machine_print("all: ");
  say(all.samples, " samples compared, ");
  say(all.differing, " differing\n");
  machine_report(say);
  return !sound || all.differing || all.differing_targets || !all.samples;
}
