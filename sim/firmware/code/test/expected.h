/* Expected values for replay.c. */
#ifndef EXPECTED_H
#define EXPECTED_H

#include <stdint.h>

#define EXPECTED_LEGS $legs
#define EXPECTED_WALKS $walks
#define EXPECTED_TABLES $tables

typedef struct {
  const char *file;
  uint32_t ticks;
} Expected_walk;

typedef struct {
  const char *name;
  const int8_t *values;
  uint32_t size, hash; /* FNV-1a */
} Expected_table;

extern const Expected_walk expected_walks[];
extern const Expected_table expected_tables[];

#endif
