/* A machine with a C library. */
#include <stdio.h>

#include "controller.h"
#include "machine.h"

static FILE *file;

int machine_open(const char *path) { return (file = fopen(path, "rb")) != NULL; }
int machine_read(uint8_t *bytes, uint32_t count) { return fread(bytes, 1, count, file) == count; }
void machine_close(void) { fclose(file); }
void machine_print(const char *text) { fputs(text, stdout); }

void machine_tick(const int16_t *desired, const int16_t *angle, const uint16_t *current,
                  int16_t *pwm)
{
  controller_tick(desired, angle, current, pwm);
}

void machine_report(void (*say)(uint32_t number, const char *what)) { (void)say; }
