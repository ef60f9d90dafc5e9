/* Desired angles of a walk as a table, played at CONTROLLER_RATE: row 0 is the pose at the start;
   after the last row comes row `repeats_from`, or, if that is `n_rows`, the last one again. Joints
   that move alike share a column. */
#ifndef TRAJECTORY_H
#define TRAJECTORY_H

#include <stdint.h>

typedef struct {
  const char *name;
  const int16_t *rows; /* n_rows x n_columns [counts of angle] */
  uint32_t n_rows, repeats_from;
  uint16_t n_columns;
  const uint8_t *column_of; /* by joint of the robot */
} Trajectory;

extern const Trajectory trajectories[];

static inline uint32_t trajectory_row(const Trajectory *t, uint32_t tick)
{
  if (tick < t->n_rows) return tick;
  if (t->repeats_from == t->n_rows) return t->n_rows - 1;
  return t->repeats_from + (tick - t->repeats_from) % (t->n_rows - t->repeats_from);
}

static inline int16_t desired_angle(const Trajectory *t, uint32_t tick, int joint)
{
  return t->rows[trajectory_row(t, tick) * t->n_columns + t->column_of[joint]];
}

#endif
