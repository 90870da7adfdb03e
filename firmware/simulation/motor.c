#include "motor.h"

#include <math.h>

double motor_torque(const struct motor *m, double volts, double speed) {
    double torque = m->constant * (volts - m->constant * speed) / m->resistance;
    double sign = speed / sqrt(speed * speed + m->friction_speed * m->friction_speed);
    return torque - sign * (m->friction + (1.0 - m->efficiency) * fabs(torque));
}

static double acceleration(const struct motor *m, struct shaft s, double volts) {
    double load = m->drag * s.speed + m->cogging * sin(m->teeth * s.angle);
    return (motor_torque(m, volts, s.speed) - load) / m->inertia;
}

struct shaft motor_turned(const struct motor *m, struct shaft s, double volts, double time) {
    struct shaft middle = {s.angle + 0.5 * time * s.speed, s.speed + 0.5 * time * acceleration(m, s, volts)};
    struct shaft after = {s.angle + time * middle.speed, s.speed + time * acceleration(m, middle, volts)};
    return after;
}
