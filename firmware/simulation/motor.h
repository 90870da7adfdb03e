/* A DC motor behind a gear: nectosome.drives.GearedMotor, with a drag, cogging and the shaft that they turn. */
#ifndef MOTOR_H
#define MOTOR_H

struct motor {
    double constant;       /* K [V s/rad] */
    double resistance;     /* R [ohm] */
    double friction;       /* T_f [N m] */
    double efficiency;     /* eta */
    double friction_speed; /* v_t, over which friction changes its sign [rad/s] */
    double inertia;        /* J, of all that turns [kg m2] */
    double drag;           /* d [N m s] */
    double cogging;        /* T_c [N m] */
    double teeth;          /* n, cogs per turn */
};

struct shaft {
    double angle, speed; /* [rad], [rad/s] */
};

/* Torque at the shaft [N m] at a voltage [V] and a speed: K i - v / sqrt(v^2 + v_t^2) (T_f + (1 - eta) |K i|),
   i = (U - K v) / R. */
double motor_torque(const struct motor *motor, double volts, double speed);

/* The shaft after a time [s], by the midpoint rule: J v' = torque - d v - T_c sin(n angle). */
struct shaft motor_turned(const struct motor *motor, struct shaft shaft, double volts, double time);

#endif
