/* What replay.c needs of the machine that it runs on: one open file, text, and a clock. */
#ifndef MACHINE_H
#define MACHINE_H

#include <stdint.h>

int machine_open(const char *path);               /* 0 if it cannot be */
int machine_read(uint8_t *bytes, uint32_t count); /* 0 if there are not so many */
void machine_close(void);
void machine_print(const char *text);

/* controller_tick, and how long it takes where that is counted. */
void machine_tick(const int16_t *desired, const int16_t *angle, const uint16_t *current,
                  int16_t *pwm);
void machine_report(void (*say)(uint32_t number, const char *what));

#endif
