/* FMI 2.0 for co-simulation around the functions of model.h: every function that the standard lists.
   An instance is one struct without pointers, so its state is saved by copying it. */

#include "model.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#if defined(_WIN32)
#define EXPORTED __declspec(dllexport)
#else
#define EXPORTED __attribute__((visibility("default")))
#endif

enum { OK, WARNING, DISCARD, ERROR }; /* fmi2Status */

typedef struct {
    model_state state;
    double values[N_INPUTS + N_OUTPUTS];
    double start; /* s */
    double calls; /* of the model since then */
} instance;

typedef unsigned int reference;

static void clear(instance *m)
{
    memset(m, 0, sizeof *m);
}

/* Where nothing of a type exists, a call is fine that asks for nothing. */
static int none(size_t asked)
{
    return asked ? ERROR : OK;
}

EXPORTED const char *fmi2GetTypesPlatform(void)
{
    return "default";
}

EXPORTED const char *fmi2GetVersion(void)
{
    return "2.0";
}

EXPORTED int fmi2SetDebugLogging(void *c, int on, size_t n, const char *const categories[])
{
    (void)c, (void)on, (void)n, (void)categories;
    return OK;
}

EXPORTED void *fmi2Instantiate(const char *name, int type, const char *guid, const char *resources,
                               const void *functions, int visible, int logging)
{
    (void)name, (void)resources, (void)functions, (void)visible, (void)logging;
    if (type != 1 || strcmp(guid, MODEL_GUID) != 0) /* 1: co-simulation */
        return NULL;
    return calloc(1, sizeof(instance));
}

EXPORTED void fmi2FreeInstance(void *c)
{
    free(c);
}

EXPORTED int fmi2SetupExperiment(void *c, int tolerance_defined, double tolerance, double start,
                                 int stop_defined, double stop)
{
    (void)tolerance_defined, (void)tolerance, (void)stop_defined, (void)stop;
    ((instance *)c)->start = start;
    return OK;
}

EXPORTED int fmi2EnterInitializationMode(void *c)
{
    (void)c;
    return OK;
}

EXPORTED int fmi2ExitInitializationMode(void *c)
{
    (void)c;
    return OK;
}

EXPORTED int fmi2Terminate(void *c)
{
    (void)c;
    return OK;
}

EXPORTED int fmi2Reset(void *c)
{
    clear(c);
    return OK;
}

EXPORTED int fmi2GetReal(void *c, const reference refs[], size_t n, double values[])
{
    for (size_t i = 0; i < n; i++) {
        if (refs[i] >= N_INPUTS + N_OUTPUTS)
            return ERROR;
        values[i] = ((instance *)c)->values[refs[i]];
    }
    return OK;
}

EXPORTED int fmi2SetReal(void *c, const reference refs[], size_t n, const double values[])
{
    for (size_t i = 0; i < n; i++) {
        if (refs[i] >= N_INPUTS)
            return ERROR;
        ((instance *)c)->values[refs[i]] = values[i];
    }
    return OK;
}

#define NONE(name, type)                                                                           \
    EXPORTED int name(void *c, const reference refs[], size_t n, type values[])                    \
    {                                                                                              \
        (void)c, (void)refs, (void)values;                                                         \
        return none(n);                                                                            \
    }

NONE(fmi2GetInteger, int)
NONE(fmi2GetBoolean, int)
NONE(fmi2GetString, const char *)
NONE(fmi2SetInteger, const int)
NONE(fmi2SetBoolean, const int)
NONE(fmi2SetString, const char *const)

EXPORTED int fmi2GetFMUstate(void *c, void **state)
{
    if (*state == NULL)
        *state = malloc(sizeof(instance));
    if (*state == NULL)
        return ERROR;
    memcpy(*state, c, sizeof(instance));
    return OK;
}

EXPORTED int fmi2SetFMUstate(void *c, void *state)
{
    memcpy(c, state, sizeof(instance));
    return OK;
}

EXPORTED int fmi2FreeFMUstate(void *c, void **state)
{
    (void)c;
    free(*state);
    *state = NULL;
    return OK;
}

EXPORTED int fmi2SerializedFMUstateSize(void *c, void *state, size_t *size)
{
    (void)c, (void)state;
    *size = sizeof(instance);
    return OK;
}

EXPORTED int fmi2SerializeFMUstate(void *c, void *state, char bytes[], size_t size)
{
    (void)c;
    if (size < sizeof(instance))
        return ERROR;
    memcpy(bytes, state, sizeof(instance));
    return OK;
}

EXPORTED int fmi2DeSerializeFMUstate(void *c, const char bytes[], size_t size, void **state)
{
    if (size < sizeof(instance) || fmi2GetFMUstate(c, state) != OK)
        return ERROR;
    memcpy(*state, bytes, sizeof(instance));
    return OK;
}

EXPORTED int fmi2GetDirectionalDerivative(void *c, const reference of[], size_t n_of,
                                          const reference by[], size_t n_by, const double by_values[],
                                          double values[])
{
    (void)c, (void)of, (void)n_of, (void)by, (void)n_by, (void)by_values, (void)values;
    return ERROR;
}

EXPORTED int fmi2SetRealInputDerivatives(void *c, const reference refs[], size_t n,
                                         const int orders[], const double values[])
{
    (void)c, (void)refs, (void)orders, (void)values;
    return none(n);
}

EXPORTED int fmi2GetRealOutputDerivatives(void *c, const reference refs[], size_t n,
                                          const int orders[], double values[])
{
    (void)c, (void)refs, (void)orders, (void)values;
    return none(n);
}

/* The model is called once a period, at the instants within the step, on the inputs that hold. */
EXPORTED int fmi2DoStep(void *c, double time, double step, int no_return)
{
    instance *m = c;
    const double due = ceil((time + step - m->start) / MODEL_PERIOD - 1e-6);
    (void)no_return;
    if (step < 0.0)
        return ERROR;
    for (; m->calls < due; m->calls += 1.0)
        model_call(&m->state, m->values, m->values + N_INPUTS);
    return OK;
}

EXPORTED int fmi2CancelStep(void *c)
{
    (void)c;
    return ERROR; /* none is pending */
}

#define STATUS(name, type)                                                                         \
    EXPORTED int name(void *c, int kind, type *value)                                              \
    {                                                                                              \
        (void)c, (void)kind, (void)value;                                                          \
        return DISCARD; /* no step is pending */                                                   \
    }

STATUS(fmi2GetStatus, int)
STATUS(fmi2GetRealStatus, double)
STATUS(fmi2GetIntegerStatus, int)
STATUS(fmi2GetBooleanStatus, int)
STATUS(fmi2GetStringStatus, const char *)
