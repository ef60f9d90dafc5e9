/* Fuzzy tables: an entry for each angle error, current and change of the error, the last one
   fastest. */
#ifndef TABLES_H
#define TABLES_H

#include <stdint.h>

#include "law.h"

#if DIRECT_USED
extern const int8_t direct_table[DIRECT_CELLS];
#endif
#if INTEGRATED_USED
extern const int8_t integrated_table[INTEGRATED_CELLS];
#endif

/* A C file must not be empty. */
typedef int8_t Table_cell;

#endif
