/* Interface of replay.c to the machine: one open file, text, and a clock. */
#ifndef MACHINE_H
#define MACHINE_H

#include <stdint.h>

int machine_open(const char *path);               /* returns 0 on failure */
int machine_read(uint8_t *bytes, uint32_t count); /* returns 0 at the end of the file */
void machine_close(void);
void machine_print(const char *text);

/* controller_tick, timed where possible. */
void machine_tick(const int16_t *desired, const int16_t *angle, const uint16_t *current,
                  int16_t *pwm);
void machine_report(void (*say)(uint32_t number, const char *what));

#endif
