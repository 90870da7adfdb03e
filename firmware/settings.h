/* Numbers of the motor controller. Each may be set at compile time: make DEFINES='-DBOOST=0 -DWATCHDOG=0.2'.

   The paper of the flagellum has the board (ATmega328P, Arduino Uno), the encoder's counts and the kind of law ("a
   velocity PI with variable gain"). It has no gains, no sample time and no watchdog: those here are chosen for its
   motor (0.89 N m at rest, 22 rad/s without a load, at 6 V) with a battery of 7.4 V. Try them on the model first. */
#ifndef SETTINGS_H
#define SETTINGS_H

#define PROTOCOL_VERSION 1

#ifndef BAUD
#define BAUD 115200UL /* of the serial line [1/s] */
#endif

#ifndef COUNTS_PER_TURN
#define COUNTS_PER_TURN 2248.86f /* edges of both channels per turn of the gear's shaft (paper, section V) */
#endif

#ifndef PROPORTIONAL
#define PROPORTIONAL 0.011f /* K_p, share of the voltage per rad/s: the loop's bandwidth is 12 rad/s in air */
#endif
#ifndef INTEGRAL
#define INTEGRAL 0.45f /* K_i, share of the voltage per rad: K_p over the motor's time constant of 25 ms */
#endif
#ifndef BOOST
#define BOOST 2.0f /* beta, relative increase of both gains at rest, against cogging and static friction */
#endif
#ifndef LOW_SPEED
#define LOW_SPEED 2.0f /* w_0, speed over which the increase decays [rad/s] */
#endif
#ifndef MOST
#define MOST 1.0f /* largest share of the voltage */
#endif
#ifndef MOST_SPEED
#define MOST_SPEED 100.0f /* largest speed that may be set [rad/s] */
#endif

#ifndef WATCHDOG
#define WATCHDOG 0.5f /* time without a question after which the motor is vented [s], until the host sets it */
#endif
#define LEAST_WATCHDOG 0.04f /* [s]: two samples */
#define MOST_WATCHDOG 60.0f  /* [s] */

/* Timer 1 makes the pulses for the speed controller (ESC), as those of model boats take them, and the samples. */
#define TICKS_PER_SECOND (F_CPU / 8)
#define SAMPLE_TIME 0.02f    /* [s]: one sample for each pulse */
#define NEUTRAL_PULSE 1.5e-3f /* no voltage [s] */
#define PULSE_SPAN 0.5e-3f   /* more or less of it for all of the voltage [s] */
#define LEAD 4e-3f           /* of a sample before the next pulse [s]: time to compute it */
#define STANDSTILL 0.1f      /* without an edge for so long the motor stands [s]: below 0.028 rad/s */

#endif
