/* A lag of first order, x' = (u - x) / T with T = 0.5 s, as an FMU of FMI 2.0: exact for constant
 * inputs. FAULT selects a way to misbehave at AT seconds. */

#include <math.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#ifndef FAULT
#define FAULT NONE
#endif
#ifndef AT
#define AT 0.5
#endif

enum {
    NONE, CRASH, ABORT, EXIT, HANG, NOT_A_NUMBER, INFINITE, ERROR, FATAL, DISCARD, PENDING, STATUS,
    NOISE, NO_INSTANCE, NO_INITIALIZATION, ABORT_ON_LOAD, CRASH_AT_END, WRITE, HANG_AT_END,
    TERMINATE
};

typedef struct {
    void (*logger)(void *, const char *, int, const char *, const char *, ...);
    void *(*allocate)(size_t, size_t);
    void (*release)(void *);
    void *finished;
    void *environment;
} Callbacks;

typedef struct { double time, x, u, gain; int count; } State;

typedef struct { State now; const Callbacks *callbacks; double asked; int logging; } Lag;

static const double PERIOD = 0.5;

__attribute__((constructor)) static void load(void) { if (FAULT == ABORT_ON_LOAD) abort(); }

const char *fmi2GetTypesPlatform(void) { return "default"; }
const char *fmi2GetVersion(void) { return "2.0"; }
int fmi2SetDebugLogging(void *c, int on, size_t n, const char *const names[]) { return 0; }

void *fmi2Instantiate(const char *name, int type, const char *guid, const char *resources,
                      const Callbacks *callbacks, int visible, int logging) {
    if (FAULT == NO_INSTANCE || strcmp(guid, "lag") != 0) {
        callbacks->logger(callbacks->environment, name, 3, "error", "no instance of %s", guid);
        return NULL;
    }
    Lag *lag = calloc(1, sizeof *lag);
    lag->callbacks = callbacks;
    lag->logging = logging;
    lag->now.gain = 1.0;
    return lag;
}

void fmi2FreeInstance(void *c) { free(c); }
int fmi2SetupExperiment(void *c, int has, double tolerance, double start, int stops, double stop) {
    return 0;
}
int fmi2EnterInitializationMode(void *c) { return 0; }
int fmi2ExitInitializationMode(void *c) { return FAULT == NO_INITIALIZATION ? 3 : 0; }
int fmi2Terminate(void *c) {
    if (FAULT == CRASH_AT_END) raise(SIGSEGV);
    while (FAULT == HANG_AT_END) pause();
    return 0;
}
int fmi2Reset(void *c) { return 0; }

static double *variable(Lag *lag, unsigned reference) {
    double *all[] = {&lag->now.time, &lag->now.u, &lag->now.x, &lag->now.gain};
    return reference < 4 ? all[reference] : NULL;
}

int fmi2GetReal(void *c, const unsigned vr[], size_t n, double value[]) {
    Lag *lag = c;
    for (size_t i = 0; i < n; i++) {
        value[i] = *variable(lag, vr[i]);
        if (lag->now.time >= AT && vr[i] == 2) {
            if (FAULT == NOT_A_NUMBER) value[i] = NAN;
            if (FAULT == INFINITE) value[i] = -INFINITY;
        }
    }
    return 0;
}
int fmi2SetReal(void *c, const unsigned vr[], size_t n, const double value[]) {
    for (size_t i = 0; i < n; i++) *variable(c, vr[i]) = value[i];
    return 0;
}
int fmi2GetInteger(void *c, const unsigned vr[], size_t n, int value[]) {
    for (size_t i = 0; i < n; i++) value[i] = ((Lag *)c)->now.count;
    return 0;
}
int fmi2SetInteger(void *c, const unsigned vr[], size_t n, const int value[]) {
    for (size_t i = 0; i < n; i++) ((Lag *)c)->now.count = value[i];
    return 0;
}
int fmi2GetBoolean(void *c, const unsigned vr[], size_t n, int value[]) { return 3; }
int fmi2SetBoolean(void *c, const unsigned vr[], size_t n, const int value[]) { return 3; }
int fmi2GetString(void *c, const unsigned vr[], size_t n, const char *value[]) { return 3; }
int fmi2SetString(void *c, const unsigned vr[], size_t n, const char *const value[]) { return 3; }

int fmi2GetFMUstate(void *c, void **state) {
    if (!*state) *state = malloc(sizeof(State));
    *(State *)*state = ((Lag *)c)->now;
    return 0;
}
int fmi2SetFMUstate(void *c, void *state) { ((Lag *)c)->now = *(State *)state; return 0; }
int fmi2FreeFMUstate(void *c, void **state) { free(*state); *state = NULL; return 0; }
int fmi2SerializedFMUstateSize(void *c, void *state, size_t *size) {
    *size = sizeof(State);
    return 0;
}
int fmi2SerializeFMUstate(void *c, void *state, char bytes[], size_t size) {
    memcpy(bytes, state, size);
    return 0;
}
int fmi2DeSerializeFMUstate(void *c, const char bytes[], size_t size, void **state) {
    if (size != sizeof(State)) return 3;
    if (!*state) *state = malloc(sizeof(State));
    memcpy(*state, bytes, size);
    return 0;
}
int fmi2GetDirectionalDerivative(void *c, const unsigned unknown[], size_t n,
                                 const unsigned known[], size_t m, const double dk[], double du[]) {
    return 3;
}
int fmi2SetRealInputDerivatives(void *c, const unsigned vr[], size_t n, const int order[],
                                const double value[]) { return 3; }
int fmi2GetRealOutputDerivatives(void *c, const unsigned vr[], size_t n, const int order[],
                                 double value[]) { return 3; }

static int misbehave(Lag *lag) {
    switch (FAULT) {
    case CRASH: raise(SIGSEGV); return 0;
    case ABORT: fputs("a last word on standard error\n", stderr); abort();
    case EXIT: exit(3);
    case HANG: for (;;) pause();
    case ERROR:
        if (lag->logging)
            lag->callbacks->logger(lag->callbacks->environment, "lag", 3, "error",
                                   "the reason is %d", 42);
        return 3;
    case FATAL: return 4;
    case DISCARD: case TERMINATE: return 2;
    case PENDING: return 5;
    case STATUS: return 17;
    default: return 0;
    }
}

int fmi2DoStep(void *c, double now, double step, int no_return) {
    Lag *lag = c;
    if (FAULT == NOISE) {
        for (int i = 0; i < 100; i++) {
            printf("%d: an FMU that prints much, in many lines, to standard output\n", i);
            fprintf(stderr, "%d: and to standard error\n", i);
        }
        fflush(stdout);
    }
    if (FAULT == WRITE) {
        FILE *file = fopen("written-by-the-fmu.txt", "w");
        if (file) fclose(file);
    }
    if (now + step > AT) {
        int status = misbehave(lag);
        if (status) return status;
    }
    double target = lag->now.gain * lag->now.u;
    lag->now.x = target + (lag->now.x - target) * exp(-step / PERIOD);
    lag->now.time = now + step;
    lag->now.count++;
    return 0;
}
int fmi2CancelStep(void *c) { return 3; }
int fmi2GetStatus(void *c, int kind, int *value) { return 3; }
int fmi2GetRealStatus(void *c, int kind, double *value) {
    *value = ((Lag *)c)->now.time;
    return 0;
}
int fmi2GetIntegerStatus(void *c, int kind, int *value) { return 3; }
int fmi2GetBooleanStatus(void *c, int kind, int *value) { *value = FAULT == TERMINATE; return 0; }
int fmi2GetStringStatus(void *c, int kind, const char **value) { return 3; }
