#include "law.h"

#include <math.h>

void law_refer(struct law *law, float reference) {
    law->reference = reference;
    law->factor = 1.0f + law->boost * expf(-fabsf(reference) / law->low);
}

void law_start(struct law *law, float command, float speed) {
    law->error = law->reference - speed;
    law->gain = law->factor * law->proportional;
    law->sum = command - law->gain * law->error;
    law->command = command;
}

float law_step(struct law *law, float speed, float sample_time) {
    float gain = law->factor * law->proportional;
    float error = law->reference - speed;
    float sum = law->sum - (gain - law->gain) * law->error;
    float more = law->factor * law->integral * sample_time * error;
    float free = gain * error + sum + more;
    float command = fminf(fmaxf(free, -law->most), law->most);
    law->sum = (free - command) * more > 0.0f ? sum : sum + more;
    law->gain = gain;
    law->error = error;
    law->command = command;
    return command;
}
