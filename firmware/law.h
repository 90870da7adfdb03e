/* The law of the speed loop: nectosome.controllers.VariableGainPI, in single precision.

   u = k K_p e + integral of k K_i e,  k = 1 + beta exp(-|r| / w_0),  e = r - speed */
#ifndef LAW_H
#define LAW_H

struct law {
    float proportional, integral, boost, low, most; /* as in settings.h */
    float reference;                                /* r [rad/s] */
    float factor;                                   /* k */
    float error;                                    /* e of the last sample [rad/s] */
    float gain;                                     /* k K_p of the last sample */
    float sum;                                      /* the integral */
    float command;                                  /* u, share of the voltage */
};

/* The reference from now on. */
void law_refer(struct law *law, float reference);

/* Start at a command, without a bump. */
void law_start(struct law *law, float command, float speed);

/* One sample: the command. The integral stops where it would go further beyond a limit; where the gain changes it takes
   up the jump of the proportional part. */
float law_step(struct law *law, float speed, float sample_time);

#endif
