/* A lag of first order, x' = (u - x) / T with T = 0.5 s, and an event every 0.1 s, as an FMU of
 * FMI 3.0: exact for constant inputs. With EARLY it returns early from a step at each event,
 * otherwise the importer must end steps there. FAULT selects a way to misbehave at AT seconds. */

#include <math.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#ifndef FAULT
#define FAULT NONE
#endif
#ifndef AT
#define AT 0.5
#endif

enum { NONE, EARLY, STUCK, BACK, TERMINATE, ENDLESS, TERMINATE_AT_EVENT };

typedef struct { double time, x, u; int events; bool event_mode; } Lag;

typedef void (*Log)(void *, int, const char *, const char *);

static const double PERIOD = 0.5;

static double next_event(const Lag *lag) { return 0.1 * (lag->events + 1); }

const char *fmi3GetVersion(void) { return "3.0"; }
int fmi3SetDebugLogging(void *c, bool on, size_t n, const char *const names[]) { return 0; }

void *fmi3InstantiateCoSimulation(const char *name, const char *token, const char *resources,
                                  bool visible, bool logging, bool events, bool early,
                                  const unsigned required[], size_t n, void *environment, Log log,
                                  void *update) {
    if (strcmp(token, "lag") != 0) {
        if (logging) log(environment, 3, "error", "wrong token");
        return NULL;
    }
    return calloc(1, sizeof(Lag));
}
void fmi3FreeInstance(void *c) { free(c); }
int fmi3EnterInitializationMode(void *c, bool has, double tolerance, double start, bool stops,
                                double stop) { return 0; }
int fmi3ExitInitializationMode(void *c) { ((Lag *)c)->event_mode = true; return 0; }
int fmi3EnterEventMode(void *c) { ((Lag *)c)->event_mode = true; return 0; }
int fmi3EnterStepMode(void *c) { ((Lag *)c)->event_mode = false; return 0; }
int fmi3Terminate(void *c) { return 0; }
int fmi3Reset(void *c) { return 0; }

int fmi3GetFloat64(void *c, const unsigned vr[], size_t n, double value[], size_t m) {
    const Lag *lag = c;
    size_t k = 0;
    for (size_t i = 0; i < n; i++) {
        switch (vr[i]) {
        case 0: value[k++] = lag->time; break;
        case 1: value[k++] = lag->u; break;
        case 2: value[k++] = lag->x; break;
        default: for (int j = 1; j <= 3; j++) value[k++] = j * lag->x;
        }
    }
    return k == m ? 0 : 3;
}
int fmi3SetFloat64(void *c, const unsigned vr[], size_t n, const double value[], size_t m) {
    for (size_t i = 0; i < n; i++) if (vr[i] == 1) ((Lag *)c)->u = value[i];
    return n == m ? 0 : 3;
}
int fmi3GetInt32(void *c, const unsigned vr[], size_t n, int32_t value[], size_t m) {
    for (size_t i = 0; i < m; i++) value[i] = ((Lag *)c)->events;
    return 0;
}

int fmi3UpdateDiscreteStates(void *c, bool *again, bool *terminate, bool *nominals, bool *values,
                             bool *defined, double *time) {
    Lag *lag = c;
    if (!lag->event_mode) return 3;
    if (lag->time >= next_event(lag) - 1e-12) lag->events++;
    *again = FAULT == ENDLESS && lag->time >= AT;
    *terminate = FAULT == TERMINATE_AT_EVENT && lag->time >= AT;
    *nominals = *values = false;
    *defined = FAULT != EARLY;
    *time = next_event(lag);
    return 0;
}

int fmi3DoStep(void *c, double now, double step, bool no_return, bool *event, bool *terminate,
               bool *early, double *last) {
    Lag *lag = c;
    if (lag->event_mode) return 3;
    double end = now + step;
    *event = *terminate = *early = false;
    if (FAULT == EARLY && end > next_event(lag) + 1e-12) {
        end = next_event(lag);
        *early = true;
    }
    *event = FAULT == EARLY && end >= next_event(lag) - 1e-12;
    if (end > AT) {
        if (FAULT == STUCK) { *early = true; *last = now; return 0; }
        if (FAULT == BACK) { *early = true; *last = now - 1.0; return 0; }
        *terminate = FAULT == TERMINATE;
    }
    lag->x = lag->u + (lag->x - lag->u) * exp(-(end - now) / PERIOD);
    lag->time = *last = end;
    return 0;
}

int fmi3GetFMUState(void *c, void **state) {
    if (!*state) *state = malloc(sizeof(Lag));
    memcpy(*state, c, sizeof(Lag));
    return 0;
}
int fmi3SetFMUState(void *c, void *state) { memcpy(c, state, sizeof(Lag)); return 0; }
int fmi3FreeFMUState(void *c, void **state) { free(*state); *state = NULL; return 0; }
int fmi3SerializedFMUStateSize(void *c, void *state, size_t *size) {
    *size = sizeof(Lag);
    return 0;
}
int fmi3SerializeFMUState(void *c, void *state, uint8_t bytes[], size_t size) {
    memcpy(bytes, state, size);
    return 0;
}
int fmi3DeserializeFMUState(void *c, const uint8_t bytes[], size_t size, void **state) {
    if (size != sizeof(Lag)) return 3;
    if (!*state) *state = malloc(sizeof(Lag));
    memcpy(*state, bytes, size);
    return 0;
}

/* Functions that every library has, and that are not called here. */
#define UNUSED(name) int fmi3##name(void) { return 3; }
#define BOTH(type) UNUSED(Get##type) UNUSED(Set##type)
BOTH(Float32) BOTH(Int8) BOTH(UInt8) BOTH(Int16) BOTH(UInt16) BOTH(UInt32) BOTH(Int64) BOTH(UInt64)
BOTH(Boolean) BOTH(String) BOTH(Binary) BOTH(Clock) BOTH(IntervalDecimal) BOTH(IntervalFraction)
BOTH(ShiftDecimal) BOTH(ShiftFraction)
UNUSED(SetInt32) UNUSED(InstantiateModelExchange) UNUSED(InstantiateScheduledExecution)
UNUSED(GetNumberOfVariableDependencies) UNUSED(GetVariableDependencies)
UNUSED(GetDirectionalDerivative) UNUSED(GetAdjointDerivative)
UNUSED(EnterConfigurationMode) UNUSED(ExitConfigurationMode)
UNUSED(EvaluateDiscreteStates) UNUSED(EnterContinuousTimeMode) UNUSED(CompletedIntegratorStep)
UNUSED(SetTime) UNUSED(SetContinuousStates) UNUSED(GetContinuousStateDerivatives)
UNUSED(GetEventIndicators) UNUSED(GetContinuousStates) UNUSED(GetNominalsOfContinuousStates)
UNUSED(GetNumberOfEventIndicators) UNUSED(GetNumberOfContinuousStates)
UNUSED(GetOutputDerivatives) UNUSED(ActivateModelPartition)
