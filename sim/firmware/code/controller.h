/* $label: $controller for one leg of $robot, written by gaitswarm.

   Numbers are codes, as the simulator's controllers have them:

   desired, angle   $angle_counts counts a radian, in steps of $angle_step; 16 bits hold half a turn
                    either way. Coxa forward, femur up and tibia up are positive.
   current          $current_counts counts an ampere, absolute, in steps of $current_step, behind an
                    analog low-pass of $current_filter ms.
   pwm              of $pwm_counts counts, at which a motor gets $full_scale V of a supply of
                    $nominal_voltage V, in steps of $pwm_step; positive drives the joint forward or up. */
#ifndef CONTROLLER_H
#define CONTROLLER_H

#include <stdint.h>

#define CONTROLLER_JOINTS 3   /* coxa, femur, tibia */
#define CONTROLLER_RATE $rate /* ticks a second [Hz] */
#define CONTROLLER_FULL_SCALE $pwm_counts
#define CONTROLLER_PWM_STEP $pwm_step

/* Forget what was before: the integral, and the error that changes are measured against. */
void controller_start(void);

/* To be called at CONTROLLER_RATE, and not from two places at once: every array has
   CONTROLLER_JOINTS numbers. */
void controller_tick(const int16_t *desired, const int16_t *angle, const uint16_t *current,
                     int16_t *pwm);

#endif
