/* Numbers of the load cell and its servo. Each may be set at compile time: make cell DEFINES='-DWATCHDOG=0.2f'. */
#ifndef CELL_SETTINGS_H
#define CELL_SETTINGS_H

#ifndef LEAST_PULSE
#define LEAST_PULSE 544e-6f /* of the servo at 0 deg [s], as in the library of Arduino */
#endif
#ifndef MOST_PULSE
#define MOST_PULSE 2400e-6f /* at 180 deg [s] */
#endif
#define MOST_ANGLE 180.0f /* [deg] */

#ifndef REST
#define REST 90.0f /* angle after a reset, and where no command comes [deg] */
#endif
#ifndef WATCHDOG
#define WATCHDOG 0.5f /* time without a command after which the servo goes to it [s] */
#endif

#define TICKS_PER_SECOND (F_CPU / 8) /* of timer 1 */
#define PERIOD 0.02f                 /* between pulses of the servo [s] */

#endif
